#!/usr/bin/env python3
"""fit_against_truth.py CROWNFIT CAPTURE...: fits captures whose truth is known and prints how far off it ends.

For every capture (a folder with capture.json and truth.json): the fit from the capture's own start, and the same model at the
true values, which is the model's own error. Printed as the tables of docs/validation.md. Options after -- go to `crownfit fit`.
"""
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

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
            print(f"| {name} | {goal:.3g} | {value:.3g} | {100 * (value / goal - 1):+.0f} % | [{low:.2g}, {high:.2g}] {holds} | {status} |")
        print(f"\nCIEDE2000, median / 95 %: fitted {images(material)}; at the true values {images(at_truth)}")


if __name__ == "__main__":
    main()
