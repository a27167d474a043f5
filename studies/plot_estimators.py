#!/usr/bin/python3
"""Runs estimator_study on captures and shows how much less noise x time the estimator `collisions` needs than `exits`:
plot_estimators.py PROGRAM FOLDER CAPTURES"""
import csv
import subprocess
import sys
from pathlib import Path
import matplotlib
matplotlib.use("Agg")
import matplotlib.pyplot as plt

import tables

program, folder, captures = sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3])
folder.mkdir(parents=True, exist_ok=True)
file = folder / "estimators.csv"
with file.open("w") as out:
    subprocess.run([program, *(str(captures / name) for name in ("incisor", "disc", "sphere"))], check=True, stdout=out)
rows = list(csv.DictReader(file.open()))
widths = {"as they are": 1.0, "a fifth as wide": 0.2, "points": 0.02}
lamps = [w for w in widths if any(r["lamps"] == w for r in rows)]
roughnesses = sorted({r["roughness"] for r in rows}, key=float)


def of(width, roughness):
    return [r for r in rows if (r["lamps"], r["roughness"]) == (width, roughness)]


def is_known(row):
    """Whether `exits` finds enough light to compare with: no path meets a point by chance."""
    return float(row["ratio_error"]) < 0.3


def median(values):
    values = sorted(values)
    return (values[(len(values) - 1) // 2] + values[len(values) // 2]) / 2


figure, axes = plt.subplots(1, 2, figsize=(11, 4.5))
for roughness, colour in zip(roughnesses, ("black", "tab:blue", "tab:green", "tab:red")):
    for estimator, style in (("exits", "--"), ("collisions", "-")):
        some = [w for w in lamps if estimator == "collisions" or all(map(is_known, of(w, roughness)))]
        y = [median(float(r[f"error_{estimator}"]) ** 2 * float(r[f"s_{estimator}"]) for r in of(w, roughness)) * 1e4 for w in some]
        axes[0].loglog([widths[w] for w in some], y, style, marker="o", color=colour, label=f"{estimator}, roughness {roughness}")
    some = [w for w in lamps if all(map(is_known, of(w, roughness)))]
    axes[1].loglog([widths[w] for w in some], [median(float(r["gain"]) for r in of(w, roughness)) for w in some], "-o", color=colour,
                   label=f"roughness {roughness}")
for axis in axes:
    axis.set_xticks(list(widths.values()), list(widths))
    axis.minorticks_off()
    axis.set_xlabel("width of the lamps")
    axis.grid(alpha=0.3)
axes[0].legend(fontsize=7, ncol=2, loc="center left", bbox_to_anchor=(0.0, 0.27))
axes[1].legend(fontsize=7)
axes[1].set_yticks([1, 2, 5, 10, 20, 50], [1, 2, 5, 10, 20, 50])
axes[0].set_ylabel("processor s for 1 % error of a patch, median")
axes[1].set_ylabel("exits / collisions, median of photographs")
figure.tight_layout()
figure.savefig(folder / "estimators.png", dpi=80)
print(folder / "estimators.png")

table = []
for width in lamps:
    for roughness in roughnesses:
        some = of(width, roughness)
        name = [width, roughness + (" without highlights" if roughness == "0" else "")]
        if not all(map(is_known, some)):
            table.append([*name, "no bound: `exits` finds nothing", "-", "-", "-"])
            continue
        gains = [float(r["gain"]) for r in some]
        off = [(float(r["ratio"]) - 1) / float(r["ratio_error"]) for r in some]
        weights = [float(r["ratio_error"]) ** -2 for r in some]
        mean = sum(w * float(r["ratio"]) for w, r in zip(weights, some)) / sum(weights)
        table.append([*name, f"{median(gains):.1f}", f"{min(gains):.1f}",
                      f"{mean:.4f} +- {sum(weights) ** -0.5:.4f}", f"{max(map(abs, off)):.1f}"])
tables.write(
    "estimators", title="Noise against time", command="./dev bench estimators",
    shows="Variance x processor time of patches of 8 x 8 pixels: paths that find lamps where they leave (`exits`) over those that find them at every "
          "collision (`collisions`), on all photographs of the bundled incisor, disc and sphere at 64 paths a pixel.",
    columns=["lamps", "roughness", "gain, median of photographs", "least gain", "sums of pictures, collisions / exits", "largest difference in standard errors"],
    rows=table,
    notes=["Noise of the uncollided light is in the variance, and its computation in the time ([plot](images/estimators.png)).",
           "Under small lamps the variance of `exits` is known from few bright paths: gains there are good to a factor of two. The least gain there is "
           "that of the incisor's `edge`, whose lamp is then behind the blade.",
           "Mirror highlights of smooth surfaces are left out (crossed polarisers); both estimators find them alike."])
