#!/usr/bin/env python3
"""fit_against_truth.py CROWNFIT CAPTURE...: fits captures whose truth is known and prints how far off it ends.

For every capture (a folder with capture.json and truth.json): the fit from the capture's own start, and the same model at the
true values, which is the model's own error. Leaves two tables for docs/validation.md. Options after -- go to `crownfit fit`.
"""
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import tables

CHANNELS = "RGB"


def fit(program, capture, folder, options):
    begin = time.time()
    done = subprocess.run([program, "fit", capture, "-o", folder, "--progress", "none", *options], capture_output=True, text=True)
    if done.returncode not in (0, 1):
        sys.exit(f"{capture}: exit {done.returncode}: {done.stderr.strip()}")
    return json.loads((Path(folder) / "material.json").read_text()), time.time() - begin


def as_list(value):
    return value if isinstance(value, list) else [value] * 3


def parameters(material, truth):
    """(name, truth, fitted, interval, status) of everything that was free."""
    for owner, mine, true in [(m["name"], m, t) for m, t in zip(material["layers"], truth["layers"])] + [("surface", material["surface"], truth["surface"])]:
        for key, p in mine.items():
            if not isinstance(p, dict) or "interval95" not in p or p.get("status") == "fixed" or key not in true:
                continue
            values, goals = as_list(p["value"]), as_list(true[key])
            intervals = p["interval95"] if isinstance(p["interval95"][0], list) else [p["interval95"]] * 3
            shared = len(set(values)) == 1 and len(set(goals)) == 1
            for c in range(1 if shared else 3):
                status = p["status"][c] if isinstance(p["status"], list) else p["status"]
                yield f"{owner}.{key}" + ("" if shared else f" {CHANNELS[c]}"), goals[c], values[c], intervals[c], status


def images(material):
    return ", ".join(f"{name} {e['de00_median']:.2f} / {e['de00_p95']:.1f}" for name, e in material["image_error"]["photographs"].items())


def main():
    arguments, options = (sys.argv[1:], []) if "--" not in sys.argv else (sys.argv[1:sys.argv.index("--")], sys.argv[sys.argv.index("--") + 1:])
    if len(arguments) < 2:
        sys.exit(__doc__)
    table, shots = [], []
    for capture in map(Path, arguments[1:]):
        truth = json.loads((capture / "truth.json").read_text())
        with tempfile.TemporaryDirectory() as folder:
            material, seconds = fit(arguments[0], capture, folder, options)
            rows = list(parameters(material, truth))
            fixes = []
            for owner, values in [(t["name"], t) for t in truth["layers"]] + [("surface", truth["surface"])]:
                for key, value in values.items():
                    if any(name.split()[0] == f"{owner}.{key}" for name, *_ in rows):
                        fixes += ["--fix", f"{owner}.{key}=" + ",".join(f"{x:.17g}" for x in as_list(value))]
            at_truth, _ = fit(arguments[0], capture, Path(folder) / "truth", [*options, *fixes])
        print(f"\n{capture.name}: {material['status']} in {seconds:.0f} s\n\n| parameter | truth | fitted | off | 95 % interval | status |\n|---|---|---|---|---|---|")
        for name, goal, value, (low, high), status in rows:
            holds = "holds it" if low <= goal <= high else "**misses it**"
            table.append([capture.name, name, f"{goal:.3g}", f"{value:.3g}", f"{100 * (value / goal - 1):+.0f} %", f"[{low:.2g}, {high:.2g}] {holds}", status])
            print("| " + " | ".join(table[-1][1:]) + " |")
        print(f"\nCIEDE2000, median / 95 %: fitted {images(material)}; at the true values {images(at_truth)}")
        fitted, true = (m["image_error"]["photographs"] for m in (material, at_truth))
        shots += [[f"{capture.name}: `{material['status']}`, {seconds:.0f} s", name, *(f"{e[name]['de00_median']:.2f} / {e[name]['de00_p95']:.1f}" for e in (fitted, true))]
                  for name in fitted]
    model, command = material["model"], " ".join(["./dev bench truth", *(["--", *options] if options else [])])
    tables.write(
        f"truth_{model}", title=f"The {model} model against truth", command=command,
        shows=f"Values fitted by the model `{model}` to the bundled path-traced captures, against their true materials.",
        columns=["capture", "parameter", "truth", "fitted", "error", "95 % interval", "status"], rows=table, notes=["Fits start off by a factor 1.5."])
    tables.write(
        f"truth_{model}_photographs", title=f"Photographs by the {model} model", command=command,
        shows=f"CIEDE2000 of photographs by the model `{model}`, with the fitted and with the true values, against the path-traced ones.",
        columns=["capture", "photograph", "fitted, median / 95 %", "at the true values, median / 95 %"], rows=shots,
        notes=["The difference at the true values is the model's own error, with the photographs' noise."])


if __name__ == "__main__":
    main()
