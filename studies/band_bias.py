#!/usr/bin/env python3
"""band_bias.py CROWNFIT CAPTURE WORK: what three broad bands make of coefficients that change within them.

The disc of CAPTURE with a dental ceramic's smooth spectra (absorption falls tenfold from 400 to 700 nm, scattering as a
power law) is photographed by walks at 33 wavelengths; a camera with bands of 80 nm makes three channels of it, which are
fitted as if each were one wavelength. Prints how far the fitted values are from the means of the coefficients over the bands.
The walks of all wavelengths are independent; their noise, and 0.5 % of a sensor, are in the photographs' variance. 15 min.
"""
import json
import math
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import OpenImageIO as oiio

import tables

WAVELENGTHS = np.arange(400.0, 730.0, 10.0)
CENTRES, WIDTH = [600.0, 540.0, 450.0], 80.0  # nm; full width at half maximum
PATHS, NOISE, FLOOR = 250, 0.005, 0.0005


def scattering(wavelength):
    return 3.0 * (wavelength / 540.0) ** -1.2


def absorption(wavelength):
    return 0.04 * math.exp(-math.log(10) * (wavelength - 540.0) / 300.0)


def weights():
    """[channel, wavelength], each channel's sum 1."""
    w = np.exp(-4 * math.log(2) * ((WAVELENGTHS[None] - np.array(CENTRES)[:, None]) / WIDTH) ** 2)
    return w / w.sum(1, keepdims=True)


def read(path):
    """Picture and variance layer of a synthetic photograph."""
    return np.asarray(oiio.ImageBuf(str(path)).get_pixels(oiio.FLOAT), dtype=float)[..., :3]


def write(path, picture):
    buffer = oiio.ImageBuf(oiio.ImageSpec(picture.shape[1], picture.shape[0], 3, oiio.FLOAT))
    buffer.set_pixels(oiio.ROI.All, picture.astype(np.float32))
    buffer.write(str(path))


def recipe_of(capture, three):
    """The capture's scene with the spectra at three wavelengths."""
    stated = json.loads((capture / "capture.json").read_text())
    layer = stated["object"]["layers"][0]
    layer["reduced_scattering_per_mm"] = {"fixed": [scattering(w) for w in three]}
    layer["absorption_per_mm"] = {"fixed": [absorption(w) for w in three]}
    for key, value in list(stated["object"]["surface"].items()):
        stated["object"]["surface"][key] = {"fixed": value["initial"] if "initial" in value else value["fixed"]} if isinstance(value, dict) else {"fixed": value}
    stated["channels"] = [{"name": n, "wavelength_nm": w} for n, w in zip("RGB", three)]
    stated["format"] = "crownfit-recipe/1"
    stated["synthesis"] = {"paths_per_pixel": PATHS, "noise": {"relative": 0.0, "floor": 1e-6}, "seed": int(three[0]), "initial_factor": 1.5,
                           "free": [f"{layer['name']}.reduced_scattering_per_mm", f"{layer['name']}.absorption_per_mm"]}
    return stated


def main():
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    program, source, work = sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3])
    shutil.copytree(source, work / "scene", dirs_exist_ok=True)
    names, pictures, variances = None, {}, {}
    for begin in range(0, len(WAVELENGTHS), 3):
        three = WAVELENGTHS[begin:begin + 3].tolist()
        folder = work / f"at_{three[0]:.0f}"
        if not (folder / "truth.json").exists():
            (work / "scene/recipe.json").write_text(json.dumps(recipe_of(source, three)))
            subprocess.run([program, "synthesize", str(work / "scene/recipe.json"), "-o", str(folder), "--progress", "none"], check=True, stdout=subprocess.DEVNULL)
        made = json.loads((folder / "capture.json").read_text())
        for p in made["photographs"]:
            pictures.setdefault(p["name"], []).append(read(folder / p["file"]))
            variances.setdefault(p["name"], []).append(read(folder / p["variance"]))
    capture = work / "capture"
    shutil.copytree(folder, capture, dirs_exist_ok=True)
    made["channels"] = [{"name": n, "wavelength_nm": w} for n, w in zip("RGB", CENTRES)]
    layer = made["object"]["layers"][0]
    layer["reduced_scattering_per_mm"] = {"initial": [1.5 * scattering(w) for w in CENTRES]}
    layer["absorption_per_mm"] = {"initial": [absorption(w) / 1.5 for w in CENTRES]}
    (capture / "capture.json").write_text(json.dumps(made))
    w, generator = weights(), np.random.default_rng(3)
    for p in made["photographs"]:
        seen = np.concatenate(pictures[p["name"]], axis=-1) @ w.T
        variance = np.concatenate(variances[p["name"]], axis=-1) @ (w**2).T + (NOISE * seen) ** 2 + FLOOR**2
        write(capture / p["file"], seen + np.sqrt((NOISE * seen) ** 2 + FLOOR**2) * generator.standard_normal(seen.shape))
        write(capture / p["variance"], variance)
    subprocess.run([program, "fit", str(capture), "-o", str(work / "result"), "--model", "path", "--progress", "none"], stdout=subprocess.DEVNULL)
    fitted = json.loads((work / "result/material.json").read_text())
    print(f"{fitted['status']}, chi2 of patches {fitted['identifiability']['block_chi2']:.2f}")
    rows = []
    for key, spectrum in (("reduced_scattering_per_mm", scattering), ("absorption_per_mm", absorption)):
        found = fitted["layers"][0][key]
        means = w @ np.array([spectrum(v) for v in WAVELENGTHS])
        rows.append([key, *(f"{100 * (found['value'][c] / means[c] - 1):+.1f} %" for c in range(3))])
        for c in range(3):
            print(f"{key}[{'RGB'[c]}]: mean over the band {means[c]:.4f}, at its centre {spectrum(CENTRES[c]):.4f}, fitted {found['value'][c]:.4f} "
                  f"+- {found['stddev'][c]:.4f}: {100 * (found['value'][c] / means[c] - 1):+.1f} % of the mean")
    tables.write(
        "bands", title="Three broad bands", command="./dev bench bands",
        shows="Error that a fit makes by taking each broad camera channel for one wavelength, against the coefficients' means over the bands.",
        columns=["coefficient", *(f"{n}, {centre:.0f} nm" for n, centre in zip("RGB", CENTRES))], rows=rows,
        notes=["A ceramic disc of 1 mm with smooth spectra is path-traced at 33 wavelengths and seen through bands 80 nm wide.",
               f"The fit is `{fitted['status']}`, with a patch chi-squared of {fitted['identifiability']['block_chi2']:.2f}."])


if __name__ == "__main__":
    main()
