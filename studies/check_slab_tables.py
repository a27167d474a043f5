#!/usr/bin/env python3
"""Holds `crownfit slab` against tables of independent programs: totals and rings, adding-doubling and MCML.

usage: check_slab_tables.py CROWNFIT_EXECUTABLE [--photons N] [--every K] [--model path|layered|both]

Reads tooth_*.csv and ceramic_*.csv from $CROWNFIT_REFERENCE/reference. For every case:
  layered  reflectance and transmittance, against adding-doubling where the table has it, else Monte Carlo
  path     the same with its own stated errors, and its ring means against MCML's, rings of fewer than 30 counts pooled
Demands: totals within 4 combined standard errors + min(0.001, 0.5 %); over all rings an rms z of 0.9 to 1.15 and 99.9 % of
them within 4 standard errors. Leaves a table for docs/validation.md. Exit 77: no reference data.
"""
import argparse
import csv
import json
import math
import os
import subprocess
import sys
import tempfile
from collections import defaultdict
from pathlib import Path

import tables


def rows(path):
    with open(path) as f:
        yield from csv.DictReader(line for line in f if not line.startswith("#"))


def number(row, *keys):
    for key in keys:
        if row.get(key) not in ("", None):
            return float(row[key])
    return None


def slab_of(row, radii):
    if "dentine_mua_per_mm" in row:
        layers = [{"ior": number(row, "dentine_n"), "g": 0.93, "scattering_per_mm": 28.0,
                   "absorption_per_mm": number(row, "dentine_mua_per_mm"), "thickness_mm": 2.0}]
        if number(row, "enamel_mm"):
            layers.insert(0, {"ior": number(row, "enamel_n"), "g": 0.96, "scattering_per_mm": 6.0,
                              "absorption_per_mm": number(row, "enamel_mua_per_mm"), "thickness_mm": number(row, "enamel_mm")})
    else:
        g = number(row, "g")
        layers = [{"ior": 1.54, "g": g, "scattering_per_mm": number(row, "musp_per_mm") / (1 - g),
                   "absorption_per_mm": number(row, "mua_per_mm"), "thickness_mm": number(row, "thickness_mm")}]
    slab = {"format": "crownfit-slab/1", "layers": layers, "ior_above": 1.0,
            "ior_below": 1.0 if row["base"] == "air" else layers[-1]["ior"]}
    if radii:
        slab["radii_mm"] = radii
    return slab


class Run:
    def __init__(self, crownfit, folder):
        self.crownfit, self.file, self.wall = crownfit, Path(folder) / "slab.json", 0.0

    def __call__(self, slab, *options):
        self.file.write_text(json.dumps(slab))
        answer = json.loads(subprocess.run([self.crownfit, "slab", str(self.file), *options], capture_output=True, text=True, check=True).stdout)
        self.wall += answer["wall_s"]
        return answer


def ring_scores(answer, table, what, photons, unscattered):
    """z of every ring (means per mm^2 against MCML's), rings of fewer than 30 expected counts pooled with the next. MCML keeps
    light that was never scattered apart; here it is in the innermost ring."""
    mean = answer[f"radial_{what}_per_mm2"]
    error = answer["stddev"][f"radial_{what}_per_mm2"]
    key = "Rd" if what == "reflectance" else "Td"
    scores, a, b, variance, counts = [], 0.0, 0.0, 0.0, 0.0
    for i, row in enumerate(table):
        inner, outer = number(row, "r_lo_mm"), number(row, "r_hi_mm")
        area = math.pi * (outer**2 - inner**2)
        want, se = number(row, f"{key}_r_per_mm2"), number(row, f"{key}_r_se")
        if i == 0:
            want += unscattered / area
        a, b = a + mean[i] * area, b + want * area
        variance += (error[i] * area) ** 2 + (se * area) ** 2
        counts += photons * mean[i] * area
        if counts >= 30:
            scores.append((a - b) / math.sqrt(variance))
            a = b = variance = counts = 0.0
    return scores


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("crownfit")
    p.add_argument("--photons", type=int, default=1000000)
    p.add_argument("--every", type=int, default=1)
    p.add_argument("--model", default="both", choices=["path", "layered", "both"])
    a = p.parse_args()
    reference = Path(os.environ.get("CROWNFIT_REFERENCE", "../shared")) / "reference"
    if not (reference / "tooth_totals.csv").exists():
        print(f"not run: no tables in {reference} (set CROWNFIT_REFERENCE)")
        return 77
    bad, totals, rings = [], defaultdict(list), defaultdict(list)
    with tempfile.TemporaryDirectory() as folder:
        run = Run(a.crownfit, folder)
        for family in ("tooth", "ceramic"):
            radial = defaultdict(list)
            for row in rows(reference / f"{family}_radial.csv"):
                if row["r_hi_mm"]:  # else: all that lies beyond the last ring
                    radial[row["case_id"]].append(row)
            for i, row in enumerate(rows(reference / f"{family}_totals.csv")):
                if i % a.every:
                    continue
                case = row["case_id"]
                exact = number(row, "AD64_UR1") is not None
                want = {"R": number(row, "AD64_UR1", "R_total", "MC_R_total"),
                        "T": (number(row, "AD64_UT1", "T_total", "MC_T_total") if row["base"] == "air" or not exact else None)}
                se = {"R": 0.0 if exact else number(row, "Rd_se", "MC_Rd_se") or 0.0, "T": 0.0 if exact else number(row, "Td_se", "MC_Td_se") or 0.0}
                table = radial.get(case, [])
                edges = [number(table[0], "r_lo_mm")] + [number(r, "r_hi_mm") for r in table] if table else []
                answers = {}
                if a.model != "path":
                    answers["layered"] = run(slab_of(row, []), "--model", "layered")
                if a.model != "layered":
                    answers["path"] = run(slab_of(row, edges), "--model", "path", "--photons", str(a.photons))
                for model, answer in answers.items():
                    got = {"R": answer["reflectance_collimated"] + answer["specular"], "T": answer["transmittance_collimated"]}
                    own = {"R": answer["stddev"]["reflectance_collimated"], "T": answer["stddev"]["transmittance_collimated"]}
                    for what in ("R", "T"):
                        if want[what] is None:
                            continue
                        error = math.hypot(own[what], se[what])
                        difference = got[what] - want[what]
                        totals[model, family, what].append((difference, difference / error if error else None))
                        if abs(difference) > 4 * error + min(0.001, 0.005 * want[what]):
                            bad.append(f"{model} {case} {what}: {got[what]:.6f} against {want[what]:.6f}")
                if table and "path" in answers:
                    for what in ("reflectance", "transmittance"):
                        if what == "transmittance" and number(table[0], "Td_r_per_mm2") is None:
                            continue
                        unscattered = number(row, *(("Rb", "MC_Rb") if what == "reflectance" else ("Tb", "MC_Tb"))) or 0.0
                        scores = ring_scores(answers["path"], table, what, a.photons, unscattered)
                        rings[family, what] += scores
                        if len(scores) > 10 and math.sqrt(sum(z * z for z in scores) / len(scores)) > 1.6:
                            print(f"note: {case} {what}: rms z {math.sqrt(sum(z * z for z in scores) / len(scores)):.2f} over {len(scores)} rings")
        print(f"wall {run.wall:.0f} s")
    table = []
    for (model, family, what), values in totals.items():
        scores = [z for _, z in values if z is not None]
        text = f"{model} {family} {what}: {len(values)} cases, largest difference {max(abs(d) for d, _ in values):.2e}"
        rms = f"{math.sqrt(sum(z * z for z in scores) / len(scores)):.2f}" if scores else "-"
        table.append([f"`{model}`", f"totals, {family}, {what}", f"{len(values)} cases", f"{max(abs(d) for d, _ in values):.2e}", rms, "-"])
        if scores:
            text += f", rms z {math.sqrt(sum(z * z for z in scores) / len(scores)):.2f}, mean z {sum(scores) / len(scores):+.2f}, worst {max(scores, key=abs):+.2f}"
        print(text)
    every = []
    for (family, what), scores in rings.items():
        every += scores
        print(f"rings {family} {what}: {len(scores)}, rms z {math.sqrt(sum(z * z for z in scores) / len(scores)):.3f}, mean z {sum(scores) / len(scores):+.3f}, "
              f"within 4: {100 * sum(abs(z) <= 4 for z in scores) / len(scores):.2f} %, worst {max(scores, key=abs):+.2f}")
    if every:
        rms, within = math.sqrt(sum(z * z for z in every) / len(every)), sum(abs(z) <= 4 for z in every) / len(every)
        print(f"rings in all: {len(every)}, rms z {rms:.3f}, within 4 standard errors {100 * within:.3f} %")
        if not 0.9 <= rms <= 1.15:
            bad.append(f"rms z of all rings {rms:.3f}, not in 0.9 to 1.15")
        table.append(["`path`", "rings", f"{len(every)} rings", "-", f"{rms:.3f}", f"{100 * within:.3f} %"])
        if within < 0.999:
            bad.append(f"only {100 * within:.3f} % of the rings within 4 standard errors")
    for line in bad:
        print("FAIL", line)
    tables.write(
        "slab_tables", title="Slabs and rings against tables", command=f"./dev bench slabs {' '.join(sys.argv[2:])}".strip(),
        shows="`crownfit slab` for flat layered samples, against tables of adding-doubling with 64 angles and of MCML.",
        columns=["model", "quantity", "compared", "largest difference", "rms z", "within 4 standard errors"], rows=table,
        notes=[f"{a.photons:,} photons a case; one case of {a.every}.", "z is a difference in combined standard errors; its rms is 1 where programs agree.",
               "Rings of fewer than 30 counts are pooled."])
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
