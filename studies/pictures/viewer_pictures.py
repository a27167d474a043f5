#!/usr/bin/env python3
"""viewer_pictures.py CROWNFIT MATERIAL CAPTURE FOLDER: the pictures of the viewer's window in docs/images, on a virtual screen."""
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests/support"))
from virtual_hand import Viewer, go_to_virtual_screen, hand  # noqa: E402

WIDTH, HEIGHT = 1400, 860
go_to_virtual_screen(WIDTH, HEIGHT)
program, material, capture, images = sys.argv[1], *map(Path, sys.argv[2:])
with tempfile.TemporaryDirectory() as folder:
    viewer = Viewer(program, material, "--capture", capture, "--photograph", "front_white", "--size", f"{WIDTH}x{HEIGHT}", "--save-to", folder)

    def keep(name, *, after_keys):
        for key in after_keys:
            hand("key", key)
        time.sleep(1)
        hand("key", "p")
        picture = images / f"view_{name}.png"
        picture.write_bytes(Path(viewer.line()).read_bytes())
        print(f"{picture}: {picture.stat().st_size / 1024:.0f} kB")
        assert picture.stat().st_size < 400 * 1024

    hand("mousemove", 20, HEIGHT - 20)  # away from what lights up below the pointer
    keep("difference", after_keys="vv")
    keep("window", after_keys="v")
    keep("thickness", after_keys="vv")
    sys.exit(viewer.close())
