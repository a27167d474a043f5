#!/usr/bin/env python3
"""check_rough_lanes.py: the boundary of rough_lanes.py against that of peers/rough_boundary.py, which follows one walk at a time,
and its evaluation against its own samples. Exits 1 when a share of the light misses by more than 4 standard errors.
Needs mitsuba with LLVM 19 (DRJIT_LIBLLVM_PATH names the library; with LLVM 15 it aborts). One core, a minute.
"""
import math
import random
import sys
from pathlib import Path

import mitsuba as mi
import numpy as np

mi.set_variant("llvm_ad_mono")

import drjit as dr  # noqa: E402

sys.path.append(str(Path(__file__).resolve().parent.parent / "peers"))
import rough_boundary  # noqa: E402
import rough_lanes  # noqa: E402

rough_lanes.register()
ALPHA, INDEX = 0.2, 1.4
MANY, FEW = 4000000, 60000
LIMIT = 4.0
REGIONS = {"reflected, forwards": lambda d: (d[:, 2] > 0) & (d[:, 0] < 0), "reflected, backwards": lambda d: (d[:, 2] > 0) & (d[:, 0] >= 0),
           "transmitted, near the normal": lambda d: d[:, 2] < -0.8, "transmitted, steeply": lambda d: (d[:, 2] < 0) & (d[:, 2] >= -0.8)}


def arrival(side, cosine, n):
    si = dr.zeros(mi.SurfaceInteraction3f, n)
    si.wi = mi.Vector3f(math.sqrt(1 - cosine**2), 0, side * cosine)
    return si


def up(directions, side):
    return np.array(directions).T * [1, 1, side]


def lookout(generator, side, cosine):
    """(directions with the side of arrival up, their density): those in which one facet turns light, mixed with even ones."""
    wi = mi.Vector3f(math.sqrt(1 - cosine**2), 0, cosine)
    ratio = INDEX**side
    m = rough_lanes.visible_normal(wi, ALPHA, *(mi.Float(generator.random(MANY).astype(np.float32)) for _ in range(2)))
    c = dr.dot(wi, m)
    reflected, t = rough_lanes.fresnel(dr.maximum(c, rough_lanes.FEWEST), mi.Float(ratio))
    mirrors = mi.Float(generator.random(MANY).astype(np.float32)) < reflected
    turned = np.array(dr.select(mirrors, 2 * c * m - wi, (c / ratio - t) * m - wi / ratio)).T
    leaves = (turned[:, 2] > 0) == np.array(mirrors)
    z, angle = 2 * generator.random(MANY) - 1, 2 * math.pi * generator.random(MANY)
    even = np.stack([np.sqrt(1 - z * z) * np.cos(angle), np.sqrt(1 - z * z) * np.sin(angle), z], axis=1)
    chosen = leaves & (generator.random(MANY) < 0.7)
    found = np.where(chosen[:, None], turned, even)
    one = np.array(rough_lanes.turning_density(wi, mi.Vector3f(found.T.astype(np.float32)), mi.Float(ratio), ALPHA))
    return found, 0.7 * one + (1 - 0.7 * leaves.mean()) / (4 * math.pi)


def main():
    generator, numbers = np.random.default_rng(1), mi.PCG32(MANY)
    random.seed(1)
    bsdf = mi.load_dict({"type": "crownfit_rough_lanes", "distribution": "ggx", "alpha": ALPHA, "int_ior": INDEX, "ext_ior": 1.0})
    context, failed = mi.BSDFContext(), False
    for side, cosine in ((1, 0.9), (1, 0.3), (-1, 0.9), (-1, 0.6), (-1, 0.2)):
        sample, _ = bsdf.sample(context, arrival(side, cosine, MANY), numbers.next_float32(), mi.Point2f(numbers.next_float32(), numbers.next_float32()))
        lanes = up(sample.wo, side)
        alone = np.array([rough_boundary.walk((math.sqrt(1 - cosine**2), 0.0, cosine), ALPHA, INDEX**side)[0] for _ in range(FEW)])
        towards, density = lookout(generator, side, cosine)
        si = arrival(side, cosine, MANY)
        si.p = mi.Point3f(*(generator.random(MANY).astype(np.float32) for _ in range(3)))
        value = np.array(bsdf.eval(context, si, mi.Vector3f((towards * [1, 1, side]).T.astype(np.float32)))).ravel()
        share = value * np.where(towards[:, 2] < 0, INDEX ** (2 * side), 1.0) / density  # without the n^2 of radiance
        for name, region in REGIONS.items():
            a, b, c = region(lanes), region(alone), share * region(towards)
            for what, x in (("one walk at a time", b), ("evaluation", c)):
                error = math.sqrt(a.var() / len(a) + x.var() / len(x) + 1e-12)
                z = (a.mean() - x.mean()) / error
                failed = failed or abs(z) > LIMIT
                print(f"{'FAIL' if abs(z) > LIMIT else 'ok  '} from {'outside' if side > 0 else 'inside'} at cosine {cosine}, {name}: samples {a.mean():.5f}, {what} {x.mean():.5f} +- {error:.5f}", flush=True)
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
