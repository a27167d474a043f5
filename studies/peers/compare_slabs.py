#!/usr/bin/env python3
"""compare_slabs.py CROWNFIT: ceramic slabs of $CROWNFIT_REFERENCE/reference/ceramic_totals.csv by `crownfit slab --model layered` and by
iadpython, each against adding-doubling with 64 angles (the table's AD64: reflectance and transmittance, the mirrored light
included); and the inversion of such totals by `crownfit fit`, by iadpython, and by iad as the table ceramic_iad_inverse.csv has it.
Times: of the solution itself, as each program measures it, one thread."""
import csv
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

os.environ |= {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}  # before numpy is loaded

import iadpython  # noqa: E402
import numpy as np  # noqa: E402
from table import missing, row  # noqa: E402

QUADRATURE = 16
PEER = f"iadpython {iadpython.__version__}"
INVERTED = 6  # of the table's rows with g = 0.8, evenly spread: each takes seconds


def table(name):
    lines = [x for x in (Path(os.environ.get("CROWNFIT_REFERENCE", "/nowhere")) / "reference" / name).read_text().splitlines() if not x.startswith("#")]
    return list(csv.DictReader(lines))


def crownfit_totals(program, case, file):
    g = float(case["g"])
    slab = {"format": "crownfit-slab/1", "layers": [{"ior": float(case["n"]), "g": g, "scattering_per_mm": float(case["musp_per_mm"]) / (1 - g),
                        "absorption_per_mm": float(case["mua_per_mm"]), "thickness_mm": float(case["thickness_mm"])}]}
    file.write_text(json.dumps(slab))
    answer = json.loads(subprocess.run([program, "slab", str(file), "--threads", "1"], capture_output=True, text=True, check=True).stdout)
    return [answer["specular"] + answer["reflectance_collimated"], answer["transmittance_collimated"]], answer["wall_s"]


def crownfit_inversions(program, rows, folder):
    """Three rows of one thickness and g are the bands of a capture: [error of absorption, of reduced scattering, whether both
    intervals hold the truth] of each, seconds a row, how many fits say of themselves that they must not be used."""
    groups = {}
    for r in rows:
        groups.setdefault((r["case_id"].split("_d")[1].split("_")[0], r["g_true"]), []).append(r)
    found, seconds, refused = [], [], 0
    for (mm, g), group in groups.items():
        for three in (group[i:i + 3] for i in range(0, len(group), 3)):
            three = (three * 3)[:3]  # the last may be fewer
            reading = lambda key: {"value": [float(r[key]) for r in three], "stddev": 1e-4}
            capture = {"format": "crownfit-capture/1",
                       "object": {"layers": [{"name": "slab", "ior": {"fixed": 1.54}, "g": {"fixed": float(g)},
                                              "reduced_scattering_per_mm": {"initial": 2, "shared": "none"}, "absorption_per_mm": {"initial": 0.05, "shared": "none"}}]},
                       "measurements": [{"name": mm, "thickness_mm": float(mm), "geometry": "0/d", "specular": "included",
                                         "reflectance": reading("R_in"), "transmittance": reading("T_in")}]}
            (folder / "capture.json").write_text(json.dumps(capture))
            done = subprocess.run([program, "fit", folder, "-o", folder / "result", "--no-priors", "--profiles", "0", "--threads", "1"], capture_output=True, text=True)
            refused += done.returncode != 0
            layer = json.loads((folder / "result/material.json").read_text())["layers"][0]
            seconds.append(json.loads((folder / "result/run.json").read_text())["wall_s"] / 3)
            for c, r in enumerate(three):
                off, holds = [], True
                for key, truth in (("absorption_per_mm", "mua_true"), ("reduced_scattering_per_mm", "musp_true")):
                    low, high = layer[key]["interval95"][c]
                    off.append(layer[key]["value"][c] / float(r[truth]) - 1)
                    holds &= low <= float(r[truth]) <= high
                found.append((r["case_id"], *off, holds))
    return {f[0]: f for f in found}.values(), np.median(seconds), refused


def sample(case, g):
    return iadpython.Sample(g=g, n=float(case["n"]), d=float(case["thickness_mm"]), quad_pts=QUADRATURE)


def iadpython_totals(case):
    g = float(case["g"])
    s, a = float(case["musp_per_mm"]) / (1 - g), float(case["mua_per_mm"])
    it = sample(case, g)
    it.a, it.b = s / (s + a), (s + a) * float(case["thickness_mm"])
    begin = time.time()
    r, t, _, _ = it.rt()
    return [float(r), float(t)], time.time() - begin


def invert(case):
    """(error of absorption, of reduced scattering, whether R and T come back within 1e-3, seconds)"""
    g = float(case["g"])
    experiment = iadpython.Experiment(r=float(case["AD64_UR1"]), t=float(case["AD64_UT1"]), sample=sample(case, g), default_g=g)
    begin = time.time()
    a, b, _ = experiment.invert_rt()
    seconds = time.time() - begin
    solved = sample(case, g)
    solved.a, solved.b = a, b
    r, t, _, _ = solved.rt()
    found = max(abs(r - experiment.m_r), abs(t - experiment.m_t)) < 1e-3
    thickness = float(case["thickness_mm"])
    absorption, reduced = b * (1 - a) / thickness, a * b * (1 - g) / thickness
    return absorption / float(case["mua_per_mm"]) - 1, reduced / float(case["musp_per_mm"]) - 1, found, seconds


def main():
    try:
        cases = [c for c in table("ceramic_totals.csv") if c["base"] == "air"]
        inverses = table("ceramic_iad_inverse.csv")
    except OSError as error:
        missing("reference tables", f"{error}; state $CROWNFIT_REFERENCE")
        return
    exact = np.array([[float(c["AD64_UR1"]), float(c["AD64_UT1"])] for c in cases])
    with tempfile.TemporaryDirectory() as folder:
        ours = [crownfit_totals(sys.argv[1], c, Path(folder) / "slab.json") for c in cases]
    theirs = [iadpython_totals(c) for c in cases]
    off, off_theirs = (np.abs(np.array([x[0] for x in y]) - exact) for y in (ours, theirs))
    ms, ms_theirs = (1000 * np.median([x[1] for x in y]) for y in (ours, theirs))
    row("AD64 table", f"{len(cases)} ceramic slabs, R and T", "layered", f"largest difference {off.max():.1e}, {ms:.2f} ms a slab", off.max() < 5e-5, "5e-5")
    row(PEER, f"the same by its {QUADRATURE} angles", "AD64 table", f"largest difference {off_theirs.max():.1e}, {ms_theirs:.2f} ms a slab", None)
    chosen = [c for c in cases if float(c["g"]) == 0.8]
    chosen = chosen[:: max(1, len(chosen) // INVERTED)][:INVERTED]
    found = [invert(c) for c in chosen]
    a, s = (np.abs([f[k] for f in found]) for k in (0, 1))
    row(PEER, f"{len(found)} of them inverted", "truth", f"absorption off by {100 * np.median(a):.2f} % (largest {100 * a.max():.1f}), reduced scattering "
        f"{100 * np.median(s):.2f} % ({100 * s.max():.1f}); {sum(not f[2] for f in found)} not found; {np.median([f[3] for f in found]):.2f} s each", None)
    right = [r for r in inverses if r["q"] == "16" and r["g_true"] == r["g_assumed"]]
    with tempfile.TemporaryDirectory() as folder:
        fitted, seconds, refused = crownfit_inversions(sys.argv[1], right, Path(folder))
    a, s = (np.abs([f[k] for f in fitted]) for k in (1, 2))
    row("AD64 table", f"{len(fitted)} slabs inverted by `fit`", "truth", f"absorption off by {100 * np.median(a):.2f} % (largest {100 * a.max():.1f}), reduced scattering "
        f"{100 * np.median(s):.2f} % ({100 * s.max():.1f}); {refused} not usable; {sum(f[3] for f in fitted)} hold the truth; {1000 * seconds:.0f} ms each", refused == 0 and a.max() < 1e-3, "0.1 %")
    bad = [r for r in right if r["status"] != "*"]
    row("iad 4-0-0", f"{len(right)} inversions of the table (16 angles, g known)", "truth",
        f"absorption off by {np.median([abs(float(r['mua_err_pct'])) for r in right]):.2f} %; {len(bad)} not found", None)


if __name__ == "__main__":
    main()
