#!/usr/bin/env python3
"""compare_mitsuba.py CROWNFIT: renders the captures of make_peer_captures.py with `crownfit render --model path` and with
Mitsuba 3, and compares them as means of blocks of 6 x 6 pixels and of the whole picture.

Both programs state the noise of their pixels: crownfit in the variance layer of its EXR files, Mitsuba by the scatter of
independent seeds. z is the difference over the standard errors of both, put together; where they agree z has a standard
deviation of 1. A block or a picture fails at |z| > 4. Of 400 blocks that agree, one does so in 1 of 40 runs: the limit is
not widened for their number. The errors hold the share OFFSET_SHARE for Mitsuba's ray offsets.

Needs Python 3.11; makes a virtual environment beside this file for mitsuba and numpy when they can't be imported. One
core, about 6 minutes of Mitsuba at the default number of paths.
Exit codes: 0 they agree; 1 they do not; 77 Mitsuba is missing; 2 wrong use, or crownfit failed.
"""
import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
BLOCK = 6  # pixels
LIMIT = 4.0  # standard errors
SEEDS = 8
# Mitsuba (single precision) starts rays off a surface by 0.00009 x (1 mm + the largest coordinate) and so skips up to
# 0.005 free paths. Measured: with the scenes moved 80 mm away, where the skip is 15 times longer, the pictures' means
# change by +0.02 +- 0.03 to -0.4 +- 0.2 %; a fifteenth of that is left.
OFFSET_SHARE = 0.0003


def provide_mitsuba():
    """Goes on in the virtual environment beside this file, which is made when Mitsuba is not at hand."""
    try:
        import mitsuba, numpy  # noqa: F401, E401
        return
    except ImportError as error:
        reason = str(error)
    python = HERE / ".venv/bin/python"
    if os.environ.get("CROWNFIT_PEERS_VENV"):
        give_up(reason)
    try:
        if not python.exists():
            subprocess.run([sys.executable, "-m", "venv", HERE / ".venv"], check=True, capture_output=True, text=True)
            (HERE / ".venv/.gitignore").write_text("*\n")
        if subprocess.run([python, "-c", "import mitsuba, numpy"], capture_output=True).returncode != 0:
            print("installing mitsuba and numpy in", HERE / ".venv", flush=True)
            subprocess.run([python, "-m", "pip", "install", "--quiet", "mitsuba", "numpy"], check=True, capture_output=True, text=True)
    except subprocess.CalledProcessError as error:
        give_up((error.stderr or error.stdout or str(error)).strip().splitlines()[-1])
    except OSError as error:
        give_up(str(error))
    os.environ["CROWNFIT_PEERS_VENV"] = "1"
    os.execv(python, [str(python), *sys.argv])


def give_up(reason):
    print("Mitsuba is missing:", reason)
    sys.exit(77)


def arguments():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("crownfit", nargs="?", help="the executable")
    p.add_argument("--work", type=Path, help="folder for captures and pictures (default: a temporary one)")
    p.add_argument("--paths", type=int, default=2000, help="paths per pixel of both programs (default 2000; Mitsuba takes half in a rough scene)")
    p.add_argument("--threads", type=int, default=1, help="threads of crownfit (default 1)")
    p.add_argument("--only", metavar="CAPTURE", help="only this capture")
    p.add_argument("--truths", action="store_true", help="check the Mitsuba side by itself, before or instead of the comparison")
    options = p.parse_args()
    if not options.crownfit and not options.truths:
        p.error("the crownfit executable is needed")
    return options


def crownfit_picture(options, capture, name, folder):
    """(pixels, variance of each) by crownfit; a grey scene must come out grey."""
    import mitsuba as mi
    import numpy as np
    command = [options.crownfit, "render", str(capture), "--model", "path", "--paths", str(options.paths), "--photograph", name, "-o", str(folder),
               "--threads", str(options.threads), "--progress", "none"]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        print(f"{' '.join(command)}: exit {done.returncode}\n{done.stderr.strip()}")
        sys.exit(2)
    bitmap = mi.Bitmap(str(folder / f"{name}.exr"))
    channels = {field.name: i for i, field in enumerate(bitmap.struct_())}
    missing = [c for layer in ("", "variance.") for c in (layer + "R", layer + "G", layer + "B") if c not in channels]
    if missing:
        print(f"{folder / name}.exr has no channel {', '.join(missing)}; it has {', '.join(channels)}")
        sys.exit(2)
    values = np.array(bitmap, dtype=float)
    rgb = values[..., [channels[c] for c in "RGB"]]
    if np.abs(rgb - rgb[..., 1:2]).max() > 1e-4 * rgb.max():
        print(f"FAIL {capture.name} {name}: the channels of a grey scene differ")
        return None
    return rgb[..., 1], values[..., channels["variance.G"]]


def mitsuba_picture(options, capture, name):
    """(pixels, variance of each) by Mitsuba."""
    import mitsuba_scene
    scene, factor = mitsuba_scene.scene_of(capture, name)
    rough = scene["surface_0"]["bsdf"]["type"] == "crownfit_rough"  # a Python plug-in: five times slower
    paths = max(1, options.paths // (2 if rough else 1) // SEEDS)
    pictures = mitsuba_scene.render(scene, factor, paths, range(1, SEEDS + 1))
    return pictures.mean(0), pictures.var(0, ddof=1) / SEEDS


def blocks(picture):
    """Sums over blocks."""
    h, w = picture.shape
    return picture.reshape(h // BLOCK, BLOCK, w // BLOCK, BLOCK).sum((1, 3))


def compare(ours, theirs):
    """Figures of two pictures (pixels, variances): blocks with light, rms and largest |z| and where that block is, ratio
    of the means with its standard error, z of the means."""
    import numpy as np
    a, b = blocks(ours[0]), blocks(theirs[0])
    variance = blocks(ours[1]) + blocks(theirs[1]) + (OFFSET_SHARE * b) ** 2
    lit = (a != 0) | (b != 0)
    z = np.zeros_like(a)
    z[lit] = (a - b)[lit] / np.sqrt(np.maximum(variance[lit], 1e-30))
    worst = np.unravel_index(np.abs(z).argmax(), z.shape)
    total = b.sum()
    error = np.sqrt(ours[1].sum() + theirs[1].sum() + (OFFSET_SHARE * total) ** 2)
    return {"blocks": int(lit.sum()), "rms": float(np.sqrt((z[lit] ** 2).mean())), "largest": float(z[worst]), "worst": worst,
            "ours": a[worst] / BLOCK**2, "theirs": b[worst] / BLOCK**2,
            "block_error": float(np.median(np.sqrt(variance[lit]) / np.maximum(b[lit], 1e-30))),
            "ratio": a.sum() / total, "error": error / total, "z": (a.sum() - total) / error}


def main():
    options = arguments()
    provide_mitsuba()
    sys.path.insert(0, str(HERE))
    if options.truths:
        truths = subprocess.run([sys.executable, HERE / "mitsuba_truths.py"]).returncode
        if truths != 0 or not options.crownfit:
            sys.exit(1 if truths else 0)
    import numpy as np
    from make_peer_captures import CAPTURES
    if options.only and options.only not in CAPTURES:
        sys.exit(f"no capture is called {options.only}; there are {', '.join(CAPTURES)}")
    keep = options.work or Path(tempfile.mkdtemp(prefix="crownfit_peers_"))
    failed = False
    print(f"{'capture':14}{'photograph':12}{'blocks':>7}{'rms z':>7}{'largest z':>11}{'in block':>10}{'block error':>13}{'crownfit / Mitsuba':>21}{'z':>7}"
          f"{'crownfit s':>12}{'Mitsuba s':>11}")
    for capture_name, write in CAPTURES.items():
        if options.only not in (None, capture_name):
            continue
        capture = write(keep / capture_name)
        import mitsuba_scene
        for shot in mitsuba_scene.read_json(capture / "capture.json")["photographs"]:
            name, begin = shot["name"], time.time()
            ours = crownfit_picture(options, capture, name, keep / f"{capture_name}_crownfit")
            if ours is None:
                failed = True
                continue
            middle = time.time()
            theirs = mitsuba_picture(options, capture, name)
            np.savez(keep / f"{capture_name}_{name}.npz", crownfit=ours, mitsuba=theirs)
            f = compare(ours, theirs)
            bad = not (abs(f["largest"]) <= LIMIT and abs(f["z"]) <= LIMIT)  # also when not a number
            failed = failed or bad
            print(f"{capture_name:14}{name:12}{f['blocks']:7}{f['rms']:7.2f}{f['largest']:+11.2f}{'%d,%d' % f['worst']:>10}{100 * f['block_error']:11.2f} %"
                  f"{f['ratio']:12.4f} +- {f['error']:.4f}{f['z']:+7.2f}{middle - begin:12.0f}{time.time() - middle:11.0f}{'  FAIL' if bad else ''}", flush=True)
            if abs(f["largest"]) > LIMIT:
                print(f"    block {f['worst'][0]},{f['worst'][1]} (row, column): crownfit {f['ours']:.5f}, Mitsuba {f['theirs']:.5f}")
    print(f"block error: median standard error of a block's difference; pictures as {keep}/*.npz")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
