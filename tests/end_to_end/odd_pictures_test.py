#!/usr/bin/env python3
"""odd_pictures_test.py CROWNFIT CAPTURE: photographs of one pixel say that nothing is known; photographs that are large beside what a
fit takes are averaged, said so, and give what they give in full; a process that reads a TIFF first reads it as any other."""
import json
import os
import shutil
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

program, source = sys.argv[1], Path(sys.argv[2])
LAYER_KEYS = ("reduced_scattering_per_mm", "absorption_per_mm")


def fit(capture, result, expect, **environment):
    done = subprocess.run([program, "fit", capture, "-o", result, "--model", "shader", "--profiles", "0", "--progress", "none"],
                          capture_output=True, text=True, env=dict(os.environ, **environment))
    assert done.returncode == expect, (done.returncode, done.stdout, done.stderr)
    return json.loads((result / "material.json").read_text()), done.stderr


with tempfile.TemporaryDirectory() as folder:
    folder = Path(folder)
    one = folder / "one"
    shutil.copytree(source, one)
    capture, camera = (json.loads((one / name).read_text()) for name in ("capture.json", "calib/camera.json"))
    capture["photographs"] = capture["photographs"][:1]
    wide = 4  # the pixel shows a quarter of what the picture showed, all of it tooth
    camera.update(width=1, height=1, cx=0.5, cy=0.5, fx=wide * camera["fx"] / camera["width"], fy=wide * camera["fy"] / camera["height"])
    (one / "capture.json").write_text(json.dumps(capture))
    (one / "calib/camera.json").write_text(json.dumps(camera))
    subprocess.run([program, "render", one, "--material", one / "truth.json", "-o", one / "photos", "--noise", "0.01", "--progress", "none"], check=True, capture_output=True)
    material, _ = fit(one, folder / "one_result", expect=1)
    statuses = {layer[key]["status"] for layer in material["layers"] for key in LAYER_KEYS}
    assert statuses == {"not_identified"} and material["status"] == "not_usable", (statuses, material["status"])

    material, said = fit(source, folder / "averaged", expect=0, CROWNFIT_MAX_CROWN_MEGAPIXELS="0.001")
    assert "averaged over squares of pixels" in said and "front 2 x 2" in said, said
    truth = json.loads((source / "truth.json").read_text())
    held = [low <= goal <= high for layer, true in zip(material["layers"], truth["layers"]) for key in LAYER_KEYS
            for (low, high), goal in zip(layer[key]["interval95"], true[key])]
    assert len(held) == 12 and sum(held) >= 10, f"only {sum(held)} of {len(held)} intervals of averaged photographs hold the truth"

    # The library's own thread, which ends as it is loaded, held a lock at the fork of one decoder in five.
    bits = struct.pack("<3H", 8, 8, 8)
    entries = ((256, 4, 1, 4), (257, 4, 1, 4), (258, 3, 3, 122), (259, 3, 1, 1), (262, 3, 1, 2), (273, 4, 1, 128), (277, 3, 1, 3), (278, 4, 1, 4), (279, 4, 1, 48))
    tiff = struct.pack("<2sHIH", b"II", 42, 8, len(entries)) + b"".join(struct.pack("<HHII", *entry) for entry in entries) + bytes(4)
    (folder / "small.tif").write_bytes(tiff + bits + bytes(range(48)))
    assert len(tiff) == 122
    for _ in range(20):
        subprocess.run([program, "compare", folder / "small.tif", folder / "small.tif"], check=True, capture_output=True, timeout=30)
print("one pixel: not identified; averaged: usable")
