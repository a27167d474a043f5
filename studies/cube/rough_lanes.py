"""GGX-rough dielectric boundary that keeps all energy, as a BSDF for Mitsuba's vectorised variants (llvm_*).

The law is that of peers/rough_boundary.py: a random walk on the Smith microsurface (Heitz, Hanika, d'Eon and Dachsbacher
2016) with normals drawn by spherical caps (Dupuy and Benyoub 2023). This one follows many walks side by side. It can also
be evaluated, so that Mitsuba looks for lamps from the boundary:

- `eval` follows one walk and adds, at every meeting, the density with which it turns to the lamp and leaves. The mean of
  this over walks is the BSDF. The numbers of a walk come from a hash of the place and both directions.
- `pdf` is not the density of `sample`, which has no closed form. It is the density of one meeting without shadowing, mixed
  with a uniform one. It serves only to weigh lamps that were sampled against lamps that were hit. `sample` and `eval_pdf`
  return the same function, so the two weights add up to 1, and nothing is biased.

Heights are carried as the share of the microsurface below a point (0..1). Below the surface everything is upside down.
Directions of the walk lie in the frame in which the side of `wi` is up.
"""
import drjit as dr
import mitsuba as mi

FEWEST = 1e-7  # cosines are kept above this
LOWEST = 1e-12  # shares are kept above this
UNIFORM = 0.05  # share of the uniform density in `pdf`


def fresnel(cosine, eta):
    """(reflected share, cosine of refraction) at a flat boundary; eta = index behind / index in front."""
    s2 = (1 - cosine * cosine) / (eta * eta)
    t = dr.safe_sqrt(1 - s2)
    s, p = (cosine - eta * t) / (cosine + eta * t), (t - eta * cosine) / (t + eta * cosine)
    return dr.select(s2 >= 1, 1.0, 0.5 * (s * s + p * p)), t


def smith_lambda(z, alpha):
    """Smith's Lambda of a direction with this cosine, which may be negative."""
    t2 = alpha * alpha * (1 - z * z) / dr.maximum(z * z, 1e-20)
    return 0.5 * (dr.copysign(dr.sqrt(1 + t2), z) - 1)


def projected_area(z, alpha):
    """Area of the microsurface that a direction with this cosine sees, per area of the surface."""
    return 0.5 * (z + dr.sqrt(z * z + alpha * alpha * (1 - z * z)))


def facets(z, alpha):
    """Density of microsurface normals with this cosine."""
    d = 1 + z * z * (alpha * alpha - 1)
    return dr.select(z > 0, alpha * alpha / (dr.pi * d * d), 0.0)


def visible_normal(w, alpha, u, v):
    """A normal of the microsurface as seen from direction w, which may point down."""
    s = dr.normalize(mi.Vector3f(alpha * w.x, alpha * w.y, w.z))
    c = (1 - u) * (1 + s.z) - s.z
    r = dr.safe_sqrt(1 - c * c)
    sin, cos = dr.sincos(2 * dr.pi * v)
    m = mi.Vector3f(alpha * (s.x + r * cos), alpha * (s.y + r * sin), dr.maximum(0.0, s.z + c))
    n = dr.norm(m)
    return dr.select(n > 0, m / n, mi.Vector3f(0, 0, 1))


def turning_density(w, wo, ratio, alpha):
    """Density per solid angle with which light that arrived from w is turned to wo by the facet it meets; both as seen from
    the side of w, that side being up. ratio = index on the other side / index on this side."""
    through = wo.z < 0
    h = dr.normalize(dr.select(through, -(w + ratio * wo), w + wo))
    h = dr.select(h.z < 0, -h, h)
    a, b = dr.dot(w, h), dr.dot(wo, h)
    reflected, _ = fresnel(dr.maximum(a, FEWEST), ratio)
    visible = facets(h.z, alpha) / dr.maximum(projected_area(w.z, alpha), 1e-12)
    mirror = reflected * visible * 0.25
    refract = (1 - reflected) * visible * a * ratio * ratio * dr.abs(b) / dr.maximum(dr.square(a + ratio * b), 1e-12)
    possible = (a > 0) & dr.select(through, b < 0, b > 0)
    return dr.select(possible, dr.select(through, refract, mirror), 0.0)


def next_share(z, share, alpha, u):
    """(share below the next meeting of a ray that climbs with cosine z from `share`, whether it leaves upwards instead)."""
    share, power = dr.maximum(share, LOWEST), smith_lambda(z, alpha)
    leaves = (z > 0.99999) | ((z > 1e-5) & (u >= 1 - dr.power(share, power)))
    met = dr.minimum(1.0, share * dr.power(1 - u, -1 / dr.select(power == 0, 1.0, power)))
    met = dr.select(z < -0.99999, u * share, met)
    met = dr.select(dr.abs(z) < 1e-5, share, met)
    return dr.clip(met, LOWEST, 1.0), leaves


@dr.syntax
def walk(wi, wo, alpha, eta, random, active):
    """Follows light backwards from wi (wi.z > 0) through the microsurface. Returns the direction in which it leaves, and the
    density with which it could have left to wo, an estimate. eta = index below / index above."""
    d = mi.Vector3f(-wi)
    above, share, density = mi.Bool(True), mi.Float(1.0), mi.Float(0.0)
    going = mi.Bool(active)
    while going:
        up = dr.select(above, mi.Float(1), mi.Float(-1))
        here, leaves = next_share(up * d.z, dr.select(above, share, 1 - share), alpha, random.next_float32())
        going &= ~leaves
        w, ratio = -up * d, dr.select(above, eta, 1 / eta)
        goal = up * wo
        below_goal = dr.maximum(dr.select(goal.z > 0, here, 1 - here), LOWEST)
        gets_out = dr.power(below_goal, smith_lambda(dr.abs(goal.z), alpha))
        density += dr.select(going, turning_density(w, goal, ratio, alpha) * gets_out, 0.0)
        m = visible_normal(w, alpha, random.next_float32(), random.next_float32())
        cosine = dr.dot(w, m)
        reflected, t = fresnel(dr.maximum(cosine, FEWEST), ratio)
        mirrors = random.next_float32() < reflected
        turned = dr.select(mirrors, 2 * cosine * m - w, (cosine / ratio - t) * m - w / ratio)
        d = dr.select(going, dr.normalize(up * turned), d)
        share = dr.select(going, dr.select(above, here, 1 - here), share)
        above = dr.select(going & ~mirrors, ~above, above)
    return d, density


def numbers_of(*values):
    """A random generator whose seed is a hash of these numbers."""
    a, b = mi.UInt32(0x9E3779B9), mi.UInt32(0x243F6A88)
    for value in values:
        a, b = mi.sample_tea_32(a ^ dr.reinterpret_array(mi.UInt32, mi.Float(value)), b, 4)
    return mi.PCG32(initstate=mi.UInt64(a), initseq=mi.UInt64(b))


class RoughLanes(mi.BSDF):
    """alpha: GGX roughness; int_ior, ext_ior as in `dielectric`."""

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        assert props["distribution"] == "ggx"
        self.alpha, self.eta = props["alpha"], props["int_ior"] / props["ext_ior"]
        sides = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
        self.m_components = [mi.BSDFFlags.GlossyReflection | sides, mi.BSDFFlags.GlossyTransmission | sides | mi.BSDFFlags.NonSymmetric]
        self.m_flags = self.m_components[0] | self.m_components[1]

    def side_of(self, wi):
        """(1 in front or -1 behind, index on the other side / index on this side, wi with this side up)"""
        side = dr.select(wi.z > 0, mi.Float(1), mi.Float(-1))
        up = mi.Vector3f(wi.x, wi.y, dr.maximum(side * wi.z, FEWEST))
        return side, dr.select(wi.z > 0, mi.Float(self.eta), mi.Float(1 / self.eta)), up

    def weight_density(self, up, wo, eta):
        return (1 - UNIFORM) * turning_density(up, wo, eta, self.alpha) + UNIFORM / (4 * dr.pi)

    def sample(self, ctx, si, sample1, sample2, active=True):
        side, eta, up = self.side_of(si.wi)
        random = numbers_of(sample1, sample2.x, sample2.y)
        d, _ = walk(up, mi.Vector3f(0, 0, 1), mi.Float(self.alpha), eta, random, mi.Bool(active))
        through = d.z < 0
        bs = dr.zeros(mi.BSDFSample3f)
        bs.wo = mi.Vector3f(d.x, d.y, side * d.z)
        bs.pdf = self.weight_density(up, d, eta)
        bs.eta = dr.select(through, eta, 1.0)
        bs.sampled_component = dr.select(through, mi.UInt32(1), mi.UInt32(0))
        bs.sampled_type = dr.select(through, mi.UInt32(+mi.BSDFFlags.GlossyTransmission), mi.UInt32(+mi.BSDFFlags.GlossyReflection))
        return bs, mi.Spectrum(dr.select(through, 1 / (eta * eta), 1.0)) & active

    def eval_pdf(self, ctx, si, wo, active=True):
        side, eta, up = self.side_of(si.wi)
        goal = mi.Vector3f(wo.x, wo.y, side * wo.z)
        random = numbers_of(si.p.x, si.p.y, si.p.z, up.x, up.y, wo.x, wo.y, wo.z)
        _, density = walk(up, goal, mi.Float(self.alpha), eta, random, mi.Bool(active))
        value = density * dr.select(goal.z < 0, 1 / (eta * eta), 1.0)
        return mi.Spectrum(value) & active, self.weight_density(up, goal, eta) & active

    def eval(self, ctx, si, wo, active=True):
        return self.eval_pdf(ctx, si, wo, active)[0]

    def pdf(self, ctx, si, wo, active=True):
        side, eta, up = self.side_of(si.wi)
        return self.weight_density(up, mi.Vector3f(wo.x, wo.y, side * wo.z), eta) & active

    def to_string(self):
        return f"RoughLanes[alpha={self.alpha}, eta={self.eta}]"


def register():
    """Makes the plug-in known to the variant in use."""
    mi.register_bsdf("crownfit_rough_lanes", RoughLanes)
