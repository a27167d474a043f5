#!/usr/bin/env python3
"""view_test.py CROWNFIT CAPTURE: `crownfit view --screenshot` draws what `crownfit render --model shader` predicts, and its
complaints say what to do. Exit code 77: no OpenGL here."""
import json
import subprocess
import sys
import tempfile
from pathlib import Path

program, capture = sys.argv[1], Path(sys.argv[2])
material = capture / "truth.json"


def run(*arguments, expect=0):
    done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True)
    # Only where there is no OpenGL at all: a shader that does not compile is a fault.
    if done.returncode == 2 and ("no EGL display" in done.stderr or "no context of OpenGL" in done.stderr):
        print("NOT RUN:", done.stderr)
        sys.exit(77)
    assert done.returncode == expect, (arguments, done.returncode, done.stderr)
    return done


with tempfile.TemporaryDirectory() as folder:
    folder = Path(folder)
    for name in ("back", "side"):  # nothing but the crown is in these pictures
        run("view", material, "--capture", capture, "--photograph", name, "--screenshot", folder / f"{name}.exr")
        run("render", capture, "--material", material, "--photograph", name, "-o", folder / "rendered")
        found = json.loads(run("compare", folder / f"rendered/{name}.exr", folder / f"{name}.exr", "--json").stdout)
        print(name, found)
        assert found["de00_median"] <= 0.1 and found["de00_p95"] <= 0.5, found
    run("view", material, "--capture", capture, "--screenshot", folder / "large.png", "--size", "300x200")
    assert (folder / "large.png").stat().st_size > 2000
    timed = run("view", material, "--capture", capture, "--size", "64x64", "--benchmark", 2).stdout
    assert "frames/s" in timed, timed
    assert "Known: front" in run("view", material, "--capture", capture, "--photograph", "absent", "--screenshot", folder / "x.png", expect=2).stderr
    assert "1920x1080" in run("view", material, "--capture", capture, "--screenshot", folder / "x.png", "--size", "large", expect=2).stderr
    wet = json.loads(material.read_text())
    wet["surface"]["wetness"] = 0.5
    (folder / "wet.json").write_text(json.dumps(wet))
    run("view", folder / "wet.json", "--capture", capture, "--photograph", "front", "--screenshot", folder / "wet.png")
    assert (folder / "wet.png").stat().st_size > 2000
    # A mesh alone: two layers of the material on one mesh, lit by the default lamps; one layer too many.
    mesh = capture / "mesh/incisor.ply"
    run("view", material, "--mesh", mesh, "--screenshot", folder / "mesh.png", "--size", "200x200")
    assert (folder / "mesh.png").stat().st_size > 2000
    assert "--mesh" in run("view", material, "--mesh", mesh, "--mesh", mesh, "--mesh", mesh, "--screenshot", folder / "x.png", expect=2).stderr
    for wrong in ([], ["--mesh", mesh, "--capture", capture]):
        said = run("view", material, *wrong, "--screenshot", folder / "x.png", expect=2).stderr
        assert "--capture" in said and "--mesh" in said, said
