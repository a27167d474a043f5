"""Henyey and Greenstein's phase function that also plays roulette, for Mitsuba's vectorised variants.

Mitsuba's own roulette ends one path in 20 at every collision, at the least. In a medium that absorbs less, survivors gain
more weight than absorption takes, and the variance has no limit. This phase function ends the share 1 - `survival` of
paths, and divides the weight of the others by `survival`. With the albedo as `survival`, weights stay about 1.
"""
import drjit as dr
import mitsuba as mi


class RoulettePhase(mi.PhaseFunction):
    """g: mean cosine; survival: share of paths that go on after a collision."""

    def __init__(self, props):
        mi.PhaseFunction.__init__(self, props)
        self.survival = props["survival"]
        self.m_flags = mi.PhaseFunctionFlags.Anisotropic
        self.turns = mi.load_dict({"type": "hg", "g": props["g"]})

    def sample(self, ctx, mei, sample1, sample2, active=True):
        wo, weight, pdf = self.turns.sample(ctx, mei, sample1, sample2, active)
        return wo, dr.select(sample1 < self.survival, weight / self.survival, 0.0), pdf

    def eval_pdf(self, ctx, mei, wo, active=True):
        return self.turns.eval_pdf(ctx, mei, wo, active)

    def to_string(self):
        return f"RoulettePhase[survival={self.survival}]"


def register():
    """Makes the plug-in known to the variant in use."""
    mi.register_phase("crownfit_roulette", RoulettePhase)
