#!/usr/bin/env python3
"""export_test.py CROWNFIT CAPTURE: every format of `crownfit export`, read back with standard parsers: the quantities are the
material's, files that are named exist, what can't be exported is refused."""
import ast
import csv
import json
import math
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ET
from pathlib import Path

program, capture = sys.argv[1], Path(sys.argv[2])
truth = json.loads((capture / "truth.json").read_text())
shots = [p["name"] for p in json.loads((capture / "capture.json").read_text())["photographs"]]
faults = []


def require(holds, what):
    if not holds:
        faults.append(what)


def near(a, b):
    return all(math.isclose(x, y, rel_tol=1e-9, abs_tol=1e-12) for x, y in zip(a, b, strict=True))


def run(*arguments, expect=0):
    done = subprocess.run([program, "export", *map(str, arguments)], capture_output=True, text=True, timeout=300)
    require(done.returncode == expect, f"export {' '.join(map(str, arguments))}: exit {done.returncode}, expected {expect}: {done.stderr[-300:]}")
    return done.stderr


def scattering(layer):
    return [s / (1 - layer["g"]) for s in layer["reduced_scattering_per_mm"]]


def numbers(text):
    return [float(x) for x in re.split(r"[,\s]+", text.strip())]


def check_mitsuba(folder):
    media = {m.get("id"): m for m in ET.parse(folder / "material.xml").getroot().iter("medium")}
    for layer in truth["layers"]:
        m = media["medium_" + layer["name"]]
        values = {child.get("name"): child.get("value") for child in m}
        extinction = [float(values["scale"]) * x for x in numbers(values["sigma_t"])]
        require(near(extinction, [s + a for s, a in zip(scattering(layer), layer["absorption_per_mm"])]), "Mitsuba: extinction")
        require(near([a * x for a, x in zip(numbers(values["albedo"]), extinction)], scattering(layer)), "Mitsuba: albedo")
        require(float(m.find("phase/float").get("value")) == layer["g"], "Mitsuba: g")
        require(all(x <= 1 for x in numbers(values["sigma_t"])), "Mitsuba: an rgb value above 1")
    bsdf = ET.parse(folder / "material.xml").getroot().findall("bsdf")
    indices = [[float(b.find(f"float[@name='{side}']").get("value")) for side in ("int_ior", "ext_ior")] for b in bsdf]
    ior = [layer["ior"] for layer in truth["layers"]]
    require(indices == [[n, before] for n, before in zip(ior, [1.0, *ior])], "Mitsuba: indices on the two sides")
    for shot in shots:
        scene = ET.parse(folder / f"{shot}.xml").getroot()
        files = [s.get("value") for s in scene.iter("string") if s.get("name") == "filename"]
        require(files and all((folder / f).exists() for f in files), f"Mitsuba: {shot} names a mesh that is not there")
        ids = {e.get("id") for e in ET.parse(folder / "material.xml").getroot()}
        require(all(r.get("id") in ids for r in scene.iter("ref")), f"Mitsuba: {shot} refers to nothing")


def imported_again(folder):
    """`crownfit capture import` makes a capture of the exported scenes, with the material they were exported with."""
    done = subprocess.run([program, "capture", "import", folder / "mitsuba", "-o", folder / "again", "--photographs", capture / "photos"], capture_output=True, text=True, timeout=300)
    require(done.returncode == 0 and "capture.json: valid" in done.stdout, f"Mitsuba: import: {done.stderr[-300:]}")
    if done.returncode:
        return
    again = json.loads((folder / "again/capture.json").read_text())
    require(sorted(p["name"] for p in again["photographs"]) == sorted(shots), "Mitsuba: import: photographs")
    for layer, wanted in zip(again["object"]["layers"], truth["layers"], strict=True):
        require(layer["name"] == wanted["name"] and layer["g"]["fixed"] == wanted["g"], f"Mitsuba: import: {layer['name']}")
        for key in ("reduced_scattering_per_mm", "absorption_per_mm"):
            require(near(layer[key]["initial"], wanted[key]), f"Mitsuba: import: {key} of {layer['name']}")


def check_pbrt(folder):
    text = (folder / "material.pbrt").read_text()
    for layer in truth["layers"]:
        line = next(x for x in text.splitlines() if x.startswith(f'MakeNamedMedium "medium_{layer["name"]}"'))
        values = {name: numbers(v) for name, v in re.findall(r'"rgb (\w+)" \[([^\]]*)\]', line)}
        require(near(values["sigma_s"], scattering(layer)) and near(values["sigma_a"], layer["absorption_per_mm"]), "pbrt: coefficients")
        require(float(re.search(r'"float g" (\S+)', line).group(1)) == layer["g"], "pbrt: g")
    etas = [float(x) for x in re.findall(r'"float eta" (\S+)', text)]
    ior = [layer["ior"] for layer in truth["layers"]]
    require(near(etas, [n / before for n, before in zip(ior, [1.0, *ior])]), f"pbrt: indices {etas}")
    roughness = [float(x) for x in re.findall(r'"float roughness" (\S+)', text)]
    require(roughness[0] == truth["surface"]["roughness"] and not any(roughness[1:]) and "false" in re.findall(r'"bool remaproughness" (\S+)', text)[0],
            f"pbrt: roughness {roughness}")
    for shot in shots:
        scene = (folder / f"{shot}.pbrt").read_text()
        require(scene.count("AttributeBegin") == scene.count("AttributeEnd") > 0, f"pbrt: blocks of {shot}")
        files = re.findall(r'"string filename" "([^"]*\.ply)"', scene)
        require(files and all((folder / f).exists() for f in files), f"pbrt: {shot} names a mesh that is not there")


def check_gltf(folder):
    data = (folder / "crown.glb").read_bytes()
    magic, version, length = struct.unpack_from("<4sII", data)
    require((magic, version, length) == (b"glTF", 2, len(data)), "glTF: header")
    size, kind = struct.unpack_from("<I4s", data, 12)
    require(kind == b"JSON" and size % 4 == 0, "glTF: JSON chunk")
    root = json.loads(data[20:20 + size])
    bin_size, bin_kind = struct.unpack_from("<I4s", data, 20 + size)
    require(bin_kind == b"BIN\0" and 28 + size + bin_size == len(data) and bin_size >= root["buffers"][0]["byteLength"], "glTF: BIN chunk")
    position = root["accessors"][0]
    corners = [struct.unpack_from("<3f", data, 28 + size + 12 * i) for i in range(position["count"])]
    require([min(c[k] for c in corners) for k in range(3)] == position["min"], "glTF: lowest corner")
    extent = max(b - a for a, b in zip(position["min"], position["max"]))
    require(0.002 < extent < 0.02, f"glTF: a crown of {extent} m")
    material = root["materials"][0]
    require(set(material["extensions"]) == set(root["extensionsUsed"]), "glTF: extensions")
    require(material["extensions"]["KHR_materials_ior"]["ior"] == truth["layers"][0]["ior"], "glTF: index")
    pbr = material["pbrMetallicRoughness"]
    require(math.isclose(pbr["roughnessFactor"] ** 2, truth["surface"]["roughness"]), "glTF: roughness is the root of alpha")
    require(all(0 <= x <= 1 for x in pbr["baseColorFactor"]) and pbr["baseColorFactor"][0] > pbr["baseColorFactor"][2], "glTF: colour")
    require([n["name"] for n in root["nodes"][1:]] == shots, "glTF: cameras")


def check_materialx(folder):
    root = ET.parse(folder / "material.mtlx").getroot()
    shaders = {s.get("name"): {i.get("name"): i.get("value") for i in s} for s in root.findall("open_pbr_surface")}
    require(root.get("colorspace") is None, "MaterialX: bands of a camera are no primaries")
    require(all(s["geometry_thin_walled"] == "false" for s in shaders.values()), "MaterialX: a crown is solid")
    require(len(root.findall("surfacematerial")) == len(shaders) == 1 + len(truth["layers"]), "MaterialX: materials")
    for layer in truth["layers"]:
        s = shaders["shader_layer_" + layer["name"]]
        path = [float(s["subsurface_radius"]) * x for x in numbers(s["subsurface_radius_scale"])]
        require(near(path, [1 / (x + a) for x, a in zip(scattering(layer), layer["absorption_per_mm"])]), "MaterialX: mean free path")
        require(float(s["subsurface_scatter_anisotropy"]) == layer["g"], "MaterialX: g")
        root_of = [math.sqrt(a / (a + r)) for r, a in zip(layer["reduced_scattering_per_mm"], layer["absorption_per_mm"])]
        require(near(numbers(s["subsurface_color"]), [(1 - x) * (1 - 0.139 * x) / (1 + 1.17 * x) for x in root_of]), "MaterialX: colour")
        require(math.isclose(float(s["specular_roughness"]) ** 2, truth["surface"]["roughness"] if layer is truth["layers"][0] else 0, abs_tol=1e-12)
                or layer is not truth["layers"][0], "MaterialX: roughness is the root of alpha")


def check_csv(folder):
    rows = list(csv.DictReader((folder / "material.csv").open()))
    for layer in truth["layers"]:
        for key in ("reduced_scattering_per_mm", "absorption_per_mm"):
            values = [float(r["value"]) for r in rows if r["layer"] == layer["name"] and r["quantity"] == key]
            require(values == layer[key], f"CSV: {key}")


def check_blender(folder):
    tree = ast.parse((folder / "crown.py").read_text())
    scene = ast.literal_eval(next(n.value for n in tree.body if isinstance(n, ast.Assign) and n.targets[0].id == "SCENE"))
    for layer, out in zip(truth["layers"], scene["layers"], strict=True):
        require(near(out["scattering_per_mm"], scattering(layer)) and out["absorption_per_mm"] == layer["absorption_per_mm"], "Blender: coefficients")
        require((folder / out["mesh"]).exists(), "Blender: mesh")
    require([p["name"] for p in scene["photographs"]] == shots, "Blender: photographs")


def intervals(folder):
    """What a fit says of its values stands beside them; what it does not say is empty."""
    fitted = {"format": "crownfit-material/1", "status": "not_usable", "reasons": ["chi2 9"], "layers": [
        {"name": "a,b", "absorption_per_mm": {"value": [0.1, 0.2, 0.3], "stddev": [0.01, 0.02, None], "interval95": [[0.08, 0.12], [0.16, None], [0.2, 0.4]],
                                              "status": "fitted"}}, {"name": "clear", "reduced_scattering_per_mm": 0, "absorption_per_mm": 0}]}
    (folder / "fitted.json").write_text(json.dumps(fitted))
    for name in checks:
        said = run(folder / "fitted.json", "--to", name, "-o", folder / "fitted" / name)
        notes = (folder / "fitted" / name / "README.md").read_text()
        require("chi2 9" in said and "chi2 9" in notes, f"{name}: a material not to be used, without a word")
        require("Reference pictures" not in notes, f"{name}: pictures of no capture")
    rows = list(csv.DictReader((folder / "fitted/csv/material.csv").open()))
    got = [[r[k] for k in ("value", "stddev", "low95", "high95", "status")] for r in rows if r["layer"] == "a,b" and r["quantity"] == "absorption_per_mm"]
    require([g[0] for g in got] == ["0.1", "0.2", "0.3"] and got[0][1:] == ["0.01", "0.08", "0.12", "fitted"] and got[2][1] == "", f"CSV: intervals: {got}")
    require(not any(v in ("inf", "nan", "-nan") for r in rows for v in r.values()), "CSV: a number that is none")
    ast.literal_eval(next(n.value for n in ast.parse((folder / "fitted/blender/crown.py").read_text()).body if isinstance(n, ast.Assign)))


def gltf_of_flat_layers(folder):
    """What the formulas of docs/exchange.md make of R and T of the layers, by `crownfit slab`."""
    layers = [{**layer, "thickness_mm": mm} for layer, mm in zip(truth["layers"], (0.6, 1.1, 0.8))]
    (folder / "flat.json").write_text(json.dumps({**truth, "layers": layers}))
    run(folder / "flat.json", "--to", "gltf", "-o", folder / "flat")
    data = (folder / "flat/crown.glb").read_bytes()
    material = json.loads(data[20:20 + struct.unpack_from("<I", data, 12)[0]])["materials"][0]
    through, volume = (material["extensions"]["KHR_materials_" + name] for name in ("diffuse_transmission", "volume"))
    reflected, passed, clear = [], [], []
    for c in range(3):
        for sign in (1, 0):
            (folder / "slab.json").write_text(json.dumps({"format": "crownfit-slab/1", "layers": [
                {"thickness_mm": l["thickness_mm"], "ior": l["ior"], "g": l["g"], "scattering_per_mm": scattering(l)[c], "absorption_per_mm": sign * l["absorption_per_mm"][c]}
                for l in layers]}))
            answer = json.loads(subprocess.run([program, "slab", str(folder / "slab.json")], capture_output=True, text=True, check=True).stdout)
            if sign:
                reflected.append(answer["reflectance_collimated"])
            (passed if sign else clear).append(answer["transmittance_collimated"])
    entered = 1 - ((layers[0]["ior"] - 1) / (layers[0]["ior"] + 1)) ** 2
    share = max(clear) / (max(clear) + max(reflected))
    for what, got, want in (("share", [through["diffuseTransmissionFactor"]], [share]),
                            ("colour", material["pbrMetallicRoughness"]["baseColorFactor"][:3], [min(1, r / (entered * (1 - share))) for r in reflected]),
                            ("transmitted colour", through["diffuseTransmissionColorFactor"], [min(1, t / (entered * share)) for t in clear]),
                            ("attenuation", volume["attenuationColor"], [t / t0 for t, t0 in zip(passed, clear)]),
                            ("distance", [1000 * volume["attenuationDistance"]], [sum(l["thickness_mm"] for l in layers)])):
        require(all(math.isclose(x, y, rel_tol=1e-6) for x, y in zip(got, want, strict=True)), f"glTF: {what} {got}, {want} by slab")


def gltf_of_a_light_ceramic(folder):
    """What a flat sample sends back in one channel has nothing to do with the others, though all share one factor."""
    def sent_back(name, scattering):
        ceramic = {"name": "ceramic", "thickness_mm": 1, "ior": 1.54, "g": 0.8, "reduced_scattering_per_mm": scattering, "absorption_per_mm": 0.005}
        (folder / f"{name}.json").write_text(json.dumps({"format": "crownfit-material/1", "layers": [ceramic], "surface": {"roughness": 0.1}}))
        run(folder / f"{name}.json", "--to", "gltf", "-o", folder / name)
        data = (folder / name / "crown.glb").read_bytes()
        material = json.loads(data[20:20 + struct.unpack_from("<I", data, 12)[0]])["materials"][0]
        share = material["extensions"]["KHR_materials_diffuse_transmission"]["diffuseTransmissionFactor"]
        return [(1 - share) * v for v in material["pbrMetallicRoughness"]["baseColorFactor"][:3]]

    coloured = sent_back("coloured", [0.5, 1.3, 4.0])
    for c, s in ((0, 0.5), (2, 4.0)):
        grey = sent_back(f"grey{c}", [s, s, s])
        require(math.isclose(coloured[c], grey[c], rel_tol=1e-5), f"glTF: channel {c} of a light ceramic sends back {coloured[c]}, {grey[c]} alone")


def names_of_their_own(folder):
    """Neither a photograph nor layers whose names differ by a sign take each other's place."""
    called = folder / "called"
    shutil.copytree(capture, called)
    stated = json.loads((called / "capture.json").read_text())
    stated["photographs"] = [{**stated["photographs"][0], "name": "material"}]
    (called / "capture.json").write_text(json.dumps(stated))
    for renderer, file, medium in (("mitsuba", "material.xml", "<medium"), ("pbrt", "material.pbrt", "MakeNamedMedium")):
        run(capture / "truth.json", "--to", renderer, "--capture", called, "--paths", 2, "-o", folder / renderer)
        require(medium in (folder / renderer / file).read_text(), f"{renderer}: a photograph took the material's file")
    layers = [{**truth["layers"][0], "thickness_mm": 1, "name": name} for name in ("a-b", "a_b")]
    (folder / "alike.json").write_text(json.dumps({**truth, "layers": layers}))
    run(folder / "alike.json", "--to", "materialx", "-o", folder / "alike")
    names = [node.get("name") for node in ET.parse(folder / "alike/material.mtlx").getroot()]
    require(len(set(names)) == len(names), f"MaterialX: siblings of one name: {names}")


def refusals(folder):
    require("mitsuba" in run(capture / "truth.json", "--to", "maya", "-o", folder, expect=2), "an unknown format is not answered with the known")
    run(capture / "truth.json", "-o", folder, expect=2)
    fewer, more = json.loads(json.dumps(truth)), json.loads(json.dumps(truth))
    fewer["layers"].pop()
    more["layers"].append({"name": "glaze"})
    for name, material in (("fewer", fewer), ("more", more)):
        file = folder / f"{name}.json"
        file.write_text(json.dumps(material))
        said = run(file, "--to", "mitsuba", "--capture", capture, "-o", folder / "never", expect=2)
        require(f"{name}.json" in said and "Give the" in said, f"{name} layers than the capture: {said}")
    require(not (folder / "never").exists(), "a refused export leaves files")


with tempfile.TemporaryDirectory() as folder:
    folder = Path(folder)
    checks = {"mitsuba": check_mitsuba, "pbrt": check_pbrt, "gltf": check_gltf, "materialx": check_materialx, "csv": check_csv, "blender": check_blender}
    for name, check in checks.items():
        run(capture / "truth.json", "--to", name, "--capture", capture, "-o", folder / name, "--paths", "2")
        check(folder / name)
        notes = (folder / name / "README.md").read_text()
        makes_pictures = name not in ("csv", "materialx")
        require("What is lost" in notes and ("Tolerance: " in notes) == makes_pictures, f"{name}: README")
        require(all((f"reference/{s}.exr" in notes) == makes_pictures for s in shots), f"{name}: README's pictures")
        require(all((folder / name / "reference" / f"{s}{e}").exists() == makes_pictures for s in shots for e in (".exr", ".png")), f"{name}: reference pictures")
    imported_again(folder)
    gltf_of_flat_layers(folder)
    gltf_of_a_light_ceramic(folder)
    names_of_their_own(folder)
    intervals(folder)
    refusals(folder)

for fault in faults:
    print("FAIL", fault)
print(f"{len(faults)} faults")
sys.exit(1 if faults else 0)
