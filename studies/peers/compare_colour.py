#!/usr/bin/env python3
"""compare_colour.py CROWNFIT: CIEDE2000 of `crownfit compare` against colour-science, for pairs of even pictures, and the
ColorChecker's values in calib/ against colour-science's tables."""
import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import colour
import mitsuba as mi
import numpy as np
from table import row

mi.set_variant("scalar_rgb")
ROOT = Path(__file__).resolve().parent.parent.parent


def lab(rgb):
    """CIELAB of linear sRGB with white (1, 1, 1), 2 degree observer, D65."""
    matrix = colour.RGB_COLOURSPACES["sRGB"].matrix_RGB_to_XYZ
    white = colour.XYZ_to_xy(matrix @ np.ones(3))
    return colour.XYZ_to_Lab(matrix @ rgb, white)


def compare(program, a, b, folder):
    for name, rgb in (("a", a), ("b", b)):
        mi.Bitmap(np.broadcast_to(np.float32(rgb), (16, 16, 3)).copy()).write(str(folder / f"{name}.exr"))
    done = subprocess.run([program, "compare", str(folder / "a.exr"), str(folder / "b.exr"), "--json"], capture_output=True, text=True, check=True)
    return json.loads(done.stdout)["de00_mean"]


def main():
    random = np.random.default_rng(5)
    luminance = colour.RGB_COLOURSPACES["sRGB"].matrix_RGB_to_XYZ[1]
    worst, pairs = 0.0, 40
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(pairs):
            a = random.uniform(0.05, 1.0, 3)
            b = a * random.uniform(0.8, 1.25, 3)
            scale = 0.6 / (luminance @ a)  # one common scale brings the photograph's luminance to 0.6
            expected = colour.delta_E(lab(scale * a), lab(scale * b), method="CIE 2000")
            worst = max(worst, abs(compare(sys.argv[1], a, b, Path(folder)) - expected))
    row("colour-science", f"CIEDE2000 of {pairs} pairs of colours", "compare", f"largest difference {worst:.1e}", worst < 2e-3, "2e-3: its sRGB matrix has 4 digits")
    for name, table in (("colorchecker_classic_2014", "ColorChecker24 - After November 2014"),
                        ("colorchecker_classic_before_2014", "ColorChecker24 - Before November 2014")):
        text = re.sub(r"//[^\n]*", "", (ROOT / f"calib/{name}.json").read_text())
        chart = [np.array(p["lab"]) for p in json.loads(text)["patches"]]
        theirs = colour.CCS_COLOURCHECKERS[table]
        white = theirs.illuminant
        values = [colour.XYZ_to_Lab(colour.xyY_to_XYZ(v), white) for v in theirs.data.values()]
        off = max(float(np.abs(a - b).max()) for a, b in zip(chart, values, strict=True))
        row("colour-science", f"{name}, {len(chart)} patches, Lab", "calib/", f"largest difference {off:.3f}", off < 0.02, "0.02: tables of two decimals")


if __name__ == "__main__":
    main()
