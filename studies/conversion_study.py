#!/usr/bin/env python3
"""conversion_study.py CROWNFIT: how far the formulas of `crownfit export` are from adding-doubling (`crownfit slab`).

* albedo of multiple scattering: van de Hulst's (1980) for a half space without a change of index under diffuse light, on the
  similarity-reduced coefficients;
* the way back that OpenPBR 1.1 (Subsurface) gives to renderers, from that albedo C to single scattering: s = 4.09712 + 4.20863 C -
  sqrt(9.59217 + 41.6808 C + 17.7126 C^2), as the error of sa / ss' that it makes;
* one medium in place of two layers (crownfit export --to materialx): what it lets through, and returns over a black tile at half the thickness.
"""
import json
import math
import subprocess
import sys
import tempfile
from pathlib import Path

import tables


def slab(program, layers, **more):
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "slab.json"
        file.write_text(json.dumps({"format": "crownfit-slab/1", "layers": layers, **more}))
        return json.loads(subprocess.run([program, "slab", str(file)], capture_output=True, text=True, check=True).stdout)


def hulst(absorption, reduced):
    s = math.sqrt(absorption / (absorption + reduced))
    return (1 - s) * (1 - 0.139 * s) / (1 + 1.17 * s)


def albedos(program):
    """The largest error of the formula, and of what OpenPBR's formula finds again."""
    off, again = [], []
    print("| g | sa / ss' | albedo by formula | by adding-doubling | difference | sa / ss' found again by OpenPBR's formula |\n|---|---|---|---|---|---|")
    for g in (0.0, 0.7, 0.93):
        for ratio in (0.003, 0.01, 0.03, 0.1, 0.3):
            exact = slab(program, [{"ior": 1, "g": g, "scattering_per_mm": 1 / (1 - g), "absorption_per_mm": ratio, "thickness_mm": 1000}])["reflectance_diffuse"]
            c = hulst(ratio, 1.0)
            off.append(abs(c - exact))
            s2 = (4.09712 + 4.20863 * c - math.sqrt(9.59217 + 41.6808 * c + 17.7126 * c * c)) ** 2
            again.append(abs(s2 / (1 - s2) / ratio - 1))
            print(f"| {g} | {ratio} | {c:.4f} | {exact:.4f} | {c - exact:+.4f} | {100 * (s2 / (1 - s2) / ratio - 1):+.1f} % |")
    return max(off), max(again)


def one_medium(program):
    """Enamel over dentine as in datasets_synthetic/incisor, dentine 1.5 mm."""
    layers = [{"ior": 1.63, "g": 0.68, "scattering_per_mm": 6.25, "absorption_per_mm": 0.02, "thickness_mm": 0.7},
              {"ior": 1.54, "g": 0.93, "scattering_per_mm": 2 / 0.07, "absorption_per_mm": 0.07, "thickness_mm": 1.5}]
    total = sum(x["thickness_mm"] for x in layers)
    mean = lambda of: sum(x["thickness_mm"] * of(x) for x in layers) / total  # noqa: E731
    scattering, reduced = mean(lambda x: x["scattering_per_mm"]), mean(lambda x: x["scattering_per_mm"] * (1 - x["g"]))
    one = {"ior": 1.63, "g": 1 - reduced / scattering, "scattering_per_mm": scattering, "thickness_mm": total}
    wanted = slab(program, layers)["reflectance_collimated"]
    low, high = 1e-6, 10.0
    for _ in range(40):
        one["absorption_per_mm"] = math.sqrt(low * high)
        low, high = (one["absorption_per_mm"], high) if slab(program, [one])["reflectance_collimated"] > wanted else (low, one["absorption_per_mm"])
    print("\n| two layers, one medium | layers | one medium |\n|---|---|---|")
    rows = []
    for what, scale, key in (("reflectance", 1.0, "reflectance_collimated"), ("transmittance", 1.0, "transmittance_collimated"),
                             ("reflectance at half the thickness", 0.5, "reflectance_collimated"), ("transmittance at half the thickness", 0.5, "transmittance_collimated")):
        values = [slab(program, [x | {"thickness_mm": scale * x["thickness_mm"]} for x in stack])[key] for stack in (layers, [one])]
        print(f"| {what} | {values[0]:.4f} | {values[1]:.4f} |")
        rows.append([f"{what}, one medium for 0.7 mm of enamel over 1.5 mm of dentine", *(f"{v:.4f}" for v in reversed(values)), f"{values[1] - values[0]:+.4f}"])
    return rows


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    off, again = albedos(sys.argv[1])
    tables.write(
        "conversions", title="Formulas of exports", command="./dev bench conversions",
        shows="Formulas by which `crownfit export` simplifies a material, against adding-doubling.",
        columns=["quantity", "by the formula", "by adding-doubling", "difference"],
        rows=[["albedo of multiple scattering, absorption / reduced scattering up to 0.3, g 0, 0.7, 0.93", "-", "-", f"at most {off:.4f}"],
              ["absorption / reduced scattering found again by OpenPBR's formula", "-", "-", f"at most {100 * again:.1f} %"], *one_medium(sys.argv[1])],
        notes=["`all_layers` of an export to MaterialX is the one medium."])


if __name__ == "__main__":
    main()
