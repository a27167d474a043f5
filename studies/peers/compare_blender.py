#!/usr/bin/env python3
"""compare_blender.py CROWNFIT: Blender (bpy) builds and renders what `crownfit export --to blender` wrote, as layers of volumes and as
one medium of subsurface scattering; the picture's light over that of the reference picture beside the export.
Claimed is that the layers' pictures agree where surfaces are smooth and no neck is cut, within 4 standard errors and 2 %; what
the rest is off by is printed, and stands in docs/exchange.md."""
import subprocess
import sys
import tempfile
from pathlib import Path

import mitsuba_scene
import numpy as np
from make_peer_captures import CAPTURES
from table import missing, row

HERE = Path(__file__).resolve().parent
PYTHON = HERE.parent.parent / "build/peers/blender/bin/python"
SEEDS = 3
PATHS = {"layers": 8, "one": 32}  # per seed
ALLOWED = 0.02


def pictures(folder, name, kind, paths):
    """[seed, row, column, channel], or None: Blender is missing."""
    found = []
    for seed in range(SEEDS):
        file = folder / f"{name}_{kind}_{seed}.exr"
        done = subprocess.run([str(PYTHON), str(HERE / "render_blender.py"), str(folder / "crown.py"), name, kind, str(paths), str(seed), str(file)],
                              capture_output=True, text=True)
        if not file.exists():
            missing("Blender", (done.stderr or done.stdout).strip().splitlines()[-1])
            return None
        found.append(next(iter(mitsuba_scene.read_exr(file).values())))
    return np.stack(found)


def main():
    if not PYTHON.exists():
        missing("Blender", f"{PYTHON} is not there")
        return
    with tempfile.TemporaryDirectory() as folder:
        for name, write in CAPTURES.items():
            capture = write(Path(folder) / name)
            exported = capture / "blender"
            subprocess.run([sys.argv[1], "export", str(capture / "truth.json"), "--to", "blender", "--capture", str(capture), "-o", str(exported),
                            "--paths", "400", "--progress", "none"], check=True, capture_output=True)
            for kind in ("layers", "one"):
                for reference in sorted((exported / "reference").glob("*.exr")):
                    shot = reference.stem
                    ours = mitsuba_scene.read_exr(reference)
                    theirs = pictures(exported, shot, kind, PATHS[kind])
                    if theirs is None:
                        return
                    sums = theirs.sum((1, 2))
                    total = ours[""].sum((0, 1))
                    ratio = sums.mean(0) / total
                    error = np.sqrt(sums.var(0, ddof=1) / SEEDS + ours["variance"].sum((0, 1))) / total
                    claimed = kind == "layers" and name not in ("nested_crown", "open_sphere")
                    holds = bool((np.abs(ratio - 1) <= ALLOWED + 4 * error).all()) if claimed else None
                    what = f"{name} {shot}, " + ("layers" if kind == "layers" else "one medium")
                    text = ", ".join(f"{r:.3f}" for r in ratio) if name == "coloured_disc" else f"{ratio[1]:.3f}"
                    row("Blender", what, "path", f"Blender / crownfit {text} +- {error.max():.3f}", holds, "2 % + 4 standard errors" if claimed else "")


if __name__ == "__main__":
    main()
