#!/usr/bin/env python3
"""compare_gradient.py CROWNFIT: the derivative of a picture's light by ln absorption, by `crownfit render --derivatives` and by Mitsuba's
prbvolpath (path replay backpropagation: Vicini, Speierer and Jakob 2021) on what `crownfit export` wrote, both over seeds, and by
central differences of crownfit's pictures at +- 10 %, within 4 standard errors. crownfit's derivatives are pooled over the
object by a polynomial (docs/path_model.md), whose bias shows here. Time: variance x seconds of one thread, Mitsuba's over
crownfit's, for this one derivative; crownfit's seconds also give those by scattering, g, index and roughness.
Needs LLVM (Debian: libllvm19; 14 and 15 stop with "cannot select" on AVX-512)."""
import glob
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

if newest := sorted(glob.glob("/usr/lib/x86_64-linux-gnu/libLLVM*-*.so*")):  # drjit would take the first it finds
    os.environ.setdefault("DRJIT_LIBLLVM_PATH", newest[-1])

import mitsuba_scene  # noqa: E402  (chooses a scalar variant; read_exr and export need it)
import drjit as dr  # noqa: E402
import mitsuba as mi  # noqa: E402
import numpy as np  # noqa: E402
from make_peer_captures import CAPTURES  # noqa: E402
from table import missing, row  # noqa: E402

SEEDS, PATHS, STEP = 6, 128, 0.1
CAPTURE, SHOT, LAYER, SCATTERING, ABSORPTION = "ceramic_disc", "dome", "ceramic", 2.0 / (1 - 0.8), 0.05


def crownfit_derivative(program, capture, folder, seed):
    begin = time.time()
    subprocess.run([program, "render", str(capture), "--material", str(capture / "truth.json"), "--model", "path", "--paths", str(PATHS), "--photograph", SHOT,
                    "--derivatives", "--seed", str(seed), "-o", str(folder), "--threads", "1", "--progress", "none"], check=True, capture_output=True)
    seconds = time.time() - begin
    return mitsuba_scene.read_exr(folder / f"{SHOT}_derivatives.exr")[f"{LAYER}.absorption_per_mm"][..., 1].mean(), seconds


def difference(program, capture, folder, seed):
    """d picture / d ln absorption from two pictures with the same random numbers."""
    level = []
    for sign in (-1, 1):
        truth = json.loads((capture / "truth.json").read_text())
        truth["layers"][0]["absorption_per_mm"] = [ABSORPTION * np.exp(sign * STEP)] * 3
        (folder / "moved.json").write_text(json.dumps(truth))
        subprocess.run([program, "render", str(capture), "--material", str(folder / "moved.json"), "--model", "path", "--paths", str(PATHS), "--photograph", SHOT,
                        "--seed", str(seed), "-o", str(folder / "moved"), "--threads", "1", "--progress", "none"], check=True, capture_output=True)
        level.append(mitsuba_scene.read_exr(folder / f"moved/{SHOT}.exr")[""][..., 1].mean())
    return (level[1] - level[0]) / (2 * STEP)


def mitsuba_derivative(scene, parameters, keys, seed):
    begin = time.time()
    absorption = mi.Float(ABSORPTION)
    dr.enable_grad(absorption)
    extinction = SCATTERING + absorption
    parameters[keys["sigma_t"]] = type(parameters[keys["sigma_t"]])(extinction / parameters[keys["scale"]])
    parameters[keys["albedo"]] = type(parameters[keys["albedo"]])(SCATTERING / extinction)
    parameters.update()
    picture = mi.render(scene, parameters, spp=PATHS, seed=seed)
    dr.backward(dr.mean(picture, axis=None))
    return ABSORPTION * dr.grad(absorption).numpy().item(), time.time() - begin


def main():
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        capture = CAPTURES[CAPTURE](folder / CAPTURE)
        ours = np.array([crownfit_derivative(sys.argv[1], capture, folder / "out", seed) for seed in range(1, SEEDS + 1)])
        differences = np.array([difference(sys.argv[1], capture, folder, seed) for seed in range(1, SEEDS + 1)])
        mitsuba_scene.export(sys.argv[1], capture, folder / "mitsuba")
        try:
            mi.set_variant("llvm_ad_mono")
            mi.set_log_level(mi.LogLevel.Error)
            dr.set_thread_count(1)
            scene = mi.load_file(str(folder / f"mitsuba/{SHOT}.xml"), integrator="prbvolpath", spp=str(PATHS))
        except (ImportError, RuntimeError) as error:
            missing("Mitsuba 3, derivatives", str(error).strip().splitlines()[-1])
            return
        parameters = mi.traverse(scene)
        keys = {name: next(k for k in parameters.keys() if "medium" in k and name in k) for name in ("sigma_t", "albedo", "scale")}
        mitsuba_derivative(scene, parameters, keys, 1000)  # compiles
        theirs = np.array([mitsuba_derivative(scene, parameters, keys, seed) for seed in range(1, SEEDS + 1)])
    (a, sa), (b, sb) = ((x[:, 0].mean(), x[:, 0].std(ddof=1) / SEEDS**0.5) for x in (ours, theirs))
    c, sc = differences.mean(), differences.std(ddof=1) / SEEDS**0.5
    row("Mitsuba 3, prbvolpath", f"{CAPTURE} {SHOT}: d picture / d ln absorption", "path --derivatives", f"crownfit {a:.5f} +- {sa:.5f}, Mitsuba "
        f"{b:.5f} +- {sb:.5f}, crownfit's differences {c:.5f} +- {sc:.5f}", abs(a - b) <= 4 * np.hypot(sa, sb), "4 standard errors")
    work = (sb**2 * theirs[:, 1].mean()) / (sa**2 * ours[:, 1].mean())
    row("Mitsuba 3, prbvolpath", "the same: time at equal noise", "path --derivatives",
        f"{work:.2g} times crownfit's ({theirs[:, 1].mean():.1f} and {ours[:, 1].mean():.1f} s a run; noise of {SEEDS} runs: a factor 2 either way)", None)


if __name__ == "__main__":
    main()
