#!/usr/bin/env python3
"""compare_cube.py CROWNFIT DIR: photographs of make_cube.py's version `even`, in DIR/even, against those that
`crownfit render --model path` makes of the true material.

The set becomes a capture by `crownfit capture import`, so cameras, lamps and units are compared too. Prints, for every
photograph and channel, the ratio of the sums over the object with its standard error, and the rms over patches of 8 x 8
pixels of the difference in standard errors (1 where they agree; a single pixel's own error is too uncertain). Exits 1 where a ratio is off by more than 4 standard errors. The errors hold
OFFSET_SHARE for Mitsuba's ray offsets (peers/compare_mitsuba.py). Needs mitsuba to read pictures. Two cores, about a
minute a photograph at 400 paths a pixel.
"""
import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).resolve().parent.parent / "peers"))
import mitsuba_scene  # noqa: E402

LIMIT = 4.0  # standard errors
PATCH = 8  # pixels
OFFSET_SHARE = 0.0003


def arguments():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("crownfit", help="the executable")
    p.add_argument("cube", type=Path, metavar="DIR", help="folder that make_cube.py made")
    p.add_argument("--work", type=Path, help="folder for capture and pictures (default: a temporary one)")
    p.add_argument("--paths", type=int, default=400, help="paths per pixel (default 400)")
    p.add_argument("--views", nargs="+", metavar="NAME", help="only these photographs")
    p.add_argument("--version", default="even", choices=("even", "streaked"), help="streaked: against the mean absorption, which shows what the streaks change")
    return p.parse_args()


def run(command):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True)
    if done.returncode not in (0, 1):
        sys.exit(done.stderr or done.stdout)
    return done.stdout + done.stderr


def make_capture(crownfit, version, folder):
    """The capture of one version, with the variances of its pixels, which an import does not look for."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    rig = json.loads((version / "light_rig.json").read_text())
    rig["lights"] = [light for light in rig["lights"] if (version / "images" / f"{light['name']}.exr").exists()]  # a lamp without a photograph would be on in all
    lights = folder.parent / "light_rig.json"
    lights.write_text(json.dumps(rig))
    known = json.loads((version.parent / "cube.json").read_text())
    holdout = [o for name in known["photographs"]["holdout"] if (version / "images" / f"{name}.exr").exists() for o in ("--holdout", name)]
    run([crownfit, "capture", "import", version / "transforms.json", "-o", folder, "--mesh", f"cube={version / 'cube.ply'}", "--lights", lights, *holdout])
    capture = json.loads((folder / "capture.json").read_text())
    for photograph in capture["photographs"]:
        variance = Path(photograph["file"]).with_name(f"{photograph['name']}_variance.exr")
        (folder / variance).write_bytes((version / "images" / variance.name).read_bytes())
        photograph["variance"] = str(variance)
    (folder / "capture.json").write_text(json.dumps(capture, indent=1) + "\n")
    return [photograph["name"] for photograph in capture["photographs"]]


def patches(values):
    """Sums over whole patches."""
    height, width = (n // PATCH for n in values.shape)
    return values[:height * PATCH, :width * PATCH].reshape(height, PATCH, width, PATCH).sum((1, 3))


def compare(ours, theirs):
    """[ratio of the sums, its standard error, rms and largest z of patches, relative error of a pixel of theirs] for every
    channel."""
    (a, va), (b, vb) = ours, theirs
    rows = []
    for c in range(3):
        on = (a[..., c] > 0) & (b[..., c] > 0) & (vb[..., c] > 0)
        x, vx, y, vy = (v[..., c][on] for v in (a, va, b, vb))
        ap, bp, variance = (patches(np.where(on, v[..., c], 0.0)) for v in (a, b, va + vb))
        shows = patches(on.astype(float)) >= 0.75 * PATCH**2
        z = (bp - ap)[shows] / np.sqrt(variance[shows])
        error = np.sqrt(vx.sum() + vy.sum() + (OFFSET_SHARE * y.sum()) ** 2)
        rows.append((x.sum() / y.sum(), error / y.sum(), np.sqrt((z**2).mean()), np.abs(z).max(), np.median(np.sqrt(vy) / x)))
    return rows


def main():
    options = arguments()
    work = options.work or Path(tempfile.mkdtemp(prefix="crownfit_cube_"))
    version = options.cube / options.version
    names = make_capture(options.crownfit, version, work / "capture")
    print(run([options.crownfit, "check", work / "capture"]), flush=True)
    print("photograph  channel  crownfit / Mitsuba    z      rms z  largest  error of a pixel")
    failed = False
    for name in names:
        if options.views and name not in options.views:
            continue
        run([options.crownfit, "render", work / "capture", "--material", version / "truth.json", "--model", "path", "--paths", options.paths, "--photograph", name,
             "-o", work / "pictures", "--progress", "none"])
        layers = mitsuba_scene.read_exr(work / "pictures" / f"{name}.exr")
        theirs = [mitsuba_scene.read_exr(version / "images" / f"{name}{end}.exr")[""] for end in ("", "_variance")]
        for channel, (ratio, error, rms, largest, noise) in zip("RGB", compare((layers[""], layers["variance"]), theirs)):
            z = (ratio - 1) / error
            failed = failed or abs(z) > LIMIT
            print(f"{name:10s}  {channel}        {ratio:.4f} +- {error:.4f}     {z:5.1f}  {rms:5.2f}  {largest:7.1f}  {100 * noise:.0f} %", flush=True)
    sys.exit(1 if failed and options.version == "even" else 0)


if __name__ == "__main__":
    main()
