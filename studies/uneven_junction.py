#!/usr/bin/env python3
"""uneven_junction.py CROWNFIT REFERENCE FOLDER: what a constant enamel thickness gets wrong on a real tooth.

Photographs of the micro-CT incisor are rendered by model `shader` with its measured junction, and fitted twice: with the
measured dentine, and with dentine as an inward offset of constant, fitted thickness. Model and noise are the same in both, so what
differs comes from the junction. Exit code 77: no reference data.
"""
import json
import subprocess
import sys
from pathlib import Path

import tables

program, reference, folder = sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3])
if not (reference / "data/real/tooth-human-incisor-enamel-dentine-pulp").is_dir():
    print("NOT RUN: no micro-CT incisor in $CROWNFIT_REFERENCE")
    sys.exit(77)
TRUTH = {"enamel": {"reduced_scattering_per_mm": [0.3] * 3, "absorption_per_mm": [0.01, 0.02, 0.05]},
         "dentine": {"reduced_scattering_per_mm": [2.0] * 3, "absorption_per_mm": [0.03, 0.07, 0.2]}}


def run(*arguments, expect=(0,)):
    done = subprocess.run([program, *map(str, arguments), "--progress", "none"], capture_output=True, text=True)
    if done.returncode not in expect:
        sys.exit(f"crownfit {arguments[0]}: exit {done.returncode}: {done.stderr}")


recipe_maker = Path(__file__).resolve().parent.parent / "tests/real/make_incisor_recipe.py"
subprocess.run([sys.executable, recipe_maker, reference, folder, "--size", "64"], check=True)
capture = json.loads((folder / "recipe.json").read_text())
del capture["synthesis"]
capture["format"] = "crownfit-capture/1"
layers = capture["object"]["layers"][:2]  # the shader does not see the pulp
capture["object"]["layers"] = layers
for layer in layers:
    for key, value in TRUTH[layer["name"]].items():
        layer[key] = {"fixed": value}
(folder / "capture.json").write_text(json.dumps(capture))
run("render", folder, "-o", folder / "photos", "--noise", 0.01, "--seed", 5)

for layer in layers:
    for key, value in TRUTH[layer["name"]].items():
        layer[key] = {"initial": value[0] * 1.5 if key.startswith("reduced") else [x * 1.5 for x in value]}
fits = {}
for name in ("measured", "constant"):
    if name == "constant":
        del layers[1]["surface"]
        layers[0]["thickness_mm"] = {"initial": 0.9}
    (folder / f"{name}.json").write_text(json.dumps(capture))
    run("fit", folder / f"{name}.json", "-o", folder / name, "--model", "shader", expect=(0, 1))
    fits[name] = json.loads((folder / name / "material.json").read_text())

print(f"{'':38}{'truth':>8}{'measured junction':>20}{'constant thickness':>21}")
off, rows = {"measured": [], "constant": []}, []
for i, (owner, values) in enumerate(TRUTH.items()):
    for key, goals in values.items():
        for c, goal in enumerate(goals if key.startswith("absorption") else goals[:1]):
            line = f"{owner}.{key} {'RGB'[c]}"
            text = f"{line:38}{goal:8.3g}"
            rows.append([line, f"{goal:.3g}"])
            for name, fit in fits.items():
                value = fit["layers"][i][key]["value"]
                value = value[c] if isinstance(value, list) else value
                off[name].append(abs(value / goal - 1) if owner == "dentine" else 0.0)
                text += f"{value:12.3g} {100 * (value / goal - 1):+6.0f} %"
                rows[-1].append(f"{100 * (value / goal - 1):+.0f} %")
            print(text)
for name, fit in fits.items():
    e = fit["image_error"]
    print(f"{name}: {fit['status']}, enamel {fit['layers'][0]['thickness_mm']['value']:.2f} mm, CIEDE2000 fitted {e['fit']['de00_median']:.2f} / {e['fit']['de00_p95']:.1f}, "
          f"held out {e['holdout']['de00_median']:.2f} / {e['holdout']['de00_p95']:.1f}, chi2 {e['fit']['reduced_chi2']:.1f}")
errors = [fit["image_error"] for fit in fits.values()]
rows.append(["CIEDE2000 held out, median / 95 %", "-", *(f"{e['holdout']['de00_median']:.2f} / {e['holdout']['de00_p95']:.1f}" for e in errors)])
rows.append(["status", "-", *(f"`{fit['status']}`, chi-squared {e['fit']['reduced_chi2']:.1f}" for fit, e in zip(fits.values(), errors))])
tables.write(
    "junction", title="A real junction", command="./dev bench junction",
    shows="What a constant enamel thickness gets wrong on a micro-CT incisor, against a fit with its measured enamel-dentine junction.",
    columns=["quantity", "truth", "measured junction", "constant thickness"], rows=rows,
    notes=["Photographs are rendered by `shader` with the measured junction and root, and 1 % noise.",
           "The constant thickness is wrong where enamel runs out at the neck and where dentine ends below the incisal edge."])
measured, constant = fits["measured"]["image_error"], fits["constant"]["image_error"]
faults = []
if fits["measured"]["status"] != "usable" or measured["holdout"]["de00_median"] > 0.5:
    faults.append("the measured junction is not recovered")
if max(off["measured"]) > 0.05:
    faults.append("dentine is off by more than 5 % with the measured junction")
if constant["holdout"]["de00_median"] < 2 * measured["holdout"]["de00_median"]:
    faults.append("the constant thickness does as well as the measured one: this test shows nothing")
print(*faults, sep="\n")
sys.exit(1 if faults else 0)
