#!/usr/bin/env python3
"""match_test.py CROWNFIT CAPTURE: `crownfit match` leaves the physical values as they are, its block "viewer" looks more like the
walks than they do, and `view` shows it. Exit code 77: no OpenGL here."""
import json
import subprocess
import sys
import tempfile
from pathlib import Path

program, capture = sys.argv[1], Path(sys.argv[2])
truth = capture / "truth.json"


def run(*arguments, expect=0):
    done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True)
    if done.returncode == 2 and ("no EGL display" in done.stderr or "no context of OpenGL" in done.stderr):
        print("NOT RUN:", done.stderr)
        sys.exit(77)
    assert done.returncode == expect, (arguments, done.returncode, done.stderr)
    return done


with tempfile.TemporaryDirectory() as folder:
    folder = Path(folder)
    matched = folder / "matched.json"
    print(run("match", truth, "--capture", capture, "-o", matched, "--pixels", 32, "--paths", 128).stdout)
    before, after = json.loads(truth.read_text()), json.loads(matched.read_text())
    assert after["layers"] == before["layers"] and after["surface"] == before["surface"]
    lights = after["viewer"]["matched"]["lights"]
    assert {light["use"] for light in lights} == {"match", "holdout"}, lights
    total = lambda key: sum(light[key] for light in lights if light["use"] == "match")
    assert total("de00_median") < total("de00_median_physical"), lights
    for name, flags in (("effective.exr", []), ("physical.exr", ["--physical"])):
        run("view", matched, "--capture", capture, "--screenshot", folder / name, *flags)
    run("view", truth, "--capture", capture, "--screenshot", folder / "truth.exr")
    assert (folder / "physical.exr").read_bytes() == (folder / "truth.exr").read_bytes()
    assert (folder / "effective.exr").read_bytes() != (folder / "truth.exr").read_bytes()
    few = folder / "few.json"  # too few paths to find anything: never worse than the physical values
    run("match", truth, "--capture", capture, "-o", few, "--pixels", 16, "--paths", 8)
    lights = json.loads(few.read_text())["viewer"]["matched"]["lights"]
    assert total("de00_median") <= total("de00_median_physical"), lights
    assert "absent.json" in run("match", folder / "absent.json", "--capture", capture, "-o", matched, expect=2).stderr
