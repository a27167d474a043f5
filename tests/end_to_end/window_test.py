#!/usr/bin/env python3
"""window_test.py CROWNFIT CAPTURE: the window of `crownfit view` as a user's hands meet it, on a virtual screen (Xvfb, xdotool):
a slider, a dragged lamp, a turned crown, the views, what it saves, how it closes. Exit code 77: Xvfb or xdotool is absent."""
import json
import os
import struct
import subprocess
import sys
import tempfile
import time
import zlib
from pathlib import Path

program, capture = sys.argv[1], Path(sys.argv[2])
sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "support"))
from virtual_hand import Viewer, go_to_virtual_screen, hand  # noqa: E402

go_to_virtual_screen(850, 1250)


def pixels_of(file):
    """Width, height and rows of RGB bytes of an 8-bit PNG."""
    data, at, packed = file.read_bytes(), 8, b""
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        body = data[at + 8:at + 8 + length]
        if kind == b"IHDR":
            width, height, depth, colour = struct.unpack(">IIBB", body[:10])
            assert (depth, colour) == (8, 2), (depth, colour)
        if kind == b"IDAT":
            packed += body
        at += 12 + length
    raw, stride, rows, above = zlib.decompress(packed), 3 * width, [], bytearray(3 * width)
    for y in range(height):
        kind, line = raw[y * (stride + 1)], bytearray(raw[y * (stride + 1) + 1:(y + 1) * (stride + 1)])
        for i in range(stride):
            left, up, corner = (line[i - 3] if i >= 3 else 0), above[i], (above[i - 3] if i >= 3 else 0)
            if kind == 1:
                line[i] = (line[i] + left) & 255
            elif kind == 2:
                line[i] = (line[i] + up) & 255
            elif kind == 3:
                line[i] = (line[i] + (left + up) // 2) & 255
            elif kind == 4:
                guess = left + up - corner
                line[i] = (line[i] + min((left, up, corner), key=lambda v: abs(guess - v))) & 255
        rows.append(line)
        above = line
    return width, height, rows


class Picture:
    def __init__(self, file):
        self.width, self.height, self.rows = pixels_of(file)

    def mean(self, channel):
        return sum(sum(row[channel::3]) for row in self.rows) / (self.width * self.height)

    def centroid(self):
        """Of green, across: 0 at the left edge, 1 at the right."""
        weights = [0] * self.width
        for row in self.rows:
            for x, v in enumerate(row[1::3]):
                weights[x] += v
        return sum(x * w for x, w in enumerate(weights)) / sum(weights) / self.width

    def difference(self, other):
        return sum(abs(a - b) for one, two in zip(self.rows, other.rows) for a, b in zip(one, two)) / (3 * self.width * self.height)

    def share(self, first, colours):
        """Of the pixels of any of the colours, those of the first ones."""
        counts = [0] * len(colours)
        for row in self.rows:
            for x in range(0, len(row), 3):
                for i, colour in enumerate(colours):
                    counts[i] += all(abs(row[x + c] - colour[c]) <= 2 for c in range(3))
        assert sum(counts) > 500, counts
        return sum(counts[:first]) / sum(counts)


def save(viewer):
    png, exr = viewer.save_picture()
    assert exr.stat().st_size > 1000
    return Picture(png)


began = time.time()
with tempfile.TemporaryDirectory() as folder:
    folder = Path(folder)
    viewer = Viewer(program, capture / "truth.json", "--capture", capture, "--photograph", "front", "--size", "850x1250", "--save-to", folder)
    time.sleep(0.5)
    fitted = save(viewer)
    assert fitted.mean(0) > fitted.mean(2) > 5, "the tooth is not there, or not yellowish"

    # More absorption of blue in the dentine: less blue; red stays.
    slider = "dentine.absorption_per_mm.B"
    viewer.drag(viewer.middle(slider), (viewer.layout[slider][2] * 0.25, 0))
    yellow = save(viewer)
    print(f"blue {fitted.mean(2):.2f} -> {yellow.mean(2):.2f}, red {fitted.mean(0):.2f} -> {yellow.mean(0):.2f}")
    assert yellow.mean(2) < 0.9 * fitted.mean(2) and abs(yellow.mean(0) / fitted.mean(0) - 1) < 0.02

    # What is saved can be read again and says that it was set by hand.
    hand("key", "m")
    saved = Path(viewer.line())
    material = json.loads(saved.read_text())
    moved = material["layers"][1]["absorption_per_mm"]
    truth = json.loads((capture / "truth.json").read_text())["layers"][1]["absorption_per_mm"]
    assert moved["status"] == "fixed" and moved["value"][2] > 2 * truth[2] and moved["value"][:2] == truth[:2], moved
    subprocess.run([program, "view", saved, "--capture", capture, "--screenshot", folder / "again.png"], check=True, capture_output=True)

    # Reset: the same picture again, to the last bit.
    hand("mousemove", *viewer.middle("all.best"), "click", "1")
    time.sleep(0.5)
    assert save(viewer).difference(fitted) == 0, "reset does not lead back"

    # The lamps follow the right button to the right; R leads back.
    viewer.drag(viewer.middle("crown"), (180, 0), button=3)
    turned = save(viewer)
    print(f"brightness lies at {fitted.centroid():.3f}, lamps dragged to the right: {turned.centroid():.3f}")
    assert turned.centroid() > fitted.centroid() + 0.02
    hand("key", "r")
    time.sleep(0.5)
    assert save(viewer).difference(fitted) == 0, "R does not lead back from turned lamps"

    # The difference at the values that the photograph was made with, by the legend's colours: its noise alone, 1 %.
    hand("key", "v")
    hand("key", "v")
    difference = save(viewer)
    acceptable = difference.share(2, [(33, 102, 171), (145, 196, 222), (252, 219, 158), (240, 138, 97), (179, 23, 43)])
    print(f"difference: {100 * acceptable:.1f} % of the pixels below 1.8")
    assert acceptable > 0.95, acceptable

    # Side by side, wipe, thickness and back: each another picture.
    last = difference
    for view in ("side by side", "wipe", "thickness map", "viewer"):
        hand("key", "v")
        now = save(viewer)
        assert now.difference(last) > 1, view
        last = now
    assert last.difference(fitted) == 0

    # The crown turns with the left button and has another outline.
    viewer.drag(viewer.middle("crown"), (150, 0))
    assert save(viewer).difference(fitted) > 2, "the crown does not turn"
    code = viewer.close()
    assert code == 0, code
assert not subprocess.run([program, "view", capture / "truth.json"], capture_output=True).returncode == 0
alone = {k: v for k, v in os.environ.items() if k != "DISPLAY"}
refused = subprocess.run([program, "view", capture / "truth.json", "--capture", capture], capture_output=True, text=True, env=alone)
assert refused.returncode == 2 and "--screenshot" in refused.stderr, refused.stderr
print(f"{time.time() - began:.0f} s")
