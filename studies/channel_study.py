#!/usr/bin/env python3
"""What channels cost, and whether many are recovered as well as three.

The bundled disc is made again with other numbers of channels between 400 and 700 nm. One row per number and law of
scattering: the time to render by `path`, relative to three channels, and, with --fit, how far the fitted values are from
the truth.

    ./dev bench channels [-- --channels 1,3,16 --paths 64 --fit]
"""

import argparse
import json
import math
import pathlib
import resource
import shutil
import subprocess

import tables

DISC = pathlib.Path(__file__).resolve().parent.parent / "datasets_synthetic" / "disc"


def wavelengths(channels):
    """Evenly spaced from 680 nm down to 420 nm; three are the bundled disc's."""
    if channels == 1:
        return [540.0]
    if channels == 3:
        return [600.0, 540.0, 450.0]
    return [680.0 - 260.0 * c / (channels - 1) for c in range(channels)]


def absorption(nm):
    """The bundled disc's, interpolated in its logarithm."""
    known = [(450.0, 0.07), (540.0, 0.025), (600.0, 0.012)]
    (a, x), (b, y) = (known[0], known[1]) if nm < 540 else (known[1], known[2])
    return math.exp(math.log(x) + (nm - a) / (b - a) * math.log(y / x))


def scattering(nm, law, channels):
    """`alike`: 3 / mm in every channel. `tenfold`: from 1 / mm in the first channel to 10 / mm in the last."""
    if law == "alike" or channels == 1:
        return 3.0
    first, last = wavelengths(channels)[0], wavelengths(channels)[-1]
    return 10.0 ** ((nm - first) / (last - first))


def write_recipe(folder, channels, law, paths):
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(DISC / "mesh", folder / "mesh")
    (folder / "calib").mkdir()
    shutil.copy(DISC / "calib" / "camera.json", folder / "calib")
    rig = json.loads((DISC / "calib" / "light_rig.json").read_text())
    capture = json.loads((DISC / "capture.json").read_text())
    nm = wavelengths(channels)

    def grey(values):
        return [sum(values) / len(values)] * channels

    for light in rig["lights"]:
        for key in light:
            if key.endswith("_rgb"):
                light[key] = grey(light[key])
    (folder / "calib" / "light_rig.json").write_text(json.dumps(rig, indent=1))
    thing_lists = list(capture["object"]["backings"].values()) + capture["object"].get("scenery", [])
    for thing in thing_lists:
        thing["reflectance_rgb"] = grey(thing["reflectance_rgb"])
    layer = capture["object"]["layers"][0]
    layer["reduced_scattering_per_mm"] = {"fixed": [scattering(w, law, channels) for w in nm]}
    layer["absorption_per_mm"] = {"fixed": [absorption(w) for w in nm]}
    capture["object"]["surface"]["roughness"] = {"fixed": 0.2}
    for photograph in capture["photographs"]:
        photograph.pop("variance")
    capture["format"] = "crownfit-recipe/1"
    capture["channels"] = [{"name": f"{w:.0f} nm", "wavelength_nm": w} for w in nm]
    shared = "channels" if law == "alike" else "none"
    capture["synthesis"] = {
        "paths_per_pixel": paths, "noise": {"relative": 0.01, "floor": 0.0005}, "seed": 11, "initial_factor": 1.5,
        "free": ["ceramic.reduced_scattering_per_mm", "ceramic.absorption_per_mm", "surface.roughness"]}
    (folder / "recipe.json").write_text(json.dumps(capture, indent=1))
    return shared


def run(*command):
    """Seconds of processor time."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([str(c) for c in command], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime


def fit_row(crownfit, folder, shared):
    """Largest errors of scattering and absorption, and how many truths lie in their 95 % intervals."""
    seconds = run(crownfit, "fit", folder / "capture", "-o", folder / "result", "--share",
                  f"ceramic.reduced_scattering_per_mm={shared}")
    truth = json.loads((folder / "capture" / "truth.json").read_text())["layers"][0]
    found = json.loads((folder / "result" / "material.json").read_text())["layers"][0]
    errors, held, count = {}, 0, 0
    for key in ("reduced_scattering_per_mm", "absorption_per_mm"):
        values, intervals = found[key]["value"], found[key]["interval95"]
        if not isinstance(values, list):
            values, intervals = [values], [intervals]
        if not isinstance(intervals[0], list):
            intervals = [intervals]
        rights = truth[key] if isinstance(truth[key], list) else [truth[key]]
        rights = rights[:len(values)]
        errors[key] = max(abs(math.log(v / t)) for v, t in zip(values, rights))
        held += sum(low <= t <= high for (low, high), t in zip(intervals, rights))
        count += len(values)
    return seconds, errors["reduced_scattering_per_mm"], errors["absorption_per_mm"], held, count


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("crownfit", type=pathlib.Path)
    parser.add_argument("-o", "--output", type=pathlib.Path, required=True)
    parser.add_argument("--channels", default="1,3,16")
    parser.add_argument("--paths", type=int, default=64, help="a pixel, of the renderings that are timed")
    parser.add_argument("--made-with", type=int, default=1000, help="paths a pixel of the photographs to fit")
    parser.add_argument("--fit", action="store_true")
    asked = parser.parse_args()
    crownfit = asked.crownfit.resolve()
    of_three, rows = {}, []
    for channels in sorted({3} | {int(n) for n in asked.channels.split(",")}, key=lambda n: (n != 3, n)):
        for law in ("alike", "tenfold") if channels > 1 else ("alike",):
            folder = asked.output / f"{channels}_{law}"
            shared = write_recipe(folder, channels, law, asked.made_with if asked.fit else 2)
            run(crownfit, "synthesize", folder / "recipe.json", "-o", folder / "capture")
            render = [crownfit, "render", folder / "capture", "--material", folder / "capture" / "truth.json", "-o",
                      folder / "rendered", "--model", "path", "--paths"]
            # Samples for each channel's own scattering: as many as three channels have.
            count = asked.paths if law == "alike" else asked.paths * channels // 3
            start = run(*render, 1)
            seconds = run(*render, count) - start
            if channels == 3:
                of_three[law] = seconds
            row = [channels, law, f"{seconds:.1f}", f"{seconds / of_three[law]:.2f}", "-", "-", "-", "-"]
            if asked.fit:
                cost, of_scattering, of_absorption, held, values = fit_row(crownfit, folder, shared)
                row[4:] = [f"{cost:.0f}", f"{100 * of_scattering:.1f} %", f"{100 * of_absorption:.1f} %", f"{held} of {values}"]
            print(*row, sep=" | ", flush=True)
            rows.append(row)
    tables.write(
        "channels", title="Channels", shows="What channels cost, and whether many are recovered as three are: the bundled disc made again.",
        command="./dev bench channels -- --fit" if asked.fit else "./dev bench channels",
        columns=["channels", "scattering", "render by `path`, s", "over three", "fit, s", "scattering off by", "absorption off by",
                 "intervals that hold"], rows=rows,
        notes=[f"Rendered with {asked.paths} paths a pixel; where channels scatter differently, with as many for each channel as three have.",
               "Alike: 3 / mm in every channel. Tenfold: from 1 to 10 / mm. Seconds of processor time."])


if __name__ == "__main__":
    main()
