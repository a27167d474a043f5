#!/usr/bin/env python3
"""blur_test.py CROWNFIT CAPTURE: photographs blurred and veiled by a stated lens are rendered so, and a fit that is told of the
lens finds the truth, while one that is not says that it explains nothing."""
import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

program, source = sys.argv[1], Path(sys.argv[2])


def run(*arguments, expect=0):
    done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True)
    assert done.returncode == expect, (arguments, done.returncode, done.stderr)
    return done


with tempfile.TemporaryDirectory() as folder:
    capture = Path(folder) / "capture"
    shutil.copytree(source, capture)
    (capture / "calib/blur.json").write_text(
        '{"format": "crownfit-blur/1", "psf": [{"sigma_px": 1.2, "weight": 0.9}, {"sigma_px": 3, "weight": 0.1}], "veiling_glare": 0.02}')
    stated = json.loads((capture / "capture.json").read_text())
    for photo in stated["photographs"]:
        photo["blur"] = "calib/blur.json"
        photo.pop("variance", None)
    (capture / "capture.json").write_text(json.dumps(stated))
    run("render", capture, "--material", capture / "truth.json", "-o", Path(folder) / "seen", "--noise", 0.005, "--seed", 3)
    for photo in stated["photographs"]:
        shutil.copy(Path(folder) / "seen" / f"{photo['name']}.exr", capture / photo["file"])
    told = json.loads(run("fit", capture, "-o", Path(folder) / "told", "--model", "shader", "--max-pixels", 600, "--profiles", 0, "--json").stdout)
    assert told["status"] == "usable" and told["image_error"]["fit"]["reduced_chi2"] < 1.5, told["image_error"]["fit"]
    truth = json.loads((capture / "truth.json").read_text())
    for fitted, true in zip(told["layers"], truth["layers"]):
        for key in ("reduced_scattering_per_mm", "absorption_per_mm"):
            for interval, value in zip(fitted[key]["interval95"], true[key]):
                assert interval[0] <= value <= interval[1], (fitted["name"], key, interval, value)
    for photo in stated["photographs"]:
        photo.pop("blur")
    (capture / "capture.json").write_text(json.dumps(stated))
    untold = json.loads(run("fit", capture, "-o", Path(folder) / "untold", "--model", "shader", "--max-pixels", 600, "--profiles", 0, "--json", expect=1).stdout)
    assert untold["status"] == "not_usable" and untold["image_error"]["fit"]["reduced_chi2"] > 5, untold["image_error"]["fit"]
    print("told of the lens: chi2", told["image_error"]["fit"]["reduced_chi2"], "not told:", untold["image_error"]["fit"]["reduced_chi2"])
