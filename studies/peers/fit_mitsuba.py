#!/usr/bin/env python3
"""fit_mitsuba.py CROWNFIT: two crowns photographed by Mitsuba 3 and fitted by `crownfit fit`, which knows nothing of Mitsuba.

Each crown has two smooth layers with known surfaces, and four photographs (softbox from the front, the same over a white
tile, from the side, from behind) beside one that is held out (from above). Mitsuba renders every channel as a grey scene
of its own; the variance of its pixels comes from 16 seeds, as the mean over a pixel's neighbours but not the pixel itself,
which would make dark pixels look sure. 1 % of noise is added, and the fit starts off by a factor 2. A crown meets the
limits when its medians over channels do, no value misses by more than 1.5 times as much, and its fit is usable.
Run by run_peers.py. Two cores, about 25 minutes.
"""
import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median

import mitsuba as mi
import mitsuba_scene
import numpy as np
from make_peer_captures import FACING, crown, dome, layer, photograph, softbox, turn, write_capture
from table import row

LIMITS = {"enamel.reduced_scattering_per_mm": 5, "enamel.absorption_per_mm": 20, "dentine.reduced_scattering_per_mm": 4, "dentine.absorption_per_mm": 6}  # %
NOISE, FLOOR = 0.01, 0.0005
SEEDS = 16
START = 2.0  # factor
CROWNS = {
    "clear": {"inset": 0.8, "enamel": (1.63, 0.9, [0.25, 0.27, 0.32], [0.012, 0.025, 0.06]), "dentine": (1.54, 0.8, [1.8, 1.9, 2.1], [0.03, 0.07, 0.24])},
    "milky": {"inset": 0.5, "enamel": (1.63, 0.68, [1.4, 1.8, 2.6], [0.01, 0.02, 0.05]), "dentine": (1.54, 0.8, [1.4, 1.45, 1.5], [0.05, 0.09, 0.3])},
}


def write_crown(folder, c):
    front, turned = FACING, FACING @ turn(20, 1)
    tile = {"point_mm": [0, 0, -6], "normal": [0, 0, 1], "size_mm": 30, "reflectance_rgb": [0.8] * 3}
    photographs = [photograph("front", ["left", "dome"], turned), photograph("white", ["left", "dome"], front, backing="white"),
                   photograph("side", ["side", "dome"], front), photograph("behind", ["behind"], front), photograph("above", ["above", "dome"], front)]
    photographs[-1]["use"] = "holdout"
    for p in photographs:
        p["variance"] = f"photos/{p['name']}_variance.exr"
    write_capture(folder, [layer("enamel", *c["enamel"]), layer("dentine", *c["dentine"])], {"enamel": crown(0), "dentine": crown(c["inset"])},
                  [dome(0.2 / np.pi), softbox("left", [-90, 30, 90], 80, 1.0), softbox("side", [120, 10, 20], 80, 1.0), softbox("behind", [10, 0, -110], 80, 1.0),
                   softbox("above", [0, 110, 60], 80, 1.0)], photographs, backings={"white": tile}, pixels=64)
    capture = json.loads((folder / "capture.json").read_text())
    for stated in capture["object"]["layers"]:
        for key, off in (("reduced_scattering_per_mm", START), ("absorption_per_mm", 1 / START)):
            stated[key] = {"initial": [off * v for v in stated[key]["fixed"]]}
    capture["object"]["surface"]["roughness"] = {"fixed": 0.01}  # the least that `shader` takes; Mitsuba's is a mirror
    (folder / "capture.json").write_text(json.dumps(capture, indent=1) + "\n")
    return [p["name"] for p in photographs]


def grey_truth(truth, channel):
    grey = json.loads(json.dumps(truth))
    for stated in grey["layers"]:
        for key in ("reduced_scattering_per_mm", "absorption_per_mm"):
            stated[key] = [stated[key][channel]] * 3
    return grey


def of_neighbours(values):
    """Means over the 5 x 5 pixels around each, itself left out."""
    padded = np.pad(values, ((2, 2), (2, 2), (0, 0)), mode="edge")
    h, w = values.shape[:2]
    return (sum(padded[y:y + h, x:x + w] for y in range(5) for x in range(5)) - values) / 24


def photograph_by_mitsuba(options, folder, names):
    truth_file = folder / "truth.json"
    truth = json.loads(truth_file.read_text())
    pictures = {name: [] for name in names}
    for channel in range(3):
        truth_file.write_text(json.dumps(grey_truth(truth, channel)))
        exported = folder.parent / f"{folder.name}_mitsuba_{channel}"
        mitsuba_scene.export(options.crownfit, folder, exported)
        for name in names:
            seeds = range(1 + 100 * channel, 1 + 100 * channel + SEEDS)
            pictures[name].append(mitsuba_scene.render(exported, name, options.paths // SEEDS, seeds, "volpath")[..., 1])
    truth_file.write_text(json.dumps(truth, indent=1) + "\n")
    generator = np.random.default_rng(11)
    for name, channels in pictures.items():
        seeds = np.stack(channels, axis=-1)
        mean, relative = seeds.mean(0), of_neighbours(seeds.var(0, ddof=1)) / np.maximum(of_neighbours(seeds.mean(0)), 1e-6) ** 2
        variance = relative / SEEDS * of_neighbours(mean) ** 2 + (NOISE * of_neighbours(mean)) ** 2 + FLOOR**2
        picture = mean * (1 + NOISE * generator.standard_normal(mean.shape)) + FLOOR * generator.standard_normal(mean.shape)
        for file, values in ((f"{name}.exr", picture), (f"{name}_variance.exr", variance)):
            (folder / "photos").mkdir(exist_ok=True)
            mi.Bitmap(values.astype(np.float32)).write(str(folder / "photos" / file))


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("crownfit", help="the executable")
    p.add_argument("--work", type=Path, help="folder for captures and results (default: a temporary one)")
    p.add_argument("--paths", type=int, default=512, help="paths per pixel and channel of Mitsuba's photographs (default 512)")
    p.add_argument("--only", choices=CROWNS, help="only this crown")
    options = p.parse_args()
    work = options.work or Path(tempfile.mkdtemp(prefix="crownfit_peers_"))
    for name, c in CROWNS.items():
        if options.only not in (None, name):
            continue
        folder, result = work / name, work / f"{name}_result"
        photographs = write_crown(folder, c)
        photograph_by_mitsuba(options, folder, photographs)
        done = subprocess.run([options.crownfit, "fit", str(folder), "-o", str(result), "--progress", "none"], capture_output=True, text=True)
        if done.returncode > 1:
            sys.exit(done.stderr)
        material, truth = (json.loads((f / n).read_text()) for f, n in ((result, "material.json"), (folder, "truth.json")))
        inside = 0
        for of_layer, true in zip(material["layers"], truth["layers"]):
            for key in ("reduced_scattering_per_mm", "absorption_per_mm"):
                found, full = of_layer[key], f"{of_layer['name']}.{key}"
                errors = [100 * abs(f / t - 1) for f, t in zip(found["value"], true[key])]
                inside += sum(low <= t <= high for (low, high), t in zip(found["interval95"], true[key]))
                limit = LIMITS[full]
                row("Mitsuba 3", f"crown '{name}' photographed by it: {full}", "its truth", f"errors {', '.join(f'{e:.1f}' for e in errors)} %, {found['status']}",
                    found["status"] == "fitted" and median(errors) <= limit and max(errors) <= 1.5 * limit, f"median {limit} %, each {1.5 * limit:g} %")
        held_out = material["image_error"]["holdout"]
        row("Mitsuba 3", f"crown '{name}': fit", "", f"{material['status']}, model {material['model']}, {inside} of 12 intervals hold the truth, chi2 of patches "
            f"{material['identifiability']['block_chi2']:.2f}; held out CIEDE2000 {held_out['de00_median']:.2f} / {held_out['de00_p95']:.2f}", material["status"] == "usable" and inside >= 10, "usable, 10 of 12")


if __name__ == "__main__":
    main()
