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

import tables

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
table = []
for light, roughness in dict.fromkeys((r["light"], r["roughness"]) for r in rows):
    ways = {r["estimator"]: r for r in rows if (r["light"], r["roughness"]) == (light, roughness)}
    cell = {way: f"{r['noise_per_path']} / {r['us_per_path']} us" for way, r in ways.items()}
    ratio = f"{float(ways['diffuse exits']['mean']) / float(ways['chance']['mean']):.3f}" if "diffuse exits" in ways else "-"
    table.append([light, roughness, *(cell.get(way, "-") for way in styles), ratio])
tables.write(
    "estimators", title="Noise against time", command="./dev bench estimators",
    shows="Noise and time of every way in which paths find the lamps, against paths that meet them by chance.",
    columns=["light", "roughness", "by chance", "by chance and by points on lamps", "diffuse exits", "mean of diffuse exits / by chance"], rows=table,
    notes=["A cell has the standard deviation of one path over the mean pixel, and the processor time of a path.",
           "Light that the surface alone reflects is left out."])
