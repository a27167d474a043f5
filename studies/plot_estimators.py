#!/usr/bin/python3
"""Runs estimator_study and plots a pixel's error against CPU seconds: plot_estimators.py PROGRAM FOLDER"""
import csv
import io
import subprocess
import sys
from pathlib import Path
import matplotlib
matplotlib.use("Agg")
import matplotlib.pyplot as plt

program, folder = sys.argv[1], Path(sys.argv[2])
folder.mkdir(parents=True, exist_ok=True)
text = subprocess.run([program], check=True, stdout=subprocess.PIPE, text=True).stdout
(folder / "estimators.csv").write_text(text)
print(text, end="")
rows = list(csv.DictReader(io.StringIO(text)))
lights = list(dict.fromkeys(r["light"] for r in rows))
colours = {"0": "black", "0.05": "tab:blue", "0.15": "tab:green", "0.3": "tab:red"}
styles = {"chance": "-", "chance and points on lamps": "--", "diffuse exits": ":"}
figure, axes = plt.subplots(1, len(lights), figsize=(4.2 * len(lights), 4.2), sharey=True)
for axis, light in zip(axes, lights):
    for r in (r for r in rows if r["light"] == light):
        seconds = [10.0 ** k for k in range(0, 6)]
        at_1 = float(r["cpu_s_for_1_percent"])
        axis.loglog(seconds, [100 * 0.01 * (at_1 / s) ** 0.5 for s in seconds], styles[r["estimator"]],
                    color=colours[r["roughness"]], label=f"{r['estimator']}, roughness {r['roughness']}")
    axis.set_title(light)
    axis.set_xlabel("CPU seconds, one core, all 300 pixels")
    axis.grid(alpha=0.3)
    axis.legend(fontsize=6)
axes[0].set_ylabel("error of a pixel, % of the mean pixel")
figure.tight_layout()
figure.savefig(folder / "estimators.png", dpi=80)
print(folder / "estimators.png")
