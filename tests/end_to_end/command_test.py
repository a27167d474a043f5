#!/usr/bin/env python3
"""command_test.py CROWNFIT CAPTURE: the program as a user meets it: help, exit codes, fit, render, compare, same bytes."""
import json
import subprocess
import sys
import tempfile
from pathlib import Path

program, capture = sys.argv[1], Path(sys.argv[2])
faults = []


def run(*arguments, expect=0):
    done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True, timeout=600)
    if done.returncode != expect:
        faults.append(f"crownfit {' '.join(map(str, arguments))}: exit {done.returncode}, expected {expect}: {done.stderr[-300:]}")
    return done


def require(holds, what):
    if not holds:
        faults.append(what)


for command in ("fit", "check", "render", "compare"):
    require(command in run("--help").stdout, f"--help does not mention {command}")
    require("Usage" in run(command, "--help").stdout, f"{command} --help has no usage")
run("--version")
run(expect=2)
run("polish", capture, expect=2)
run("fit", capture, expect=2)  # no output folder
run("fit", capture, "-o", "/tmp/never", "--model", "magic", expect=2)
require("known" in run("fit", capture, "-o", "/tmp/never", "--fix", "enamel.colour=3", expect=2).stderr.lower(), "--fix does not list what is known")
require("valid" in run("check", capture).stdout, "check does not say valid")
require(json.loads(run("check", capture, "--json").stdout)["valid"] is True, "check --json")

with tempfile.TemporaryDirectory() as folder:
    folder = Path(folder)
    summary = run("fit", capture, "-o", folder / "one", "--threads", "1", "--max-pixels", "1500").stdout
    run("fit", capture, "-o", folder / "two", "--threads", "2", "--max-pixels", "1500")
    one, two = (folder / "one/material.json").read_bytes(), (folder / "two/material.json").read_bytes()
    require(one == two, "material.json differs between 1 and 2 threads")
    material, truth = json.loads(one), json.loads((capture / "truth.json").read_text())
    require(material["status"] == "usable" and material["status"] in summary, "the demonstration is not usable")
    held = []
    for layer, true in zip(material["layers"], truth["layers"]):
        for key in ("reduced_scattering_per_mm", "absorption_per_mm"):
            held += [low <= goal <= high for (low, high), goal in zip(layer[key]["interval95"], true[key])]
    require(len(held) == 12 and sum(held) >= 10, f"only {sum(held)} of {len(held)} intervals hold the truth")
    for shot in material["image_error"]["photographs"]:
        require((folder / f"one/figures/{shot}.png").stat().st_size > 2000, f"no figure of {shot}")
    require(not [p for p in folder.rglob("*.part*")], "half-written files are left")
    run("render", capture, "--material", folder / "one/material.json", "-o", folder / "pictures", "--photograph", "back")
    figures = json.loads(run("compare", capture / "photos/back.exr", folder / "pictures/back.exr", "-o", folder / "map.png", "--json").stdout)
    require(figures["de00_median"] < 0.8, f"fitted and photographed differ by {figures['de00_median']}")
    require((folder / "map.png").exists(), "compare wrote no map")
    run("compare", capture / "photos/back.exr", capture / "calib/camera.json", expect=2)

for fault in faults:
    print("FAIL", fault)
print(f"commands: {len(faults)} faults")
sys.exit(1 if faults else 0)
