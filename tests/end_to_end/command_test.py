#!/usr/bin/env python3
"""command_test.py CROWNFIT CAPTURE: the program as a user meets it: help, exit codes, fit, render, compare, same bytes."""
import json
import re
import shutil
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


for command in ("fit", "report", "check", "render", "compare", "slab", "synthesize"):
    require(command in run("--help").stdout, f"--help does not mention {command}")
    require("Usage" in run(command, "--help").stdout, f"{command} --help has no usage")
run("--version")
run(expect=2)
run("polish", capture, expect=2)
run("fit", capture, expect=2)  # no output folder
run("fit", capture, "-o", "/tmp/never", "--model", "magic", expect=2)
require("known" in run("fit", capture, "-o", "/tmp/never", "--fix", "enamel.colour=3", expect=2).stderr.lower(), "--fix does not list what is known")
with tempfile.TemporaryDirectory() as folder:
    require("valid" in run("check", capture, "-o", Path(folder) / "slices.png").stdout, "check does not say valid")
    require((Path(folder) / "slices.png").stat().st_size > 2000, "check draws no slices")

with tempfile.TemporaryDirectory() as folder:
    folder = Path(folder)
    # The model is chosen for what the fit is for, by stored costs, so that two threads choose and find what one does.
    plan = ("--target-de00", "20", "--budget-s", 500, "--max-pixels", "500", "--profiles", "0")
    planned = run("fit", capture, "-o", folder / "one", "--threads", "1", *plan)
    run("fit", capture, "-o", folder / "two", "--threads", "2", *plan)
    one, two = (folder / "one/material.json").read_bytes(), (folder / "two/material.json").read_bytes()
    require(one == two, "material.json differs between 1 and 2 threads")
    require((folder / "one/report.json").read_bytes() == (folder / "two/report.json").read_bytes(), "report.json differs between 1 and 2 threads")
    material, truth = json.loads(one), json.loads((capture / "truth.json").read_text())
    require(material["status"] == "usable" and material["status"] in planned.stdout, "the demonstration is not usable")
    require(material["model"] == "shader" and material["provenance"]["model_choice"] in planned.stderr, f"a coarse target is not met by shader: {planned.stderr}")
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
    run("fit", capture, "-o", folder / "never", "--budget-s", 100, "--model", "path", expect=2)
    for words in (("fit", capture, "-o", folder / "never", "--budget-s", "nan"), ("fit", capture, "-o", folder / "never", "--target-de00", "inf"),
                  ("render", capture, "-o", folder / "never", "--noise", "nan"), ("predict", capture / "truth.json", "--aperture", "nan")):
        said = run(*words, expect=2).stderr
        require(words[-2] in said, f"{words[-2:]} is no number: {said}")
    said = run("fit", capture, "-o", folder / "never", "--fix", "surface.roughness=0.2", "--fix", "surface.roughness=0.3", expect=2).stderr
    require("surface.roughness" in said and "twice" in said, f"one parameter fixed twice: {said}")
    run("fit", capture, capture, "-o", folder / "never", "--budget-s", 100, expect=2)

with tempfile.TemporaryDirectory() as folder:
    folder = Path(folder)
    # A flat sample by both models, and what they refuse.
    slab = {"format": "crownfit-slab/1", "layers": [{"ior": 1.54, "g": 0.8, "scattering_per_mm": 10, "absorption_per_mm": 0.1, "thickness_mm": 1}]}
    (folder / "slab.json").write_text(json.dumps(slab))
    layered = json.loads(run("slab", folder / "slab.json").stdout)
    walked = json.loads(run("slab", folder / "slab.json", "--model", "path", "--photons", "20000").stdout)
    difference = walked["reflectance_collimated"] - layered["reflectance_collimated"]
    require(abs(difference) < 4 * walked["stddev"]["reflectance_collimated"], f"walks and adding-doubling differ by {difference}")
    (folder / "slab.json").write_text(json.dumps(dict(slab, layer=1)))
    require("layer" in run("slab", folder / "slab.json", expect=2).stderr, "an unknown key of slab.json is not named")

    # What a technician asks of a material, and the lab's own tabs.
    truth = capture / "truth.json"
    predicted = json.loads(run("predict", truth, "--thickness", "enamel=0.5,dentine=1.5", "--stump", "60,2,18", "-o", folder / "swatches.png", "--json").stdout)
    groups = {g["name"]: g["figures"] for g in predicted["groups"]}
    require(predicted["groups"][0]["thickness_mm"] == {"enamel": 0.5, "dentine": 1.5}, "predict does not take thicknesses by layer")
    require(groups["at_0.50_mm"]["tp00"]["value"] > groups["at_2.00_mm"]["tp00"]["value"] > 0, "thicker is not less translucent")
    require((folder / "swatches.png").stat().st_size > 2000, "predict draws no swatches")
    for thickness, *other, word in (("pulp=1", "enamel"), ("dentine=1", "enamel"), ("enamel=0.5,dentine=1", "--stump", "teal", "L,a,b"), ("enamel=0.5,dentine=1", "--geometry", "60/0", "45/0")):
        require(word in run("predict", truth, "--thickness", thickness, *other, expect=2).stderr, f"predict {thickness} {other}: no remedy")
    (folder / "tabs.csv").write_text("name,L,a,b,stddev\nlight,80,-1,13,0.3\nmiddle,76,0,16.7,0.3\nmiddle2,75.8,0.1,16.9,0.3\n")
    run("shades", "measured", folder / "tabs.csv", "-o", folder / "tabs.json")
    near = json.loads(run("shades", "nearest", "76,0,16.8", "--tabs", folder / "tabs.json", "--json").stdout)
    require(near["nearest"][0]["name"] == "middle" and not near["can_tell_first_from_second"], "tabs 0.2 apart are told apart")
    far = json.loads(run("shades", "nearest", "80,-1,13", "--tabs", folder / "tabs.json", "--json").stdout)
    require(far["nearest"][0]["name"] == "light" and far["can_tell_first_from_second"], "tabs far apart are not told apart")
    for header, row in (("name,L,C,h", "A1,75,16,86"), ("A1,,1,16", "A2,75,1,16")):
        (folder / "other.csv").write_text(f"{header}\n{row}\n")
        require("L*, a*, b*" in run("shades", "measured", folder / "other.csv", "-o", folder / "never.json", expect=2).stderr, f"a table of {header} is taken for L*, a*, b*")
    (folder / "other.csv").write_text("name,b*,L*,a*\nA1,16,75,1\n")
    run("shades", "measured", folder / "other.csv", "-o", folder / "other.json")
    require(json.loads((folder / "other.json").read_text())["tabs"][0]["lab"] == [75, 1, 16], "a table of b*, L*, a* is taken for L*, a*, b*")
    require("no colour" in run("shades", "nearest", "759,0,16.8", "--tabs", folder / "tabs.json", expect=2).stderr, "L* of 759 has a nearest tab")
    (folder / "black.ppm").write_bytes(b"P6\n64 32\n255\n" + bytes(64 * 32 * 3))
    dark = run("shades", "photographed", folder / "black.ppm", "--tab", "A=32,0,16,16", "--card", "0,0,16,16", "-o", folder / "never.json", expect=2)
    require("--card" in dark.stderr and not (folder / "never.json").exists(), "a black card is taken for grey")
    patch = run("shades", "photographed", capture / "photos/front.exr", "--tab", "A=0,0,100000,20", "-o", folder / "p.json", expect=2)
    require("--tab" in patch.stderr, "a patch outside the picture is not named")
    # Tabs from a photograph: by a card of the tab's own patch as grey a tab has the card's lightness and no colour.
    run("shades", "photographed", capture / "photos/front.exr", "--tab", "A=40,40,16,16", "--tab", "B=40,20,16,16", "--card", "40,40,16,16", "--card-reflectance", "0.184187", "-o", folder / "p.json")
    tabs = {tab["name"]: tab for tab in json.loads((folder / "p.json").read_text())["tabs"]}
    require(all(abs(a - b) < 0.01 for a, b in zip(tabs["A"]["lab"], (50, 0, 0))), f"a card of L* 50 is {tabs['A']['lab']}")
    require(min(tabs["A"]["stddev"]) > 0 and tabs["B"]["lab"] != tabs["A"]["lab"], "photographed tabs do not scatter, or are one")
    near = json.loads(run("shades", "nearest", truth, "--tabs", folder / "p.json", "--thickness", "enamel=0.5,dentine=1.5", "--json").stdout)
    require({n["name"] for n in near["nearest"]} == {"A", "B"} and near["nearest"][0]["de00"] <= near["nearest"][1]["de00"], f"tabs nearest to a material: {near}")

    # A recipe made from the bundled capture: what is synthesised can be checked, read, and is the same for any number of threads.
    recipe = json.loads((capture / "capture.json").read_text())
    recipe["format"] = "crownfit-recipe/1"
    for owner in recipe["object"]["layers"] + [recipe["object"]["surface"]]:
        for key, value in owner.items():
            if isinstance(value, dict) and "initial" in value:
                owner[key] = {"fixed": value["initial"]}
    recipe["synthesis"] = {"paths_per_pixel": 4, "seed": 3, "initial_factor": 2, "free": ["dentine.absorption_per_mm"], "calibration_error": {"exposure": 0.01, "pose_deg": 0.1, "pose_mm": 0.1, "light_mm": 1}}
    recipe["photographs"] = recipe["photographs"][:2]
    recipe["photographs"][1]["exposure_scale"] = {"fixed": 4}
    source = folder / "source"
    shutil.copytree(capture, source)
    (source / "recipe.json").write_text(json.dumps(recipe))
    run("synthesize", source / "recipe.json", "-o", folder / "one", "--threads", "1")
    run("synthesize", source / "recipe.json", "-o", folder / "two", "--threads", "2")
    name = recipe["photographs"][0]["name"]
    same = json.loads(run("compare", folder / f"one/photos/{name}.exr", folder / f"two/photos/{name}.exr", "--json").stdout)
    require(same["de00_p95_pixel"] == 0, "a synthetic photograph depends on the number of threads")
    made = json.loads((folder / "one/capture.json").read_text())
    require([p["exposure_scale"]["stddev"] for p in made["photographs"]] == [0.01, 0.04], "a share of the exposure is not stated in its own unit")
    start, truth = made["object"]["layers"][1]["absorption_per_mm"]["initial"], json.loads((folder / "one/truth.json").read_text())["layers"][1]["absorption_per_mm"]
    require(all(abs(a / b - 2) < 1e-6 for a, b in zip(start, truth)), "the free parameter does not start off by the factor")
    made["photographs"][0]["exposure_scale"] = {"initial": 1, "stddev": 0.02}  # known within an error: not free
    (folder / "one/capture.json").write_text(json.dumps(made))
    checked = json.loads(run("check", folder / "one", "--json").stdout)
    require("exposure free" not in run("check", folder / "one").stdout, "an exposure with a stated error is called free")
    require(checked["valid"] is True and checked["free"] == [f"dentine.absorption_per_mm[{c}]" for c in "RGB"], "not what was asked is free")

    def refused():
        """What an impossible budget is refused with, and the seconds that it plans with few walks."""
        said = run("fit", folder / "one", "-o", folder / "never", "--budget-s", 0.01, "--max-pixels", "500", expect=2).stderr
        planned = re.search(r" 50000 walks per photograph: CIEDE2000 \S+, (\d+) s", said)
        require("--budget-s" in said and planned, f"a budget that nothing keeps: {said}")
        return float(planned[1]) if planned else 0

    known = refused()
    made["object"]["layers"][0]["thickness_mm"] = {"initial": 0.6}  # its derivatives take two pictures more each time
    (folder / "one/capture.json").write_text(json.dumps(made))
    require(refused() > 1.3 * known > 0, "a free thickness is planned to cost no more")
    recipe["synthesis"]["free"] = ["dentine.colour"]
    (source / "recipe.json").write_text(json.dumps(recipe))
    require("dentine.colour" in run("synthesize", source / "recipe.json", "-o", folder / "three", expect=2).stderr, "an unknown parameter is not named")
    run("render", folder / "one", "--derivatives", "--photograph", name, "-o", folder / "pictures", expect=2)  # not by the shader
    run("render", folder / "one", "--model", "path", "--paths", "16", "--scale", "0.5", "--derivatives", "--photograph", name, "-o", folder / "pictures")
    derivatives = (folder / f"pictures/{name}_derivatives.exr").read_bytes()[:4000]
    for layer in (b".absorption_per_mm.R", b".reduced_scattering_per_mm.stddev.B", b".g.G", b".ior.R", b"surface.roughness.G"):
        require(layer in derivatives, f"render --derivatives wrote no layer {layer}")
    require((folder / f"pictures/{name}.png").exists(), "render --model path wrote no picture")

for fault in faults:
    print("FAIL", fault)
print(f"commands: {len(faults)} faults")
sys.exit(1 if faults else 0)
