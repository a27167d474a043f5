#!/usr/bin/env python3
"""plot_stability.py STUDY OUT_DIR [--points N]: runs the study of the shading terms against 50 digits; writes its table
and a plot of how much of what is allowed each term's values and derivatives use."""
import csv
import subprocess
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

import tables

study, out = sys.argv[1], Path(sys.argv[2])
out.mkdir(parents=True, exist_ok=True)
code = subprocess.run([study, "--csv", out / "stability.csv", *sys.argv[3:]]).returncode
rows = list(csv.DictReader(open(out / "stability.csv")))
places = range(len(rows))
figure, axes = plt.subplots(figsize=(8, 0.22 * len(rows) + 1))
for key, mark, label in (("worst_over_allowed", "o", "value"), ("worst_slope_over_allowed", "x", "derivative")):
    axes.plot([max(float(r[key]), 1e-6) for r in rows], places, mark, label=label)
axes.axvline(1, color="red", lw=0.8)
axes.set_xscale("log")
axes.set_yticks(places, [r["term"] for r in rows], fontsize=7)
axes.invert_yaxis()
axes.set_xlabel("largest error over what is allowed")
axes.legend()
figure.tight_layout()
figure.savefig(out / "stability.png", dpi=110)
print(out / "stability.csv", out / "stability.png")
groups = {"shading terms and their derivatives": [r for r in rows if not r["term"].startswith("two layers")],
          "totals of the two-layer stack and their derivatives": [r for r in rows if r["term"].startswith("two layers")]}
allowed = ["1e-12, or 16 roundings of the arguments", "1e-8, or 16 roundings of the arguments"]
faults = ("beyond", "slopes_beyond", "not_finite", "negative", "above")
tables.write(
    "stability", title="Shading terms against 50 digits", command="./dev bench stability",
    shows="Shading terms and their derivatives in double precision, against the same formulas in 50 digits.",
    columns=["quantity", "terms", "points each", "allowed relative error", "largest error", "faults"],
    rows=[[name, len(of), of[0]["points"], bar, f"{max(float(r['worst_over_allowed']) for r in of):.2g} of what is allowed, "
           f"derivatives {max(float(r['worst_slope_over_allowed']) for r in of):.2g}", sum(int(r[k]) for r in of for k in faults)]
          for (name, of), bar in zip(groups.items(), allowed) if of],
    notes=["Arguments span the whole range that captures may state, half of them at corners.", "Values must also be finite, not negative and, where they are shares, at most 1."])
sys.exit(code)
