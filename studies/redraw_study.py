#!/usr/bin/env python3
"""redraw_study.py CROWNFIT REFERENCE WORK NAME [COUNT] [--seed N] [--crowns N] [--walks N] [--calibration-error [exposure] [pose] [light]]:
whether stated standard deviations are those with which fits scatter. The capture NAME (disc00, crown00, ...) that
REFERENCE/acceptance/make_recipes.py draws for the seed is photographed COUNT (50) times, 64 x 64 pixels with noise of their
own, and fitted every time by model path with walks of its own (left to itself a fit of such noisy photographs ends with shader,
whose intervals hold its own error). With --calibration-error its calibration, or what of it is named, is off by
errors of its own every time too, of the stated size (1 %; 0.1 degrees and 0.1 mm; 1 mm). Printed per value: scatter of ln,
mean stated deviation, their ratio, mean pull. What a run was stopped at is gone on with.
"""
import argparse
import json
import math
import subprocess
import sys
from pathlib import Path
from statistics import mean, stdev

import tables
from recovery_study import values_of


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("crownfit")
    p.add_argument("reference", type=Path)
    p.add_argument("work", type=Path)
    p.add_argument("name")
    p.add_argument("count", type=int, nargs="?", default=50)
    p.add_argument("--seed", type=int, default=1)
    p.add_argument("--crowns", type=int, help="as many are drawn, and the first half's thicknesses are known; one more than its number: free")
    p.add_argument("--walks", default="100000")
    p.add_argument("--calibration-error", nargs="*", choices=["exposure", "pose", "light"])
    o = p.parse_args()
    sizes = {"exposure": 0.01, "pose_deg": 0.1, "pose_mm": 0.1, "light_mm": 1}
    wrong = {} if o.calibration_error is None else {k: v for k, v in sizes.items() if not o.calibration_error or k.split("_")[0] in o.calibration_error}
    many = str(o.crowns or int(o.name[-2:]) + 1)
    work = o.work / "_".join([f"seed{o.seed}", *([f"of{many}"] if o.crowns else []), *([f"walks{o.walks}"] if o.walks != "100000" else []), *sorted(wrong)])
    subprocess.run([sys.executable, o.reference / "acceptance/make_recipes.py", work / "recipes", "--seed", str(o.seed), "--discs", many, "--crowns", many,
                    "--pixels", "64", "--paths", "128"], check=True, stdout=subprocess.DEVNULL)
    file = work / "recipes" / o.name / "recipe.json"
    recipe = json.loads(file.read_text())
    if wrong:
        recipe["synthesis"]["calibration_error"] = wrong
    seen = {}  # name[channel]: (ln fitted / true, stated deviation of it)
    for draw in range(o.count):
        capture, result = work / f"{o.name}_{draw}", work / f"{o.name}_{draw}_result"
        recipe["synthesis"]["seed"] = 1000 * o.seed + draw
        file.write_text(json.dumps(recipe))
        if not (capture / "truth.json").exists():
            subprocess.run([o.crownfit, "synthesize", file, "-o", capture, "--progress", "none"], check=True, stdout=subprocess.DEVNULL)
        if not (result / "material.json").exists():
            subprocess.run([o.crownfit, "fit", capture, "-o", result, "--progress", "none", "--model", "path", "--walks", o.walks, "--seed", str(draw + 1)], stdout=subprocess.DEVNULL)
        for name, c, true, fitted, pull, _, status in values_of(result, capture):
            if status == "fitted":
                off = math.log(fitted / true)
                seen.setdefault(f"{name}[{'RGB'[c]}]", []).append((off, off / pull))
        print(f"{draw + 1} of {o.count}", file=sys.stderr, end="\r", flush=True)
    ratios, rows, all_pulls = [], [], []
    calibration = "true" if not wrong else "off by its stated errors" if wrong == sizes else f"off by {', '.join(sorted(wrong))}"
    capture = f"`{o.name}`{f' of {o.crowns}' if o.crowns else ''}, seed {o.seed}, calibration {calibration}"
    for name, drawn in seen.items():
        if len(drawn) < 0.8 * o.count:
            print(f"{name}: fitted in {len(drawn)} of {o.count}")
            continue
        scatter, stated = stdev(off for off, _ in drawn), mean(s for _, s in drawn)
        pulls = [off / s for off, s in drawn]
        ratios.append(scatter / stated)
        held = sum(abs(q) <= 1.96 for q in pulls)
        print(f"{name}: scatter {100 * scatter:.2f} %, stated {100 * stated:.2f} %, ratio {ratios[-1]:.2f} +- {ratios[-1] / math.sqrt(2 * len(drawn)):.2f}, "
              f"mean pull {mean(pulls):+.2f} +- {stdev(pulls) / math.sqrt(len(pulls)):.2f}, intervals hold {held} of {len(pulls)}")
        rows.append([capture, name, tables.today(), o.count, f"{ratios[-1]:.2f} +- {ratios[-1] / math.sqrt(2 * len(drawn)):.2f}",
                     f"{mean(pulls):+.2f} +- {stdev(pulls) / math.sqrt(len(pulls)):.2f}", f"{held} of {len(pulls)}"])
        all_pulls += pulls
    if ratios:
        print(f"ratio of scatter to stated deviation: {min(ratios):.2f} to {max(ratios):.2f}, rms {math.sqrt(mean(q * q for q in ratios)):.2f}")
        rows.append([capture, "all values", tables.today(), o.count, f"{min(ratios):.2f} to {max(ratios):.2f}", f"{mean(all_pulls):+.2f}",
                     f"{sum(abs(q) <= 1.96 for q in all_pulls)} of {len(all_pulls)}"])
        tables.write(
            "redraws", title="Redraws of one capture", command=f"./dev bench redraws NAME 50 --seed N --calibration-error", keyed_by=1,
            shows="Whether nominal standard deviations are those with which fits scatter, when one capture is photographed many times.",
            columns=["capture", "value", "date", "draws", "scatter / nominal deviation", "mean pull", "intervals that hold the truth"], rows=rows,
            notes=["Photographs have 64 x 64 pixels; noise and calibration errors are new in every draw.", "A pull is ln(fitted / true) in nominal deviations.",
                   "Where intervals are right, the ratio is 1 and the mean pull 0."])


if __name__ == "__main__":
    main()
