#!/usr/bin/env python3
"""hostile_test.py CROWNFIT CAPTURE: files that are made to break a reader. Each must be refused by `check`, or by the
command that reads it: exit code 2 within 20 s, with a message that names the file and what is wrong; none may crash, hang
or be read as something else. What only looks odd (links, .., raised limits) must still be read."""
import json
import os
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import zlib
from pathlib import Path

program, source = sys.argv[1], Path(sys.argv[2])
doc = json.loads((source / "capture.json").read_text())
truth = json.loads((source / "truth.json").read_text())
photo = doc["photographs"][0]["file"]
camera = doc["photographs"][0]["camera"]
free = truth["layers"][0]["name"] + ".absorption_per_mm"
render = ["render", ".", "--material", "truth.json", "-o", "made"]
predict = ["predict", "truth.json", "--thickness", ",".join(layer["name"] + "=1" for layer in truth["layers"])]
faults = []


def png(width, height, pixels=b"", colour=2, depth=8):
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, depth, colour, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(pixels)) + chunk(b"IEND", b"")


def exr_window(data, name, box):
    """The EXR with another dataWindow or displayWindow: x, y of the first and of the last pixel."""
    at = data.index(name.encode() + b"\0box2i\0") + len(name) + 7 + 4
    return data[:at] + struct.pack("<4i", *box) + data[at + 16 :]


def exr_channel(data, old, new):
    return data.replace(b"channels\0chlist\0" + data.split(b"channels\0chlist\0")[1][:4] + old, b"channels\0chlist\0" + data.split(b"channels\0chlist\0")[1][:4] + new, 1)


def image(name, data, why, **more):
    """Stands under a name of its own in place of the first photograph."""

    def breaker(d):
        (d / name).write_bytes(data if isinstance(data, bytes) else data((source / photo).read_bytes()))
        changed = json.loads(json.dumps(doc))
        changed["photographs"][0]["file"] = name
        changed["photographs"][0].pop("variance", None)
        (d / "capture.json").write_text(json.dumps(changed))

    return (f"image {name}: {why}", breaker, [re.escape(name), why], more)


def mesh(name, data, why, **more):
    def breaker(d):
        (d / name).write_bytes(data.encode() if isinstance(data, str) else data)
        changed = json.loads(json.dumps(doc))
        changed["object"]["layers"][0]["surface"] = name
        (d / "capture.json").write_text(json.dumps(changed))

    return (f"mesh {name}: {why}", breaker, [re.escape(name), why], more)


def text(what, data, why, **more):
    return (f"capture.json: {what}", lambda d: (d / "capture.json").write_bytes(data), [r"capture\.json", why], more)


def edited(what, change, why, **more):
    def breaker(d):
        changed = json.loads(json.dumps(doc))
        change(changed)
        (d / "capture.json").write_text(json.dumps(changed))

    return (what, breaker, [why], more)


def beside(what, name, change, why, **more):
    """A file that capture.json names, changed."""

    def breaker(d):
        changed = json.loads((d / name).read_text())
        change(changed)
        (d / name).write_text(json.dumps(changed))

    return (what, breaker, [re.escape(Path(name).name), why], more)


def camera_with(values, why):
    return beside(f"camera: {values}", camera, lambda c: c.update(values), why)


def lamp(what, values, why):
    """In place of the first photograph's first."""

    def change(rig):
        name = doc["photographs"][0]["lights"][0]
        at = [light["name"] for light in rig["lights"]].index(name)
        rig["lights"][at] = dict({"name": name, "frame": "object"}, **values)

    return beside(f"lamp: {what}", doc["light_rig"], change, why)


def tile(values, why):
    def change(c):
        c["object"]["backings"]["black"].update(values)
        c["photographs"][0]["backing"] = "black"

    return edited(f"tile: {values}", change, why)


def posed(what, values, why):
    return edited(what, lambda c: c["photographs"][0]["camera_from_object"].update(values), why)


def material(key, value, why):
    """truth.json with another value in its first layer, or on the surface."""

    def breaker(d):
        changed = json.loads(json.dumps(truth))
        (changed["surface"] if key in changed["surface"] else changed["layers"][0])[key] = value
        (d / "truth.json").write_text(json.dumps(changed))

    return (f"material: {key} {value}", breaker, [r"truth\.json.*" + key, why], {"command": predict})


def recipe(what, change, why, **more):
    """The capture as a recipe: every parameter at its true value."""

    def breaker(d):
        changed = json.loads(json.dumps(doc))
        changed["format"] = "crownfit-recipe/1"
        changed["object"]["surface"].update(truth["surface"])
        for layer, true in zip(changed["object"]["layers"], truth["layers"]):
            layer.update(true)
        for p in changed["photographs"]:
            p.pop("variance", None)
        changed["synthesis"] = {"paths_per_pixel": 2, "free": [free]}
        change(changed)
        (d / "recipe.json").write_text(json.dumps(changed))

    return (f"recipe: {what}", breaker, [why], {"command": ["synthesize", "recipe.json", "-o", "made"], **more})


def mask(value):
    def breaker(d):
        (d / "mask.png").write_bytes(png(width, height, (b"\0" + bytes([value]) * width) * height, colour=0))
        changed = json.loads(json.dumps(doc))
        changed["photographs"][0]["mask"] = "mask.png"
        (d / "capture.json").write_text(json.dumps(changed))

    return breaker


def link_to(target):
    def breaker(d):
        (d / photo).unlink()
        (d / photo).symlink_to(target)

    return breaker


def pipe(relative):
    def breaker(d):
        (d / relative).unlink()
        os.mkfifo(d / relative)

    return breaker


width, height = (json.loads((source / camera).read_text())[k] for k in ("width", "height"))
ply_head = "ply\nformat {}\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n"
tetrahedron = [(0, 0, 0), (5, 0, 0), (0, 5, 0), (0, 0, 5)]
faces = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
obj_corners = "".join(f"v {x} {y} {z}\n" for x, y, z in tetrahedron)
obj_faces = "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in faces)
floats = b"".join(struct.pack("<3f", *v) for v in tetrahedron)
softbox = dict(type="rectangle", centre_mm=[0, 0, 200], half_axis_u_mm=[0, 50, 0], half_axis_v_mm=[-50, 0, 0], radiance_rgb=[1, 1, 1])

cases = [
    image("giant.png", png(2**31 - 1, 2**31 - 1), "read|pixels"),
    image("bomb.png", png(19000, 19000), "million"),
    image("wide.exr", lambda e: exr_window(exr_window(e, "dataWindow", (0, 0, 2**30, 2**30)), "displayWindow", (0, 0, 2**30, 2**30)), "read|pixels"),
    image("negative.exr", lambda e: exr_window(e, "dataWindow", (0, 0, -1000, -1000)), "read"),
    image("cropped.exr", lambda e: exr_window(e, "displayWindow", (-10, -10, width + 9, height + 9)), "window"),
    image("shifted.exr", lambda e: exr_window(e, "dataWindow", (-5, -5, width - 6, height - 6)), "window"),
    image("channels.exr", lambda e: exr_channel(e, b"B\0", b"Q\0"), "channel"),
    image("one.png", png(1, 1, b"\0\1\2\3"), "1 x 1"),
    image("grey_alpha.png", png(2, 2, b"\0\1\2\3\4" * 2, colour=4), "2 channels"),
    image("nothing.exr", lambda e: e[:8], "read"),
    image("zeros.exr", lambda e: e[:8] + bytes(20000), "read"),
    image("cut.exr", lambda e: e[:-1000], "read"),
    image("film.mp4", b"\0\0\0\x18ftypmp42\0\0\0\0mp42isom" + bytes(500), "read"),
    image("sixty.exr", lambda e: e, "more than 0 million|pixels", limits={"CROWNFIT_MAX_IMAGE_MEGAPIXELS": "0.001"}),
    ("photograph: a pipe", pipe(photo), ["no such image"], {}),
    ("photograph: a device", link_to("/dev/zero"), ["no such image"], {}),
    ("photograph: a link to itself", link_to(Path(photo).name), ["no such image"], {}),
    ("camera file: a pipe", pipe(camera), ["no such file"], {}),
    mesh("many.ply", ply_head.format("binary_little_endian 1.0", 2**31, 1), "impossible|room"),
    mesh("claims.ply", ply_head.format("binary_little_endian 1.0", 900000000, 1), "room"),
    mesh("textclaims.ply", ply_head.format("ascii 1.0", 900000000, 1) + "0 0 0\n", "room"),
    mesh("empty_elements.ply", "ply\nformat ascii 1.0\n" + "".join(f"element e{i} 999999999\n" for i in range(900)) + "end_header\n", "room"),
    mesh("index.ply", ply_head.format("ascii 1.0", 4, 4).encode() + b"0 0 0\n5 0 0\n0 5 0\n0 0 5\n" + b"3 0 1 4294967297\n" * 4, "names vertex|whole number"),
    mesh("nanindex.ply", (ply_head.format("ascii 1.0", 4, 1).replace("int vertex", "float vertex") + "0 0 0\n5 0 0\n0 5 0\n0 0 5\n3 0 1 nan\n"), "whole number"),
    mesh("flat.ply", ply_head.format("binary_little_endian 1.0", 4, 0).replace("property float z\n", "").encode() + bytes(64), "lack"),
    mesh("twice.ply", ply_head.format("ascii 1.0", 4, 4).replace("property float z", "property float z\nproperty float z") + "0 " * 99, "twice"),
    mesh("long_list.ply", ply_head.format("ascii 1.0", 4, 1) + "0 0 0\n5 0 0\n0 5 0\n0 0 5\n99999999 0\n", "length"),
    mesh("many.stl", bytes(80) + struct.pack("<I", 2**31) + bytes(500), "truncated"),
    mesh("nan.stl", bytes(80) + struct.pack("<I", 1) + struct.pack("<12fH", *[float("nan")] * 12, 0), "finite"),
    mesh("index.obj", obj_corners + "f 1 2 99999999999999999999\n", "vertex"),
    mesh("zero_index.obj", obj_corners + "f 0 1 2\n", "names vertex"),
    mesh("fraction.obj", obj_corners + "f 1.5 2 3\n", "vertex"),
    mesh("infinite.obj", obj_corners + "v 1e999 0 0\n" + obj_faces, "number|finite"),
    mesh("far.obj", obj_corners + "v 1e30 0 0\n" + obj_faces, "100 m"),
    mesh("away.obj", "".join(f"v {x + 50000} {y} {z}\n" for x, y, z in tetrahedron) + obj_faces, "from the origin"),
    mesh("sliver.obj", obj_corners + "v 2.5 0 0\n" + obj_faces + "f 1 2 5\n", "no area"),
    mesh("sheet.obj", obj_corners + "f 1 2 3\n", "not closed|openings"),
    mesh("much.obj", obj_corners + obj_faces, "more than|triangles", limits={"CROWNFIT_MAX_MESH_MILLION_TRIANGLES": "0.000003"}),
    text("a million brackets", b"[" * 10**6, "nested"),
    text("a million braces", b'{"a":' * 10**6, "nested"),
    text("a key twice", json.dumps(doc).replace('"format"', '"format": "x", "format"', 1).encode(), "twice"),
    text("a hundred thousand keys", b"{" + b",".join(b'"k%d":1' % i for i in range(10**5)) + b"}", "keys"),
    text("a key of a megabyte", b'{"' + b"k" * 10**6 + b'": 1}', "key"),
    text("an escape sequence", b'{"\\u001b[31mred": 1}', "control"),
    text("1e999", json.dumps(doc).replace("1.6", "1e999", 1).encode(), "1e999|overflow|range"),
    text("not UTF-8", b'{"format": "\xff\xfe"}', "JSON"),
    text("limit", json.dumps(doc).encode(), "MiB", limits={"CROWNFIT_MAX_JSON_MIB": "0.0001"}),
    edited("a hundred layers", lambda c: c["object"].update(layers=[dict(c["object"]["layers"][0], name=f"l{i}") for i in range(100)]), "layers.*more than"),
    edited("a light twice", lambda c: c["photographs"][0]["lights"].append(c["photographs"][0]["lights"][0]), "lights.*twice"),
    edited("a photograph twice", lambda c: c["photographs"].append(dict(c["photographs"][0], name="again")), "same picture"),
    ("an empty mask", mask(0), ["no usable pixel.*mask"], {}),
    ("all saturated", image("white.png", png(width, height, (b"\0" + b"\xff" * 3 * width) * height), "")[1], ["no usable pixel.*saturated"], {}),
    ("all black", image("black.png", png(width, height, bytes((1 + 3 * width) * height)), "")[1], ["is black"], {}),
    *[camera_with({key: f}, f"{key}.*focal length") for key, f in (("fx", 1e-15), ("fx", 1e-300), ("fy", 1e300))],
    camera_with({"cx": 1e300}, "cx.*outside"),
    lamp("radiance", dict(softbox, radiance_rgb=[1e300, 1, 1]), "radiance_rgb.*outside"),
    lamp("centre", dict(softbox, centre_mm=[1e19, 0, 1e19]), "centre_mm.*100 m"),
    lamp("size", dict(softbox, half_axis_u_mm=[0, 1e300, 0]), "half_axis_u_mm.*100 m"),
    lamp("radius", dict(type="disk", centre_mm=[0, 0, 200], normal=[0, 0, -1], radius_mm=1e300, radiance_rgb=[1, 1, 1]), "radius_mm.*more than"),
    lamp("point", dict(type="point", position_mm=[0, 0, 1e30], radiant_intensity_rgb=[1, 1, 1]), "position_mm.*100 m"),
    (*lamp("inside the object", dict(softbox, centre_mm=[0, 0, 0]), "")[:2], ["light.*inside the object"], {}),
    beside("lamps", doc["light_rig"], lambda r: [light.update(intensity_scale={"fixed": 1e300}) for light in r["lights"]], "intensity_scale.*more than"),
    tile({"size_mm": 1e19}, "size_mm.*outside"),
    tile({"size_mm": 1e-300}, "size_mm.*outside"),
    tile({"point_mm": [0, 0, -1e19]}, "point_mm.*100 m"),
    *[tile({"reflectance_rgb": [r, 0, 0]}, "reflectance_rgb.*outside") for r in (1e300, 2)],
    posed("a camera inside the object", {"translation_mm": [0, 0, 0.1]}, "camera.*inside the object"),
    posed("a pose as wide as nothing", {"covariance": [[1e300 * (i == k) for i in range(6)] for k in range(6)]}, "covariance.*outside"),
    edited("a bright exposure", lambda c: c["photographs"][0].update(exposure_scale={"fixed": 1e300}), "exposure_scale.*more than"),
    edited("257 lights on a photograph", lambda c: c["photographs"][0].update(lights=["left"] * 257), "lights.*more than 256"),
    edited("a name of 252 letters", lambda c: c["photographs"][0].update(name="a" * 252), "name.*longer than 100"),
    edited("a layer called surface", lambda c: c["object"]["layers"][0].update(name="surface"), "can't be called .*surface"),
    edited("a start that is no start", lambda c: c["object"]["layers"][0].update(reduced_scattering_per_mm={"initial": 0}), "reduced_scattering.*outside"),
    edited("an impossible prior", lambda c: c["object"]["layers"][0].update(g={"initial": 0.8, "prior": {"mean": 1e300, "log_stddev": 1}}), "prior.mean.*outside"),
    *[material("reduced_scattering_per_mm", v, "outside") for v in (-1, 1e300, [1, 1, -1])],
    *[material("absorption_per_mm", v, "outside") for v in (-1, {"value": [0.1, 0.1, 2e3]})],
    *[material("ior", v, "outside") for v in (-1, 0.5, 50)],
    *[material("g", v, "outside") for v in (1, -1, 2)],
    *[material("thickness_mm", v, "outside") for v in (-5, 0, 1e300)],
    *[material("roughness", v, "outside") for v in (-1, 50)],
    material("wetness", 7, "outside"),
    beside("material: a layer twice", "truth.json", lambda m: m["layers"].append(m["layers"][0]), "two layers", command=render),
    beside("material: for the viewer", "truth.json", lambda m: m.update(viewer={"layers": [dict(truth["layers"][0], absorption_per_mm=-1)]}), "viewer.*outside", command=render),
    recipe("free twice", lambda r: r["synthesis"].update(free=[free, free]), r"recipe\.json.*free.*twice"),
    recipe("no folder", lambda r: None, "/dev/null/x.*can't be written", command=["synthesize", "recipe.json", "-o", "/dev/null/x"]),
    ("benchmark: no folder", lambda d: None, ["/dev/null/x: can't be written"], {"command": ["benchmark", "tradeoff", ".", "-o", "/dev/null/x"]}),
    edited("a limit that is none", lambda c: None, "CROWNFIT_MAX_JSON_MIB", limits={"CROWNFIT_MAX_JSON_MIB": "lots"}),
]


def run(d, limits=None, command=("check", "."), most_s=20):
    try:
        return subprocess.run([program, *command], cwd=d, capture_output=True, text=True, errors="replace", timeout=most_s, env=dict(os.environ, **(limits or {})))
    except subprocess.TimeoutExpired:
        return None


for what, breaker, patterns, more in cases:
    with tempfile.TemporaryDirectory() as tmp:
        d = Path(tmp) / "capture"
        shutil.copytree(source, d)
        breaker(d)
        done = run(d, **more)
        if done is None:
            faults.append(f"{what}: still running after 20 s")
        elif done.returncode != 2:
            faults.append(f"{what}: exit {done.returncode}: {done.stderr.strip()[:300]}")
        elif [p for p in patterns if not re.search(p, done.stderr)] or "Sanitizer" in done.stderr or len(done.stderr) > 2000:
            faults.append(f"{what}: expected {patterns}: {done.stderr.strip()[:300]}")

# Links and .. are followed: a lab keeps one calibration for many captures.
with tempfile.TemporaryDirectory() as tmp:
    shutil.copytree(source, Path(tmp) / "shared")
    d = Path(tmp) / "capture"
    d.mkdir()
    for name in ("mesh", "photos"):
        (d / name).symlink_to(Path(tmp) / "shared" / name)
    moved = json.loads(json.dumps(doc))
    moved["light_rig"] = "../shared/" + moved["light_rig"]
    for p in moved["photographs"]:
        p["camera"] = "../shared/" + p["camera"]
    (d / "capture.json").write_text(json.dumps(moved))
    done = run(d, {"CROWNFIT_MAX_IMAGE_MEGAPIXELS": "2000"}, most_s=120)  # a whole check, five times slower under sanitizers
    if done is None or done.returncode != 0:
        faults.append(f"links and ..: {'time-out' if done is None else done.stderr.strip()[:300]}")

# A direction's length says nothing; where a lens' distortion has no inverse, nothing is seen.
with tempfile.TemporaryDirectory() as tmp:
    d = Path(tmp) / "capture"
    shutil.copytree(source, d)
    lamp("", dict(type="directional", direction=[0, 0, 1e308], irradiance_rgb=[1, 1, 1]), "")[1](d)
    camera_with({"distortion": [0, 0, 0, 0, 0, -1e5, 0, 0]}, "")[1](d)
    done = run(d, most_s=120)  # as above
    if done is None or done.returncode != 0:
        faults.append(f"a long direction, a lens of odd distortion: {'time-out' if done is None else done.stderr.strip()[:300]}")

for fault in faults:
    print("FAIL", fault)
print(f"hostile inputs: {len(cases)} files, {len(faults)} faults")
sys.exit(1 if faults else 0)
