#!/usr/bin/env python3
"""recovery_study.py CROWNFIT REFERENCE WORK [--seed N] [--discs N] [--crowns N] [--calibration-error] [-- options of fit]:
captures drawn by REFERENCE/acceptance/make_recipes.py, synthesized, fitted from values off by a factor 2, and held against
their truth: every value's error, whether its interval holds the truth, and its pull (ln fitted - ln truth in standard
deviations; of a fit whose intervals are right pulls have a root mean square of 1). One direction that is off shows in many
values at once: chi2 of all entries with their correlations tells whether it is more than chance. What a run was stopped at is gone on with;
results in WORK stay valid for one program. A disc takes 4 minutes on two cores, a crown 6 to 15, its synthesis half of that.
"""
import argparse
import json
import math
import subprocess
import sys
import time
from pathlib import Path
from statistics import median

import tables


def as_list(v):
    return v if isinstance(v, list) else [v]


def parameters(material):
    for layer in material["layers"]:
        for key in ("reduced_scattering_per_mm", "absorption_per_mm", "thickness_mm"):
            if key in layer:
                yield f"{layer['name']}.{key}", layer[key]


def values_of(result, capture):
    """(name, channel, truth, fitted, pull, is inside, status) of all that was free."""
    fitted = json.loads((result / "material.json").read_text())
    truth = dict(parameters(json.loads((capture / "truth.json").read_text())))
    for name, node in parameters(fitted):
        if not isinstance(node, dict) or node["status"] == "fixed":
            continue
        found, stddev, bounds = as_list(node["value"]), as_list(node["stddev"]), node["interval95"]
        true = as_list(truth[name]["value"] if isinstance(truth[name], dict) else truth[name])
        true = true if len(true) == len(found) else true * len(found)
        bounds = bounds if isinstance(bounds[0], list) else [bounds]
        for c, (t, f, s, (low, high)) in enumerate(zip(true, found, stddev, bounds)):
            yield name, c, t, f, math.log(f / t) * f / s, low <= t <= high, node["status"]


def chi2_of(result, capture):
    """Of ln fitted / true, with the stated covariance, and its freedom; what others determine (a power law's third) is left out."""
    nothing_new = 1e-3
    joint = json.loads((result / "material.json").read_text())["joint"]
    off = {f"{name}[{'RGB'[c]}]": pull for name, c, _, _, pull, _, _ in values_of(result, capture)}
    which = [i for i, name in enumerate(joint["names"]) if name in off or f"{name}[R]" in off]
    root, z = [], []  # Cholesky's factor of the correlation, whitened pulls
    for i in which:
        row = []
        for k, other in enumerate(root):
            row.append((joint["correlation"][i][which[k]] - sum(a * b for a, b in zip(row, other))) / other[-1] if other[-1] else 0.0)
        left = 1 - sum(a * a for a in row)
        name = joint["names"][i]
        pull = off[name] if name in off else off[f"{name}[R]"]
        row.append(math.sqrt(left) if left > nothing_new else 0.0)
        z.append((pull - sum(a * b for a, b in zip(row, z))) / row[-1] if row[-1] else 0.0)
        root.append(row)
    return sum(q * q for q in z), sum(row[-1] > 0 for row in root)


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("crownfit")
    p.add_argument("reference", type=Path)
    p.add_argument("work", type=Path)
    p.add_argument("--seed", type=int, default=1)
    p.add_argument("--discs", type=int, default=2)
    p.add_argument("--crowns", type=int, default=3)
    p.add_argument("--only", nargs="*", help="names of captures, such as crown02")
    p.add_argument("--calibration-error", action="store_true")
    own, fit_options = sys.argv[1:], []
    if "--" in own:
        own, fit_options = own[:own.index("--")], own[own.index("--") + 1:]
    o = p.parse_args(own)
    work = o.work / f"seed{o.seed}{'_calibration' if o.calibration_error else ''}"
    subprocess.run([sys.executable, o.reference / "acceptance/make_recipes.py", work / "recipes", "--seed", str(o.seed), "--discs", str(o.discs), "--crowns", str(o.crowns)]
                   + ["--calibration-error"] * o.calibration_error, check=True, stdout=subprocess.DEVNULL)
    errors, pulls, inside, fits, chi2, freedom = {}, [], 0, [], 0, 0
    held, names = [], []
    for recipe in sorted((work / "recipes").iterdir(), key=lambda r: (not r.name.startswith("disc"), r.name)):
        if o.only and recipe.name not in o.only:
            continue
        capture, result = work / recipe.name, work / f"{recipe.name}_result"
        if not (capture / "truth.json").exists():
            subprocess.run([o.crownfit, "synthesize", recipe / "recipe.json", "-o", capture, "--progress", "none"], check=True, stdout=subprocess.DEVNULL)
        if not (result / "material.json").exists():
            begin = time.time()
            subprocess.run([o.crownfit, "fit", capture, "-o", result, "--progress", "none", *fit_options], stdout=subprocess.DEVNULL)
            (result / "seconds.txt").write_text(f"{time.time() - begin:.0f}\n")
        material = json.loads((result / "material.json").read_text())
        held_out = (material["image_error"]["holdout"] or {}).get("de00_median", math.nan)
        seconds = (result / "seconds.txt").read_text().strip()
        print(f"{recipe.name}: {material['status']}, {seconds} s, held out CIEDE2000 {held_out:.2f}; {'; '.join(material['reasons'])}", flush=True)
        fits.append(material["status"])
        names.append(recipe.name)
        for name, c, t, f, pull, is_inside, status in values_of(result, capture):
            print(f"  {name}[{c}]: truth {t:.4g}, fitted {f:.4g}, {100 * (f / t - 1):+.1f} %, pull {pull:+.2f}{'' if is_inside else ' OUT'}{'' if status == 'fitted' else ' ' + status}", flush=True)
            held.append(is_inside)
            if status == "fitted":
                errors.setdefault(name, []).append(100 * abs(f / t - 1))
                pulls.append(pull)
                inside += is_inside
        of_fit, free = chi2_of(result, capture)
        print(f"  all with their correlations: chi2 {of_fit:.1f} of {free} entries")
        chi2, freedom = chi2 + of_fit, freedom + free
    for name, of_name in sorted(errors.items()):
        print(f"{name}: median error {median(of_name):.1f} %, worst {max(of_name):.1f} %, of {len(of_name)}")
    if pulls:
        print(f"{fits.count('usable')} of {len(fits)} fits usable; intervals hold {inside} of {len(pulls)}; pulls: rms {math.sqrt(sum(q * q for q in pulls) / len(pulls)):.2f}, worst {max(pulls, key=abs):+.2f}")
        print(f"chi2 of all fits {chi2:.0f}, expected {freedom} +- {math.sqrt(2 * freedom):.0f}")
    if names and not o.only:
        kinds = ", ".join(f"{count} {kind}{'s' if count > 1 else ''}" for kind in ("disc", "crown") if (count := sum(name.startswith(kind) for name in names)))
        pixels = json.loads((work / names[0] / "calib/camera.json").read_text())["width"]
        tables.write(
            "recovery", title="Captures drawn at random", command="./dev bench recovery --seed N --calibration-error", keyed_by=2,
            shows="Whether 95 % intervals hold the true material of path-traced captures, which were drawn by seeds after the program was frozen.",
            columns=["seed", "calibration", "date", "captures", "pixels", "intervals that hold the truth", "of those reported as fitted", "chi-squared of all values"],
            rows=[[o.seed, "stated errors" if o.calibration_error else "true", tables.today(), kinds, f"{pixels} x {pixels}", f"{sum(held)} of {len(held)}",
                   f"{inside} of {len(pulls)}", f"{chi2:.0f} of {freedom}"]],
            notes=["Fits start off by a factor 2.",
                   "Stated errors of the calibration are 0.1 degrees and 0.1 mm of a pose, 1 mm of a lamp and 1 % of an exposure.",
                   "Chi-squared compares ln(fitted / true) of all values with their nominal covariance, so it shows an error that many values share."])


if __name__ == "__main__":
    main()
