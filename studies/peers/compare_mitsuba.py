#!/usr/bin/env python3
"""compare_mitsuba.py CROWNFIT: the captures of make_peer_captures.py by `crownfit render --model path`, and by Mitsuba 3 from what
`crownfit export --to mitsuba` wrote, as means of blocks of 6 x 6 pixels and of the whole picture, in every channel.

Both programs state the noise of their pixels: crownfit in the variance layer of its EXR files, Mitsuba by the scatter of
independent seeds. z is the difference over the standard errors of both, put together; where they agree z has a standard
deviation of 1. A block or a picture fails at |z| > 4. Of 400 blocks that agree, one does so in 1 of 40 runs: the limit is
not widened for their number. The errors hold the share OFFSET_SHARE for Mitsuba's ray offsets.

Times: variance of the picture's blocks x seconds of one thread, Mitsuba's over crownfit's: how much longer Mitsuba renders
for the same noise. The rough crown is also rendered as exported, with Mitsuba's own boundary, which loses energy.
With --result and --capture instead: a fitted material on its own crown, as exported, against the reference pictures of the
export. Run by run_peers.py. One core, about 5 minutes at the default number of paths.
"""
import argparse
import subprocess
import tempfile
import time
from pathlib import Path

import mitsuba_scene
import numpy as np
from make_peer_captures import CAPTURES
from table import row

BLOCK = 6  # pixels
LIMIT = 4.0  # standard errors
SEEDS = 8
# Mitsuba (single precision) starts rays off a surface by 0.00009 x (1 mm + the largest coordinate) and so skips up to
# 0.005 free paths. Measured: with the scenes moved 80 mm away, where the skip is 15 times longer, the pictures' means
# change by +0.02 +- 0.03 to -0.4 +- 0.2 %; a fifteenth of that is left.
OFFSET_SHARE = 0.0003


def arguments():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("crownfit", help="the executable")
    p.add_argument("--work", type=Path, help="folder for captures and pictures (default: a temporary one)")
    p.add_argument("--paths", type=int, default=400, help="paths per pixel of both programs (default 400; Mitsuba takes a quarter in a rough scene)")
    p.add_argument("--result", type=Path, help="folder that `crownfit fit` wrote")
    p.add_argument("--capture", type=Path, help="the capture that it was fitted to")
    p.add_argument("--photograph", help="only this one of --capture")
    p.add_argument("--only", metavar="CAPTURE", choices=CAPTURES, help="only this capture")
    return p.parse_args()


def crownfit_picture(options, capture, name, folder):
    """(pixels, variance of each, seconds) by crownfit, one thread."""
    begin = time.time()
    subprocess.run([options.crownfit, "render", str(capture), "--material", str(capture / "truth.json"), "--model", "path", "--paths", str(options.paths),
                    "--photograph", name, "-o", str(folder), "--threads", "1", "--progress", "none"], check=True, capture_output=True)
    layers = mitsuba_scene.read_exr(folder / f"{name}.exr")
    return layers[""], layers["variance"], time.time() - begin


def mitsuba_picture(folder, name, paths, integrator):
    """(pixels, variance of each, seconds) by Mitsuba, one thread."""
    begin = time.time()
    pictures = mitsuba_scene.render(folder, name, max(1, paths // SEEDS), range(1, SEEDS + 1), integrator)
    return pictures.mean(0), pictures.var(0, ddof=1) / SEEDS, time.time() - begin


def blocks(picture):
    """Sums over blocks."""
    h, w, channels = picture.shape
    return picture.reshape(h // BLOCK, BLOCK, w // BLOCK, BLOCK, channels).sum((1, 3))


def compare(ours, theirs, is_grey):
    """Blocks with light, rms and largest |z|, ratio of the means with its standard error, z of the means, ratio of
    variance x time. Grey channels are the same numbers: one stands for all."""
    channels = slice(1, 2) if is_grey else slice(0, 3)
    a, b = blocks(ours[0])[..., channels], blocks(theirs[0])[..., channels]
    va, vb = blocks(ours[1])[..., channels], blocks(theirs[1])[..., channels]
    lit = (a != 0) | (b != 0)
    z = (a - b)[lit] / np.sqrt((va + vb + (OFFSET_SHARE * b) ** 2)[lit])
    sum_a, sum_b = a.sum((0, 1)), b.sum((0, 1))
    error = np.sqrt((va + vb).sum((0, 1)) + (OFFSET_SHARE * sum_b) ** 2)
    worst = np.abs((sum_a - sum_b) / error).argmax()
    return {"blocks": z.size, "rms": np.sqrt((z**2).mean()), "largest": np.abs(z).max(), "ratio": (sum_a / sum_b)[worst],
            "error": (error / sum_b)[worst], "z": ((sum_a - sum_b) / error)[worst], "work": (vb.sum() * theirs[2]) / (va.sum() * ours[2])}


def compare_result(options, work):
    """The fitted material, exported with its capture."""
    exported = work / "result_mitsuba"
    is_rough = mitsuba_scene.export(options.crownfit, options.capture, exported, material=options.result / "material.json", paths=options.paths)
    for scene in sorted(exported.glob("*.xml")):
        name = scene.stem
        if name == "material" or options.photograph not in (None, name):
            continue
        layers = mitsuba_scene.read_exr(exported / "reference" / f"{name}.exr")
        f = compare((layers[""], layers["variance"], 1.0), mitsuba_picture(exported, name, options.paths // (4 if is_rough else 1), "volpathmis"), False)
        row("Mitsuba 3", f"{options.result.name}, fitted, {name}, {f['blocks']} blocks", "path",
            f"ratio {f['ratio']:.4f} +- {f['error']:.4f}, blocks' z rms {f['rms']:.2f}, largest {f['largest']:.1f}",
            f["largest"] <= LIMIT and abs(f["z"]) <= LIMIT, f"|z| <= {LIMIT:g}")


def main():
    options = arguments()
    work = options.work or Path(tempfile.mkdtemp(prefix="crownfit_peers_"))
    if options.result:
        return compare_result(options, work)
    for capture_name, write in CAPTURES.items():
        if options.only not in (None, capture_name):
            continue
        capture = write(work / capture_name)
        exported = work / f"{capture_name}_mitsuba"
        is_rough = mitsuba_scene.export(options.crownfit, capture, exported)
        integrator = "volpathmis" if capture_name == "coloured_disc" else "volpath"
        for scene in sorted(exported.glob("*.xml")):
            name = scene.stem
            if name == "material":
                continue
            ours = crownfit_picture(options, capture, name, work / f"{capture_name}_crownfit")
            theirs = mitsuba_picture(exported, name, options.paths // (4 if is_rough else 1), integrator)
            f = compare(ours, theirs, integrator == "volpath")
            row("Mitsuba 3", f"{capture_name} {name}, {f['blocks']} blocks", "path",
                f"ratio {f['ratio']:.4f} +- {f['error']:.4f}, blocks' z rms {f['rms']:.2f}, largest {f['largest']:.1f}",
                f["largest"] <= LIMIT and abs(f["z"]) <= LIMIT, f"|z| <= {LIMIT:g}")
            note = " (its rough boundary is a Python plug-in)" if is_rough else ""
            row("Mitsuba 3", f"{capture_name} {name}: time at equal noise", "path", f"{f['work']:.3g} times crownfit's{note}", None)
            if is_rough:
                own = work / f"{capture_name}_mitsuba_own"
                mitsuba_scene.export(options.crownfit, capture, own, keeps_energy=False)
                f = compare(ours, mitsuba_picture(own, name, options.paths // 4, integrator), True)
                row("Mitsuba 3", f"{capture_name} {name} with its own roughdielectric", "path", f"crownfit / Mitsuba {f['ratio']:.3f} +- {f['error']:.3f}", None)


if __name__ == "__main__":
    main()
