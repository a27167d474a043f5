#!/usr/bin/env python3
"""requirements_study.py CROWNFIT REFERENCE WORK [--seed N] [--discs N] [--crowns N] [--paths N]:
whether `check` foretells what leaving a part of a scene out does. Captures that REFERENCE/acceptance/make_recipes.py draws,
64 x 64 pixels, are given lamps that are dimmed by up to a thousand and tiles that lie up to 30 mm further away, so that some
parts matter and some do not. Of every part that `check` lists the picture that it names is path-traced with the true
material, with the part and without it, by the same paths: CIEDE2000 found over foretold at the true values and at start values
off by a factor 2, where found or foretold is above 0.1. Then each capture is fitted by model shader (which has no noise of its
own) as it is and with --leave-out unneeded: values' differences in standard deviations (aim: a quarter), seconds.
What a run was stopped at is gone on with; a crown takes 5 minutes on two cores.
"""
import argparse
import json
import math
import random
import shutil
import subprocess
import sys
from pathlib import Path
from statistics import median

import numpy as np
import OpenImageIO as oiio

import tables
from recovery_study import as_list, parameters


def read(file):
    return oiio.ImageBuf(str(file)).get_pixels(oiio.FLOAT)[:, :, :3]


def write(file, pixels):
    image = oiio.ImageBuf(oiio.ImageSpec(pixels.shape[1], pixels.shape[0], 3, oiio.FLOAT))
    image.set_pixels(oiio.ROI(), pixels.astype(np.float32))
    image.write(str(file))


def vary(folder, rng):
    """Lamps dimmer, tiles further away."""
    file = folder / "calib/light_rig.json"
    rig = json.loads(file.read_text())
    for light in rig["lights"]:
        if light["name"] in ("left", "dome"):
            light["radiance_rgb"] = [v * 10 ** -rng.uniform(0, 3) for v in light["radiance_rgb"]]
    file.write_text(json.dumps(rig))
    file = folder / "recipe.json"
    recipe = json.loads(file.read_text())
    for tile in recipe["object"]["backings"].values():
        if not tile["contact"]:
            tile["point_mm"][2] -= rng.uniform(0, 30)
    file.write_text(json.dumps(recipe))


def leave_out(photograph, what):
    """What `check` names, from one photograph of capture.json; the light alone for a light, whose pictures add up."""
    kind, _, name = what.partition(" ")
    name = name.strip("'")
    if kind == "light":
        photograph["lights"] = [light for light in photograph["lights"] if light != name]
    elif kind == "tile":
        photograph["backing"] = "none" if photograph["backing"] == name else photograph["backing"]
    elif kind == "scenery":
        photograph["scenery"] = [s for s in photograph["scenery"] if s != name]
    elif what == "the surface's reflection":
        photograph["polarisation"] = "cross"
    else:
        sys.exit(f"{what}: this study does not know how to leave it out")


class Capture:
    def __init__(self, program, folder, work, paths):
        self.program, self.folder, self.work, self.paths = program, folder, work, paths
        self.json = json.loads((folder / "capture.json").read_text())

    def edited(self, name, edit):
        """A copy of the capture in which every photograph is edited."""
        copy = self.work / name
        shutil.copytree(self.folder, copy, dirs_exist_ok=True)
        there = json.loads(json.dumps(self.json))
        for photograph in there["photographs"]:
            edit(photograph)
        (copy / "capture.json").write_text(json.dumps(there))
        return copy

    def picture(self, name, photograph, edit):
        out = self.work / f"{name}_{photograph}_{self.paths}"
        if not (out / f"{photograph}.exr").exists():
            capture = self.edited(name, edit)
            subprocess.run([self.program, "render", capture, "--material", self.folder / "truth.json", "--photograph", photograph, "--model", "path",
                            "--paths", str(self.paths), "-o", out, "--progress", "none"], check=True, stdout=subprocess.DEVNULL)
            shutil.rmtree(capture)
        return read(out / f"{photograph}.exr")

    def found(self, what, photograph):
        """CIEDE2000 of leaving it out, over the pixels that see the object with it and without it."""
        name = "".join(c if c.isalnum() else "_" for c in what)
        with_it = self.picture("all", photograph, lambda p: None)
        without = self.picture(name, photograph, lambda p: leave_out(p, what))
        if what.startswith("light"):
            only = what.partition(" ")[2].strip("'")
            with_it = without + self.picture(name + "_alone", photograph, lambda p: p.update(lights=[only]))
        lit = self.picture("bare", photograph, lambda p: p.update(backing="none", scenery=[], polarisation="cross")).min(axis=2) > 0
        seen = lit & (with_it.min(axis=2) > 0) & (without.min(axis=2) > 0)
        whole = np.logical_and.reduce([np.roll(seen, (dy, dx), (0, 1)) for dy in (-1, 0, 1) for dx in (-1, 0, 1)])
        files = [self.work / f"{n}.exr" for n in ("with", "without", "mask")]
        for file, pixels in zip(files, (with_it, without, np.repeat(whole[:, :, None], 3, 2))):
            write(file, pixels)
        said = subprocess.run([self.program, "compare", files[0], files[1], "--mask", files[2], "--json"], check=True, capture_output=True, text=True).stdout
        return json.loads(said)["de00_mean"]

    def check(self, at_truth):
        folder = self.folder
        if at_truth:
            folder = self.edited("at_truth", lambda p: None)
            there = json.loads((folder / "capture.json").read_text())
            truth = dict(parameters(json.loads((folder / "truth.json").read_text())))
            for name, node in parameters(there["object"]):
                if isinstance(node, dict) and "initial" in node:
                    node["initial"] = truth[name]["value"] if isinstance(truth[name], dict) else truth[name]
            (folder / "capture.json").write_text(json.dumps(there))
        said = subprocess.run([self.program, "check", folder, "--json", "--progress", "none"], check=True, capture_output=True, text=True).stdout
        return json.loads(said)["requirements"]

    def fit(self, name, *options):
        result = self.work / f"{name}_result"
        if not (result / "material.json").exists():
            subprocess.run([self.program, "fit", self.folder, "-o", result, "--model", "shader", "--profiles", "0", "--progress", "none", *options], stdout=subprocess.DEVNULL)
        values = {}
        for entry, node in parameters(json.loads((result / "material.json").read_text())):
            if isinstance(node, dict) and node["status"] != "fixed":
                for c, (v, s) in enumerate(zip(as_list(node["value"]), as_list(node["stddev"]))):
                    values[f"{entry}[{c}]"] = (math.log(v), s / v)
        return values, json.loads((result / "run.json").read_text())["wall_s"]


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("crownfit")
    p.add_argument("reference", type=Path)
    p.add_argument("work", type=Path)
    p.add_argument("--seed", type=int, default=1)
    p.add_argument("--discs", type=int, default=2)
    p.add_argument("--crowns", type=int, default=4)
    p.add_argument("--paths", type=int, default=128)
    o = p.parse_args()
    work = o.work / f"seed{o.seed}"
    subprocess.run([sys.executable, o.reference / "acceptance/make_recipes.py", work / "recipes", "--seed", str(o.seed), "--discs", str(o.discs),
                    "--crowns", str(o.crowns), "--pixels", "64", "--paths", "128"], check=True, stdout=subprocess.DEVNULL)
    rng = random.Random(o.seed)
    ratios, shifts, saved = {"true": [], "start": []}, [], []
    beyond, fits = {"true": [], "start": []}, []
    for name in sorted(f.name for f in (work / "recipes").iterdir()):
        vary(work / "recipes" / name, rng)
        folder = work / name / "capture"
        if not (folder / "truth.json").exists():
            subprocess.run([o.crownfit, "synthesize", work / "recipes" / name / "recipe.json", "-o", folder, "--progress", "none"], check=True, stdout=subprocess.DEVNULL)
        capture = Capture(o.crownfit, folder, work / name, o.paths)
        at_truth = {r["without"]: r for r in capture.check(at_truth=True)}
        required_parts = capture.check(at_truth=False)
        for r in required_parts:
            if r["without"].startswith("the step"):
                continue  # what one layer of both is made of, nobody knows
            found = capture.found(r["without"], r["photograph"])
            for where, foretold in (("true", at_truth[r["without"]]), ("start", r)):
                if foretold["photograph"] == r["photograph"] and max(found, foretold["de00"]) > 0.1:
                    ratios[where].append(found / max(foretold["de00"], 1e-9))
                    if not 0.5 <= ratios[where][-1] <= 2:
                        beyond[where].append(f"{r['without']} in `{r['photograph']}` of `{name}` ({ratios[where][-1]:.2f})")
            print(f"{name}: {r['without']} in '{r['photograph']}': CIEDE2000 {found:.3f} found, foretold {at_truth[r['without']]['de00']:.3f} at true values, "
                  f"{r['de00']:.3f} at start values{'' if r['needed'] else ': not needed'}", flush=True)
        if all(r["needed"] for r in required_parts):
            continue
        full, full_s = capture.fit("full")
        required, required_s = capture.fit("required", "--leave-out", "unneeded")
        left_out = json.loads((work / name / "required_result/material.json").read_text())["provenance"]["options"]["left_out"]
        if not left_out:
            continue
        off = [abs(required[n][0] - full[n][0]) / full[n][1] for n in full]
        shifts.append(max(off))
        saved.append(full_s - required_s)
        fits.append([f"`{name}`", ", ".join(left_out), f"{max(off):.2f}", f"{full_s:.1f}", f"{required_s:.1f}"])
        print(f"{name}: fitted without {', '.join(left_out)}: values off by {max(off):.2f} stated deviations at most; {required_s:.1f} in place of {full_s:.1f} s", flush=True)
    for where, seen in ratios.items():
        print(f"CIEDE2000 found over foretold at {where} values, {len(seen)} parts above 0.1: {min(seen):.2f} to {max(seen):.2f}, median {median(seen):.2f}, "
              f"{sum(0.5 <= q <= 2 for q in seen)} within a factor 2")
    if shifts:
        print(f"fits without unneeded parts: {sum(s <= 0.25 for s in shifts)} of {len(shifts)} within a quarter of a deviation, at most {max(shifts):.2f}; "
              f"saved {min(saved):.1f} to {max(saved):.1f} s")
    command = f"./dev bench requirements --seed {o.seed} --discs {o.discs} --crowns {o.crowns}"
    labels = {"true": "at the true values", "start": "at start values, off by a factor 2"}
    tables.write(
        "requirements", title="What the scene requires", command=command,
        shows="Change of the picture when a part of the scene is left out: predicted by `check`, against path tracing with the true material.",
        columns=["prediction", "parts above CIEDE2000 0.1", "path-traced / predicted, median", "range", "within a factor 2", "beyond a factor 2"],
        rows=[[labels[where], len(seen), f"{median(seen):.2f}", f"{min(seen):.2f} to {max(seen):.2f}", sum(0.5 <= q <= 2 for q in seen),
               "; ".join(beyond[where]) or "-"] for where, seen in ratios.items() if seen],
        notes=["Captures have 64 x 64 pixels.", "Two lamps are dimmed by up to a thousand, and tiles lie up to 30 mm further away.",
               "Changes are means of CIEDE2000 over blocks of 8 x 8 pixels."])
    if fits:
        tables.write(
            "requirements_fits", title="Fits without unneeded parts", command=command,
            shows="What `--leave-out unneeded` changes in a fit by `shader`, against the same fit with all parts.",
            columns=["capture", "left out", "furthest value, nominal deviations", "seconds with all parts", "seconds without them"], rows=fits,
            notes=["The model `shader` has no noise of its own.", "Seconds without the parts include the search for them.", "The aim is a quarter of a deviation."])


if __name__ == "__main__":
    main()
