#!/usr/bin/env python3
"""calibrate_test.py CROWNFIT CAPTURE: calibration commands say what is wrong and what to do, write nothing when they refuse, and
`capture init` puts a capture together that `check` accepts. (What the estimators find is tested in calibrate_*_test.cpp.)"""
import json
import math
import struct
import subprocess
import sys
import tempfile
import zlib
from pathlib import Path

program, capture = sys.argv[1], Path(sys.argv[2])


def run(*arguments, expect=0):
    done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True)
    assert done.returncode == expect, (arguments, done.returncode, done.stderr)
    return done


def picture(file, width, height, value):
    """8-bit PPM; value(x, y) gives a grey or three channels."""
    pixels = bytearray()
    for y in range(height):
        for x in range(width):
            v = value(x, y)
            pixels += bytes(v if isinstance(v, tuple) else (v, v, v))
    file.write_bytes(b"P6\n%d %d\n255\n" % (width, height) + bytes(pixels))
    return file


with tempfile.TemporaryDirectory() as folder:
    folder = Path(folder)
    out = folder / "out.json"
    plain = picture(folder / "plain.ppm", 160, 120, lambda x, y: 90 + x // 8)

    def refused(*arguments, saying, expect=2):
        done = run("calibrate", *arguments, "-o", out, expect=expect)
        assert all(words in done.stderr for words in saying), (arguments, done.stderr)
        assert not out.exists(), "nothing may be written"

    refused("camera", plain, "--board", "charuco", "--corners", "9x6", "--square-mm", 10, saying=["0 of 1 photographs", "mirror"])
    refused("camera", plain, "--board", "charuco", "--corners", "nine", "--square-mm", 10, saying=["--corners", "9x6"])
    refused("camera", plain, "--board", "charuco", "--corners", "9x6", saying=["--square-mm", "measured"])
    refused("camera", plain, "--board", "paper", "--corners", "9x6", "--square-mm", 10, saying=["'paper' is not a board"])
    refused("camera", plain, "--board", "charuco", "--corners", "9x6", "--square-mm", 10, "--dictionary", "9X9_9", saying=["9X9_9", "Known: "])
    refused("noise", plain, plain, saying=["plain.ppm", "encoded for display", "--linear"])
    refused("noise", plain, "--linear", saying=["pairs", "--series"])
    other = picture(folder / "other.ppm", 160, 120, lambda x, y: 90 + x // 8 + (x * 7 + y * 13) % 3)
    copy = folder / "copy.ppm"
    copy.write_bytes(plain.read_bytes())
    for again in (plain, copy):
        refused("noise", other, plain, plain, again, "--linear", saying=[f"{again}: holds the same pixels as {plain}", "Photograph the scene twice"])
    refused("noise", other, plain, copy, "--series", "--linear", saying=["copy.ppm: holds the same pixels"])
    refused("noise", plain, other, "--dark", plain, plain, "--linear", saying=["--dark: is the same file as"])
    refused("exposures", plain, plain, "--times", "1,2,3", saying=["3 times for 2 photographs"])
    refused("blur", plain, "--linear", saying=["no dark square", "calibrate target jig"])
    refused("blur", plain, "--linear", "--region", "0,0,9999,20", saying=["--region", "outside of the picture"])
    refused("colour", plain, saying=["no ColorChecker was found", "--chart-corners"])
    refused("colour", plain, "--chart", folder / "absent.json", saying=["absent.json"])
    refused("lights", saying=["NAME=FILE", "--rig"])
    refused("lights", "left", saying=["NAME=FILE", "found 'left'"])
    refused("lights", f"left={plain}", "--linear", "--balls", 1, saying=["no ball was found", "--ball X,Y,RADIUS"])

    # A jig that is not in the picture: measured, and refused.
    run("calibrate", "target", "jig", "-o", folder / "jig.svg")
    assert (folder / "jig.svg").read_text().startswith("<svg")
    camera = folder / "camera.json"
    camera.write_text('{"format": "crownfit-camera/1", "width": 160, "height": 120, "fx": 900, "fy": 900, "cx": 80, "cy": 60}')
    refused("pose", plain, "--camera", camera, "--jig", folder / "jig.json", saying=["plain: shows 0 corners", "Nothing was written"], expect=1)
    refused("pose", plain, "--camera", camera, saying=["--jig", "--mesh"])
    refused("pose", plain, "--camera", capture / "calib/camera.json", "--jig", folder / "jig.json", saying=["160 x 120", "camera.json is for"])

    # Names that poses would mix up, boards that look the same upside down, lamps in a frame that cards do not share.
    twin = folder / "other" / plain.name
    twin.parent.mkdir()
    twin.write_bytes(plain.read_bytes())
    refused("pose", plain, twin, "--camera", camera, "--jig", folder / "jig.json", saying=["has the same name as", str(plain)])
    refused("pose", plain, "--camera", camera, "--board", "chessboard", "--corners", "8x6", "--square-mm", 10, saying=["half a turn", "9x6"], expect=1)
    rig, card_pose = folder / "rig.json", folder / "card_pose.json"
    lamp = {"name": "key", "type": "point", "position_mm": [0, 0, -100], "radiant_intensity_rgb": [1, 1, 1], "radius_mm": 1}
    pose = {"rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "translation_mm": [0, 0, 300]}
    card_pose.write_text(json.dumps({"format": "crownfit-poses/1", "poses": [{"photograph": plain.stem, "camera_from_object": pose}]}))
    rig.write_text(json.dumps({"format": "crownfit-light-rig/1", "lights": [lamp]}))
    refused("lights", "--rig", rig, "--camera", camera, "--linear", "--card", f"key={plain}", "--card-pose", card_pose, "--card-mm", "-2,-2,2,2",
            saying=["'key'", "object's frame", '"frame": "camera"'])
    rig.write_text(json.dumps({"format": "crownfit-light-rig/1", "lights": [{**lamp, "frame": "camera"}]}))
    card_pose.write_text(json.dumps({"format": "crownfit-poses/1", "poses": 2 * [{"photograph": plain.stem, "camera_from_object": pose}]}))
    refused("lights", "--rig", rig, "--camera", camera, "--linear", "--card", f"key={plain}", "--card-pose", card_pose, "--card-mm", "-2,-2,2,2", saying=["two poses"])
    refused("lights", f"left={plain}", "--linear", "--ball", "80,60,30", saying=["left: no ball shows its highlight"], expect=1)

    white = picture(folder / "white.ppm", 160, 120, lambda x, y: 255)
    refused("colour", plain, "--linear", "--flat-field", white, saying=["white.ppm", "--flat-field", "saturated"])

    # No photograph is replaced by the picture of its result, whose name is the output's.
    chunk = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    card = folder / "card.png"
    card.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", 64, 64, 8, 2, 0, 0, 0)) +
                     chunk(b"IDAT", zlib.compress((b"\0" + b"\x60" * 192) * 64)) + chunk(b"IEND", b""))
    before = card.read_bytes()
    run("calibrate", "colour", card, "--grey-card", "8,8,48,48", "--card-reflectance", 1, "-o", folder / "card.json")
    assert card.read_bytes() == before and (folder / "card_result.png").exists()
    done = run("calibrate", "colour", card, "--grey-card", "8,8,48,48", "--card-reflectance", 1, "-o", out, "--picture", card, expect=2)
    assert "would be replaced" in done.stderr and card.read_bytes() == before, done.stderr

    # A capture from the parts of another.
    stated = json.loads((capture / "capture.json").read_text())
    poses = []
    for photo in stated["photographs"]:
        pose = {k: photo["camera_from_object"][k] for k in ("rotation", "translation_mm")}
        poses.append({"photograph": Path(photo["file"]).stem, "camera_from_object": pose})
    (folder / "poses.json").write_text(json.dumps({"format": "crownfit-poses/1", "poses": poses}))
    parts = ["--mesh", f"enamel={capture / stated['object']['layers'][0]['surface']}", "--layer", "dentine", "--thickness-mm", 0.7,
             "--camera", capture / "calib/camera.json", "--poses", folder / "poses.json", "--lights", capture / stated["light_rig"]]
    for photo in stated["photographs"][:2]:
        parts += ["--photo", f"{photo['name']}={capture / photo['file']}", "--lit", f"{photo['name']}={','.join(photo['lights'])}"]
    first, second = stated["photographs"][0]["name"], stated["photographs"][1]["name"]
    made = run("capture", "init", "-o", folder / "made", *parts, "--polarisation", f"{first}=cross", "--holdout", second)
    assert "capture.json: valid" in made.stdout and "dentine" in made.stdout and "held out" in made.stdout, made.stdout
    written = json.loads((folder / "made/capture.json").read_text())
    assert written["photographs"][0]["polarisation"] == "cross" and written["photographs"][0]["lights"] == stated["photographs"][0]["lights"]
    sky = folder / "sky/rig.json"  # what a rig names goes with it
    sky.parent.mkdir()
    picture(sky.parent / "sky.ppm", 8, 4, lambda x, y: 200)
    sky.write_text(json.dumps({"format": "crownfit-light-rig/1", "lights": [{"name": "sky", "type": "environment", "file": "sky.ppm"}]}))
    photo = stated["photographs"][0]
    run("capture", "init", "-o", folder / "under_the_sky", *parts[:parts.index("--lights")], "--lights", sky, "--photo", f"{photo['name']}={capture / photo['file']}")
    assert (folder / "under_the_sky/calib/sky.ppm").exists()
    assert "'sun' is not known" in run("capture", "init", "-o", folder / "made", *parts, "--lit", f"{first}=sun", expect=2).stderr
    assert "has no pose of plain" in run("capture", "init", "-o", folder / "made", *parts, "--photo", f"x={plain}", expect=2).stderr

    # The same photographs as COLMAP states them: turned by the axis of x or y, in units of 10 mm.
    colmap = folder / "colmap"
    colmap.mkdir()
    camera = json.loads((capture / "calib/camera.json").read_text())
    (colmap / "cameras.txt").write_text("1 PINHOLE %d %d %r %r %r %r\n" % tuple(camera[k] for k in ("width", "height", "fx", "fy", "cx", "cy")))
    lines, names = [], []
    for i, photo in enumerate(stated["photographs"]):
        pose = photo["camera_from_object"]
        half_turn = {(1, -1, -1): "0 1 0 0", (-1, 1, -1): "0 0 1 0"}.get(tuple(round(pose["rotation"][k][k]) for k in range(3)))
        if half_turn:
            names.append(photo["name"])
            lines.append(f"{i} {half_turn} {' '.join(str(v / 10) for v in pose['translation_mm'])} 1 {Path(photo['file']).name}\n\n")
    assert names, "no photograph of this capture is turned by an axis"
    (colmap / "images.txt").write_text("".join(lines) + "99 1 0 0 0 0 0 1 1 missing.png\n\n")
    made = run("capture", "import", colmap, "-o", folder / "imported", "--photographs", capture / "photos", "--mm-per-unit", 10, *parts[:2], "--lights", parts[parts.index("--lights") + 1])
    assert "missing.png" in made.stdout and "capture.json: valid" in made.stdout, made.stdout
    def poses_are_as_stated(imported):
        for photo in json.loads((imported / "capture.json").read_text())["photographs"]:
            theirs = next(p for p in stated["photographs"] if Path(p["file"]).stem == photo["name"])
            for key in ("rotation", "translation_mm"):
                flat = lambda values: [float(v) for row in values for v in (row if isinstance(row, list) else [row])]
                ours, wanted = (flat(p["camera_from_object"][key]) for p in (photo, theirs))
                assert all(abs(a - b) < 1e-9 for a, b in zip(ours, wanted)), (key, ours, wanted)

    poses_are_as_stated(folder / "imported")

    # And as OpenCV does: rotation vectors, pixels that begin at their centres, in units of 10 mm that two points state.
    matrix = lambda rows, columns, data: f"!!opencv-matrix\n   rows: {rows}\n   cols: {columns}\n   dt: d\n   data: [ {', '.join(map(repr, data))} ]"
    posed = [p for p in stated["photographs"] if p["name"] in names]
    turns = [[math.pi * (v[0] > 0), math.pi * (v[1] > 0), 0.0] for v in ([row[k] for k, row in enumerate(p["camera_from_object"]["rotation"])] for p in posed)]
    rows = [x for turn, p in zip(turns, posed) for x in (*turn, *(v / 10 for v in p["camera_from_object"]["translation_mm"]))]
    opencv = folder / "opencv.yml"
    intrinsics = "%YAML:1.0\n---\n" + "".join(f"image_{k}: {camera[k]}\n" for k in ("width", "height"))
    intrinsics += "camera_matrix: " + matrix(3, 3, [camera["fx"], 0, camera["cx"] - 0.5, 0, camera["fy"], camera["cy"] - 0.5, 0, 0, 1]) + "\n"
    opencv.write_text(intrinsics + "extrinsic_parameters: " + matrix(len(posed), 6, rows) + "\nimage_names:\n" + "".join(f"   - \"{Path(p['file']).name}\"\n" for p in posed))
    made = run("capture", "import", opencv, "-o", folder / "of_opencv", "--photographs", capture / "photos", "--scale-from", "1,2,3:1,2,5=20", *parts[:2], "--lights", parts[parts.index("--lights") + 1])
    assert "capture.json: valid" in made.stdout, made.stdout
    poses_are_as_stated(folder / "of_opencv")
    theirs, ours = (json.loads((f / "calib/camera.json").read_text()) for f in (capture, folder / "of_opencv"))
    assert all(abs(theirs[k] - ours[k]) < 1e-9 for k in ("fx", "fy", "cx", "cy")), (theirs, ours)
    opencv.write_text(intrinsics)
    done = run("capture", "import", opencv, "-o", folder / "none", *parts[:2], "--lights", parts[parts.index("--lights") + 1], expect=2)
    assert "no poses" in done.stderr and "calibrate pose" in done.stderr, done.stderr
    at_camera = parts.index("--camera") + 1
    run("capture", "init", "-o", folder / "by_opencv", *parts[:at_camera], opencv, *parts[at_camera + 1:])
    assert abs(json.loads((folder / "by_opencv/calib/camera.json").read_text())["cx"] - camera["cx"]) < 1e-9
    done = run("capture", "import", folder / "made", "-o", folder / "none", *parts[:2], "--lights", parts[parts.index("--lights") + 1], expect=2)
    assert "no model of COLMAP" in done.stderr and not (folder / "none").exists(), done.stderr
print("commands refuse in words")
