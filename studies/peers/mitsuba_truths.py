#!/usr/bin/env python3
"""mitsuba_truths.py CROWNFIT: what `crownfit export` writes, rendered by Mitsuba, against answers known in closed form or from
tables; about three minutes on one core. Exits 1 when one misses by more than 4 standard errors plus what is stated."""
import json
import math
import random
import sys
import tempfile
from pathlib import Path

import numpy as np

import mitsuba_scene
import mitsuba as mi  # after mitsuba_scene, which chooses the variant
import rough_boundary
from make_peer_captures import CAPTURES, DISTANCE, FACING, disc, dome, lamp, layer, photograph, sphere, turn, write_capture

failed = False
GHOST = layer("ghost", 1.0, 0, 0, 0)  # a capture needs an object; nobody sees this one


def report(what, got, expected, error, allowance=0.0):
    """One line; `error`: standard error of `got`, `allowance`: what the set-up itself may be off by."""
    global failed
    good = abs(got - expected) <= 4 * error + allowance
    failed = failed or not good
    print(f"{'ok  ' if good else 'FAIL'} {what}: {got:.5f}, expected {expected:.5f} (standard error {error:.5f}, allowed besides {allowance:.5f})", flush=True)


def picture(folder, name="shot", paths=64, seeds=4):
    """(mean picture, standard error of its mean over all pixels), from several seeds."""
    mitsuba_scene.export(sys.argv[1], folder, folder / "exported")
    pictures = mitsuba_scene.render(folder / "exported", name, paths, range(seeds), "volpath").mean(-1)
    return pictures.mean(0), math.sqrt(pictures.var(0, ddof=1).sum() / seeds) / pictures[0].size


def inside(seen):
    """Pixels of an object brighter than 0.5 whose neighbours are on it too."""
    return seen[1:-1, 1:-1][np.lib.stride_tricks.sliding_window_view(seen > 0.5, (3, 3)).all(axis=(2, 3))]


def camera(folder):
    """A small white ball off the axis, seen by a turned camera with its principal point off the centre, comes to lie
    where a pinhole puts it, and its place is free of light that the camera should not see."""
    place = np.array([2.5, 1.5, -1.0])
    rotation = turn(20, 2) @ FACING @ turn(30, 0) @ turn(-15, 1)
    vertices, faces = sphere(1.0, 48)
    write_capture(folder, [GHOST], {"ghost": sphere(0.3), "ball": (vertices + place, faces)}, [dome()], [photograph("shot", ["dome"], rotation, scenery=["ball"])],
                  scenery=[{"name": "ball", "mesh": "mesh/ball.ply", "reflectance_rgb": [1, 1, 1]}], centre=(20, 30))
    seen, error = picture(folder)
    p = rotation @ place + [0, 0, DISTANCE]
    rows, columns = np.indices(seen.shape) + 0.5
    focal = 48 * DISTANCE / 12
    report("column of a ball (pixels)", (seen * columns).sum() / seen.sum(), focal * p[0] / p[2] + 20, 0, 0.02)
    report("row of a ball (pixels)", (seen * rows).sum() / seen.sum(), focal * p[1] / p[2] + 30, 0, 0.02)
    report("white ball under a dome of radiance 1/pi", inside(seen).mean(), 1.0, 0, 0.01)
    report("beside the ball", seen[0, 0], 0.0, 0)


def lamps(folder):
    """A white tile lit by lamps of known irradiance that stand between it and the camera and behind each other, with
    others that turn their back to it."""
    tile = {"point_mm": [0, 0, 0], "normal": [0, 0, 1], "size_mm": 4, "reflectance_rgb": [1, 1, 1]}
    square = {"name": "square", "type": "rectangle", "frame": "camera", "centre_mm": [0, 0, DISTANCE - 60],
              "half_axis_u_mm": [30, 0, 0], "half_axis_v_mm": [0, 20, 0], "radiance_rgb": [1, 1, 1]}  # u x v looks along +z of the camera
    away = square | {"name": "away", "half_axis_u_mm": [-30, 0, 0], "centre_mm": [0, 0, DISTANCE - 50]}
    rig = [lamp("front", [0, 0, 100], 40, 0.5), lamp("back", [0, 0, -50], 40, 7.0), square, away]
    write_capture(folder, [GHOST], {"ghost": sphere(0.3)}, rig, [photograph("shot", [x["name"] for x in rig], backing="white"), photograph("square", ["square"], backing="white")],
                  backings={"white": tile}, width_mm=0.4, pixels=8)
    x, y = 30 / 60, 20 / 60
    rectangle = 2 * (x / math.hypot(1, x) * math.atan(y / math.hypot(1, x)) + y / math.hypot(1, y) * math.atan(x / math.hypot(1, y)))
    report("tile under a rectangle", *insert(picture(folder, "square", 500), rectangle))
    report("tile under a disk and a rectangle", *insert(picture(folder, "shot", 500), rectangle + math.pi * 0.5 * 40**2 / (40**2 + 100**2)))


def insert(seen, expected):
    return seen[0].mean(), expected, seen[1]


def furnaces(folder):
    """The peer captures without absorption in a dome of radiance 1/pi: 1 wherever the object fills the pixel."""
    for name, write in CAPTURES.items():
        if name in ("coloured_disc", "open_sphere", "environment"):
            continue  # where channels scatter differently 1 is true on average only; a neck is black from outside; no dome
        write(folder / name)
        capture, truth = (json.loads((folder / name / file).read_text()) for file in ("capture.json", "truth.json"))
        for item in truth["layers"]:
            item["absorption_per_mm"] = 0
        (folder / name / "truth.json").write_text(json.dumps(truth))
        capture["photographs"] = capture["photographs"][:1]
        capture["photographs"][0]["lights"] = ["dome"]
        (folder / name / "capture.json").write_text(json.dumps(capture))
        rig = json.loads((folder / name / "calib/light_rig.json").read_text())
        rig["lights"][0] = dome()
        (folder / name / "calib/light_rig.json").write_text(json.dumps(rig))
        seen = picture(folder / name, capture["photographs"][0]["name"], paths=4, seeds=2)[0]
        pixels = inside(seen)
        report(f"white furnace, {name}, darkest of {pixels.size} pixels", pixels.min(), 1.0, 0, 0.001)
        report(f"white furnace, {name}, brightest", pixels.max(), 1.0, 0, 0.001)


def slabs(folder):
    """Discs so wide that no light leaves sideways, seen from in front under a dome: the pixel is reflectance plus
    transmittance of collimated light (reciprocity); with a black tile close behind, the reflectance alone."""
    black = {"black": {"point_mm": [0, 0, -0.52], "normal": [0, 0, 1], "size_mm": 400, "reflectance_rgb": [0, 0, 0]}}
    shots = [photograph("both", ["dome"]), photograph("reflectance", ["dome"], backing="black")]
    # Adding-doubling (iadpython 0.6, 40 to 56 angles, converged to 2e-5): index 1.54, g 0.8, scattering 10/mm, absorption 0.05/mm, 1 mm.
    write_capture(folder / "ceramic", [layer("slab", 1.54, 0.8, 2.0, 0.05)], {"slab": disc(40, 1)}, [dome()], shots, backings=black, width_mm=1, pixels=16)
    report("ceramic slab, reflectance", *insert(picture(folder / "ceramic", "reflectance", 1000), 0.41133), 2e-4)
    report("ceramic slab, reflectance and transmittance", *insert(picture(folder / "ceramic", "both", 1000), 0.79919), 2e-4)
    # van de Hulst 1980: no change of index, albedo 0.9, optical thickness 2, g 0.75. Unscattered light has met nothing
    # that hides the dome from the camera, so exp(-2) is missing from the sum.
    write_capture(folder / "hulst", [layer("slab", 1.0, 0.75, 0.45, 0.2)], {"slab": disc(40, 1)}, [dome()], shots, backings=black, width_mm=1, pixels=16)
    report("van de Hulst's slab, reflectance", *insert(picture(folder / "hulst", "reflectance", 4000), 0.09739), 1e-4)
    report("van de Hulst's slab, scattered light", *insert(picture(folder / "hulst", "both", 4000), 0.09739 + 0.66096 - math.exp(-2)), 1e-4)


def stack(index, optical_depth):
    """(reflectance, transmittance) of normally incident light on clear layers: index has two more entries than
    optical_depth. Added up from the last layer on, without interference."""
    reflect = [((a - b) / (a + b)) ** 2 for a, b in zip(index, index[1:])]
    r, t = reflect[-1], 1 - reflect[-1]
    for k in reversed(range(len(optical_depth))):
        e = math.exp(-optical_depth[k])
        many = 1 / (1 - reflect[k] * r * e * e)
        t, r = (1 - reflect[k]) * e * many * t, reflect[k] + (1 - reflect[k]) ** 2 * e * e * r * many
    return r, t


def nesting(folder):
    """A clear disc inside a clear disc, straight through: each surface has the right indices and media on its sides."""
    write_capture(folder, [layer("outer", 1.8, 0, 0, 0.3), layer("inner", 1.3, 0, 0, 0.9)], {"outer": disc(40, 2), "inner": disc(30, 1)}, [dome()],
                  [photograph("shot", ["dome"])], width_mm=0.5, pixels=16)
    expected = sum(stack([1, 1.8, 1.3, 1.8, 1], [0.15, 0.9, 0.15]))
    report("nested clear discs", *insert(picture(folder, paths=1000), expected), 2e-4)


def roughness():
    """First meetings of light with the microsurface: the walk against Mitsuba's visible normals and Smith's functions in
    closed form (Heitz 2016): of the light reflected by a facet, (1 + A) / (1 + A + B) gets out at once, of the refracted
    (1 + A) Beta(1 + A, 1 + B), A and B the Lambda of the directions of arrival and leaving. Prints the share that
    Mitsuba's roughdielectric loses."""
    n, alpha = 60000, 0.3
    random.seed(3)
    bsdf = mi.load_dict({"type": "roughdielectric", "distribution": "ggx", "alpha": alpha, "int_ior": 1.54, "ext_ior": 1.0})
    context = mi.BSDFContext(mi.TransportMode.Importance)
    for side, cosine in ((1, 0.9), (1, 0.3), (-1, 0.9), (-1, 0.3)):
        sine = math.sqrt(1 - cosine**2)
        si = mi.SurfaceInteraction3f()
        si.wi = mi.Vector3f(sine, 0, side * cosine)
        a = rough_boundary.smith_lambda(cosine, alpha)
        expected, loss = np.zeros((n, 2)), 0.0
        for i in range(n):
            sample, weight = bsdf.sample(context, si, random.random(), mi.Point2f(random.random(), random.random()))
            loss += (1 - weight[0]) / n
            z = sample.wo[2]
            if weight[0] <= 0 or z == 0:
                continue
            b = rough_boundary.smith_lambda(abs(z), alpha)
            if z * side > 0:
                expected[i, 0] = (1 + a) / (1 + a + b)
            else:
                expected[i, 1] = (1 + a) * math.exp(math.lgamma(1 + a) + math.lgamma(1 + b) - math.lgamma(2 + a + b))
        got = np.zeros((n, 2))
        for i in range(n):
            d, meetings = rough_boundary.walk((sine, 0.0, cosine), alpha, 1.54**side)
            if meetings == 1:
                got[i, 0 if d[2] > 0 else 1] = 1
        where = f"roughness {alpha}, from {'outside' if side > 0 else 'inside'} at cosine {cosine}"
        for k, what in enumerate(("reflected", "refracted")):
            report(f"{where}: {what} by one meeting", got[:, k].mean(), expected[:, k].mean(), math.sqrt((got[:, k].var() + expected[:, k].var()) / n))
        print(f"     roughdielectric loses {loss:.3f} here")


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        camera(folder / "camera")
        lamps(folder / "lamps")
        nesting(folder / "nesting")
        furnaces(folder / "furnace")
        slabs(folder / "slab")
    roughness()
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
