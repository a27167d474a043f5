#!/usr/bin/env python3
"""wrong_statements.py CROWNFIT REFERENCE WORK [NAME] [--seed N] [--pixels N] [--only WRONG ...] [-- options of fit]:
what a fit says of a capture in which one thing is stated wrongly. The capture NAME (disc00, crown01, ...) that
REFERENCE/acceptance/make_recipes.py draws for the seed, with stated calibration errors and one photograph without polarisers
more, is fitted as it is and once with every mistake below. Printed for each: the status, the largest errors of what is
called `fitted`, the furthest in stated deviations, patches and sixteenths of the photographs over noise, and what the
result says. A mistake that moved a fitted value by more than three deviations in a usable result without a word is SILENT.
What a run was stopped at is gone on with; results in WORK stay valid for one program. 1 to 5 minutes a row on two cores.
"""
import argparse
import json
import math
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy
import OpenImageIO

import tables
from recovery_study import values_of

OBVIOUS = 3.0  # stated deviations


def edit(file, change):
    node = json.loads(file.read_text())
    change(node)
    file.write_text(json.dumps(node, indent=1))


def of_capture(change):
    return lambda capture: edit(capture / "capture.json", change)


def of_rig(change):
    return lambda capture: edit(capture / "calib/light_rig.json", change)


def of_pixels(change, names=None):
    """change(pixels, variances) -> both, of every photograph or of those named."""
    def apply(capture):
        for shot in json.loads((capture / "capture.json").read_text())["photographs"]:
            if names and shot["name"] not in names:
                continue
            files = [capture / shot[key] for key in ("file", "variance")]
            images = [OpenImageIO.ImageBuf(str(file)) for file in files]
            for file, image, pixels in zip(files, images, change(*(image.get_pixels(OpenImageIO.FLOAT) for image in images))):
                spec = OpenImageIO.ImageSpec(image.spec().width, image.spec().height, image.nchannels, OpenImageIO.FLOAT)
                out = OpenImageIO.ImageBuf(spec)
                out.set_pixels(image.roi_full, numpy.ascontiguousarray(pixels, dtype=numpy.float32))
                assert out.write(str(file)), out.geterror()
    return apply


def of_mesh(factors):
    """The object itself stays; its scan says it is larger, and a tile behind it lies as far behind."""
    def apply(capture):
        file = capture / json.loads((capture / "capture.json").read_text())["object"]["layers"][0]["surface"]
        head, body = file.read_bytes().split(b"end_header\n", 1)
        count = int(head.split(b"element vertex ")[1].split()[0])
        vertices = numpy.frombuffer(body[:12 * count], "<f4").reshape(-1, 3) * numpy.array(factors, "<f4")
        file.write_bytes(head + b"end_header\n" + vertices.astype("<f4").tobytes() + body[12 * count:])
        edit(capture / "capture.json", lambda node: [tile["point_mm"].__setitem__(2, factors[2] * tile["point_mm"][2]) for tile in node["object"]["backings"].values()])
    return apply


def darker(share, channels=(1, 1, 1)):
    scale = numpy.where(numpy.array(channels) > 0, 1 - share, 1)
    return lambda p, v: (p * scale, v * scale * scale)


def encoded(p, v):
    p = numpy.maximum(p, 1e-6)
    return p ** (1 / 2.2), v * (p ** (1 / 2.2 - 1) / 2.2) ** 2


def shot(node, name):
    return next(s for s in node["photographs"] if s["name"] == name)


def parameter(node, where, value):
    for layer in node["object"]["layers"][:1]:
        if where in layer:
            layer[where]["fixed"] = value


def turned(node, name, degrees):
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    rows = shot(node, name)["camera_from_object"]["rotation"]
    shot(node, name)["camera_from_object"]["rotation"] = [[a * c - b * s, a * s + b * c, z] for a, b, z in rows]


def swapped(node):
    a, b = shot(node, "front_black"), shot(node, "front_white")
    for key in ("file", "variance"):
        a[key], b[key] = b[key], a[key]


def moved_lamp(node):
    next(light for light in node["lights"] if light["name"] == "left")["centre_mm"][0] += 25


def longer_focus(capture):
    def change(camera):
        camera["fx"], camera["fy"] = 1.03 * camera["fx"], 1.03 * camera["fy"]
    edit(capture / "calib/camera.json", change)


MISTAKES = {
    "nothing": lambda capture: None,
    "one exposure 10 %": of_pixels(darker(0.1), ["front_black"]),
    "all exposures 10 %": of_pixels(darker(0.1)),
    "blue of all lamps 10 %": of_pixels(darker(0.1, (0, 0, 1))),
    "gamma of 2.2 taken as linear": of_pixels(encoded),
    "a veil of 3 % of the brightest": of_pixels(lambda p, v: (p + 0.03 * p.max(), v)),
    "noise five times smaller": of_pixels(lambda p, v: (p, v / 25)),
    "noise five times larger": of_pixels(lambda p, v: (p, v * 25)),
    "one lamp 25 mm off": of_rig(moved_lamp),
    "no dome": of_capture(lambda node: [s["lights"].remove("dome") for s in node["photographs"] if "dome" in s["lights"]]),
    "no blade": of_capture(lambda node: [s.update(scenery=[]) for s in node["photographs"]]),
    "tile 0.8 for 0.9": of_capture(lambda node: node["object"]["backings"]["white"].update(reflectance_rgb=[0.8] * 3)),
    "no tile": of_capture(lambda node: shot(node, "front_white").update(backing="none")),
    "no polariser for crossed ones": of_capture(lambda node: shot(node, "front_black").update(polarisation="none")),
    "two photographs swapped": of_capture(swapped),
    "one photograph mirrored": of_pixels(lambda p, v: (p[:, ::-1], v[:, ::-1]), ["edge"]),
    "one pose 1.5 degrees": of_capture(lambda node: turned(node, "edge", 1.5)),
    "focal length 3 %": longer_focus,
    "thickness 20 %": of_mesh((1, 1, 1.2)),
    "scan 5 % too large": of_mesh((1.05, 1.05, 1.05)),
    "index 0.1 too high": of_capture(lambda node: parameter(node, "ior", 0.1 + node["object"]["layers"][0]["ior"]["fixed"])),
    "g 0.1 too high": of_capture(lambda node: parameter(node, "g", min(0.99, 0.1 + node["object"]["layers"][0]["g"]["fixed"]))),
    "roughness 0.3 for 0.15": of_capture(lambda node: node["object"]["surface"].update(roughness={"fixed": 0.3})),
}


def unpolarised(recipe):
    """The photograph of the front on black, once more without polarisers."""
    more = json.loads(json.dumps(shot(recipe, "front_black")))
    more.update(name="front", file="photos/front.exr", polarisation="none")
    recipe["photographs"].insert(1, more)


def row(result, capture):
    material = json.loads((result / "material.json").read_text())
    largest, furthest = {}, 0.0
    for name, _, true, fitted, pull, _, status in values_of(result, capture):
        if status == "fitted":
            largest[name] = max(largest.get(name, 0.0), abs(fitted / true - 1))
            furthest = max(furthest, abs(pull))
    said = material["reasons"] if material["status"] != "usable" else material["caveats"]
    known = material["identifiability"]
    silent = material["status"] == "usable" and furthest > OBVIOUS and not material["caveats"]
    errors = ", ".join(f"{name} {100 * off:.0f} %" for name, off in largest.items()) or "nothing fitted"
    return (f"`{material['status']}`{' SILENT' if silent else ''}", errors, f"{furthest:.1f}",
            f"{known.get('block_chi2', math.nan):.2f}, {known.get('region_chi2', math.nan):.2f}", " / ".join(said) or "nothing")


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("crownfit")
    p.add_argument("reference", type=Path)
    p.add_argument("work", type=Path)
    p.add_argument("name", nargs="?", default="disc00")
    p.add_argument("--seed", type=int, default=4711)
    p.add_argument("--pixels", default="64")
    p.add_argument("--only", nargs="*", choices=MISTAKES, metavar="WRONG", help=f"of: {', '.join(MISTAKES)}")
    own, fit_options = sys.argv[1:], []
    if "--" in own:
        own, fit_options = own[:own.index("--")], own[own.index("--") + 1:]
    o = p.parse_args(own)
    work = o.work / f"seed{o.seed}_{o.name}"
    many = str(int(o.name[-2:]) + 1)
    subprocess.run([sys.executable, o.reference / "acceptance/make_recipes.py", work / "recipes", "--seed", str(o.seed), "--discs", many, "--crowns", many,
                    "--pixels", o.pixels, "--calibration-error"], check=True, stdout=subprocess.DEVNULL)
    right = work / "capture"
    if not (right / "truth.json").exists():
        edit(work / "recipes" / o.name / "recipe.json", unpolarised)
        subprocess.run([o.crownfit, "synthesize", work / "recipes" / o.name / "recipe.json", "-o", right, "--progress", "none"], check=True, stdout=subprocess.DEVNULL)
    rows = []
    for wrong in o.only or MISTAKES:
        capture, result = (work / f"{wrong.replace(' ', '_').replace('%', 'percent')}{end}" for end in ("", "_result"))
        if not (result / "material.json").exists():
            shutil.rmtree(capture, ignore_errors=True)
            shutil.copytree(right, capture)
            MISTAKES[wrong](capture)
            begin = time.time()
            fit = subprocess.run([o.crownfit, "fit", capture, "-o", result, "--progress", "none", *fit_options], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
            if not (result / "material.json").exists():
                print(f"{wrong}: refused: {fit.stderr.strip()}", flush=True)
                rows.append([wrong, "refused", "-", "-", "-", " ".join(fit.stderr.split())])
                continue
            (result / "seconds.txt").write_text(f"{time.time() - begin:.0f}\n")
        rows.append([wrong, *row(result, right)])
        print("{} ({} s): {}; {}; furthest {}; patches and image regions {}; {}".format(wrong, (result / "seconds.txt").read_text().strip(), *rows[-1][1:]), flush=True)
    if not o.only:
        tables.write(
            "wrong", title="Wrong statements", command=" ".join(["./dev bench wrong", o.name, *(["--", *fit_options] if fit_options else [])]),
            shows="What a fit reports when the capture states one thing wrongly, against the true material of a path-traced capture.",
            columns=["stated wrongly", "status", "largest errors of fitted values", "furthest, nominal deviations", "chi-squared of patches, image regions", "what the fit says"],
            rows=rows, notes=["Photographs have 64 x 64 pixels, and the calibration is wrong by its stated errors in every row.",
                              "What is stated as exact and leaves no trace in the photographs is not noticed."])


if __name__ == "__main__":
    main()
