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
sys.exit(code)
