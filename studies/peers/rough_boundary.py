"""GGX-rough dielectric boundary that keeps all energy, as a BSDF for Mitsuba's scalar variants.

Mitsuba's own `roughdielectric` follows light to the first meeting with the microsurface only and drops what meets it
again; crownfit goes on until the light has left. This plug-in does so too: a random walk on the Smith microsurface
(Heitz, Hanika, d'Eon, Dachsbacher, "Multiple-scattering microfacet BSDFs with the Smith model", 2016), written from
the paper, with normals drawn by spherical caps (Dupuy and Benyoub 2023). Every walk has weight 1, times the n^2 of
radiance. It can be sampled but not evaluated, so it calls itself a delta distribution: lights are found by chance.

The height of a point is carried as the share of the microsurface below it (0..1): with this, the shape of the height
distribution drops out. Below the surface everything is upside down. It draws from Python's `random`: one thread only.
"""
import math
import random

import mitsuba as mi


def fresnel(cosine, eta):
    """(Reflected share, cosine of refraction) at a flat boundary; eta = index behind / index in front, cosine > 0."""
    s2 = (1 - cosine * cosine) / (eta * eta)
    if s2 >= 1:
        return 1.0, 0.0
    t = math.sqrt(1 - s2)
    s, p = (cosine - eta * t) / (cosine + eta * t), (t - eta * cosine) / (t + eta * cosine)
    return 0.5 * (s * s + p * p), t


def smith_lambda(z, alpha):
    """Smith's Lambda of a direction with this cosine, which may be negative (GGX)."""
    t2 = alpha * alpha * (1 - z * z) / (z * z)
    return 0.5 * (math.copysign(math.sqrt(1 + t2), z) - 1)


def visible_normal(w, alpha):
    """A normal of the microsurface (pointing up), drawn as seen from direction w, also when w points down."""
    x, y, z = alpha * w[0], alpha * w[1], w[2]
    n = 1 / math.sqrt(x * x + y * y + z * z)
    x, y, z = x * n, y * n, z * n
    c = (1 - random.random()) * (1 + z) - z
    s, phi = math.sqrt(max(0.0, 1 - c * c)), 2 * math.pi * random.random()
    x, y, z = alpha * (x + s * math.cos(phi)), alpha * (y + s * math.sin(phi)), max(0.0, z + c)
    n = math.sqrt(x * x + y * y + z * z)
    return (x / n, y / n, z / n) if n > 0 else (0.0, 0.0, 1.0)


def next_share(z, share, alpha):
    """Share below the next meeting of a ray that climbs with cosine z from `share`; None when it leaves upwards."""
    if z > 0.99999:
        return None
    u = random.random()
    if z < -0.99999:
        return u * share
    if abs(z) < 1e-5:
        return share
    power = smith_lambda(z, alpha)
    if z > 0 and u >= 1 - share ** power:
        return None
    return min(1.0, share * (1 - u) ** (-1 / power))


def walk(wi, alpha, eta):
    """From direction wi (towards where the light of the walk came from, wi.z > 0) through the microsurface: (direction
    in which it leaves, number of meetings). eta = index below / index above."""
    d, above, share, meetings = (-wi[0], -wi[1], -wi[2]), True, 1.0, 0
    while True:
        up = 1.0 if above else -1.0
        free = next_share(up * d[2], share if above else 1 - share, alpha)
        if free is None:
            return d, meetings
        share = free if above else 1 - free
        meetings += 1
        w = (-up * d[0], -up * d[1], -up * d[2])  # as seen from the side the ray is on, that side being up
        m = visible_normal(w, alpha)
        cosine = w[0] * m[0] + w[1] * m[1] + w[2] * m[2]
        ratio = eta if above else 1 / eta
        reflected, t = fresnel(max(cosine, 1e-7), ratio)
        if random.random() < reflected:
            d = tuple(up * (2 * cosine * m[k] - w[k]) for k in range(3))
        else:
            d = tuple(up * ((cosine / ratio - t) * m[k] - w[k] / ratio) for k in range(3))
            above = not above
        n = 1 / math.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
        d = (d[0] * n, d[1] * n, d[2] * n)


class RoughBoundary(mi.BSDF):
    """alpha: GGX roughness; int_ior, ext_ior as in `dielectric`."""

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        assert props["distribution"] == "ggx"
        self.alpha, self.eta = props["alpha"], props["int_ior"] / props["ext_ior"]
        sides = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
        self.m_components = [mi.BSDFFlags.DeltaReflection | sides, mi.BSDFFlags.DeltaTransmission | sides | mi.BSDFFlags.NonSymmetric]
        self.m_flags = self.m_components[0] | self.m_components[1]

    def sample(self, ctx, si, sample1, sample2, active):
        x, y, z = float(si.wi[0]), float(si.wi[1]), float(si.wi[2])
        side, eta = (1.0, self.eta) if z > 0 else (-1.0, 1 / self.eta)
        d, _ = walk((x, y, max(side * z, 1e-7)), self.alpha, eta)
        through = d[2] < 0
        bs = mi.BSDFSample3f()
        bs.wo = mi.Vector3f(d[0], d[1], side * d[2])
        bs.pdf = 1.0
        bs.eta = eta if through else 1.0
        bs.sampled_component = 1 if through else 0
        bs.sampled_type = +(mi.BSDFFlags.DeltaTransmission if through else mi.BSDFFlags.DeltaReflection)
        return bs, mi.Spectrum(1 / (eta * eta) if through else 1.0)

    def eval(self, ctx, si, wo, active):
        return mi.Spectrum(0.0)

    def pdf(self, ctx, si, wo, active):
        return 0.0

    def eval_pdf(self, ctx, si, wo, active):
        return mi.Spectrum(0.0), 0.0

    def to_string(self):
        return f"RoughBoundary[alpha={self.alpha}, eta={self.eta}]"


def register():
    """Makes the plug-in known to the variant in use."""
    mi.register_bsdf("crownfit_rough", RoughBoundary)
