#!/usr/bin/env python3
"""views_benchmark.py CROWNFIT -o DIR: how long an import and a check take of a set of many views with a lamp each.

A set of 50 photographs of 436 x 291 pixels is rendered by `shader`: the cube of datasets_synthetic/cube from cameras all
around, each with a small lamp of its own. Then `crownfit capture import` reads it as transforms.json, and `crownfit check`
checks the capture. Prints the seconds and the memory of both. Photographs that exist are kept.
"""
import argparse
import json
import math
import os
import random
import subprocess
import sys
import time
from pathlib import Path

import tables

CUBE = Path(__file__).resolve().parent.parent / "datasets_synthetic/cube/even"
WIDTH, HEIGHT = 436, 291
DISTANCE, SHOWN = 300.0, 74.0  # of the cameras, mm; what a picture shows from top to bottom at the centre, mm
LAMP_DISTANCE, LAMP_RADIUS = 400.0, 14.0  # mm


def arguments():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("crownfit", help="the executable")
    p.add_argument("-o", "--output", type=Path, required=True, metavar="DIR", help="folder for the set; it is created if missing")
    p.add_argument("--views", type=int, default=50, help="photographs (default 50)")
    return p.parse_args()


def scaled(v, length):
    return [length * x / math.hypot(*v) for x in v]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def directions(count):
    """From the centre to the cameras and to their lamps, 10 to 110 degrees apart."""
    chance = random.Random(20)
    for k in range(count):
        z, turn = 1 - (2 * k + 1) / count, k * math.pi * (3 - math.sqrt(5))
        camera = [math.sqrt(1 - z * z) * math.cos(turn), math.sqrt(1 - z * z) * math.sin(turn), z]
        aside = scaled(cross(camera, [chance.gauss(0, 1) for _ in range(3)]), 1)
        angle = math.radians(10 + 100 * chance.random())
        yield camera, [math.cos(angle) * c + math.sin(angle) * a for c, a in zip(camera, aside)]


def write(path, content):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(content, indent=1) + "\n")


def make_set(crownfit, folder, views):
    """The source in folder/source, its photographs rendered from a capture in folder/rendered."""
    names = [f"view_{k:02}" for k in range(views)]
    fx = HEIGHT * DISTANCE / SHOWN
    frames, lights, photographs = [], [], []
    for name, (camera, lamp) in zip(names, directions(views)):
        right = scaled(cross([0, 0, 1], camera), 1)
        up = cross(camera, right)
        columns = right, up, camera
        frames.append({"file_path": f"images/{name}.exr", "transform_matrix": [[c[i] for c in columns] + [DISTANCE * camera[i]] for i in range(3)] + [[0, 0, 0, 1]]})
        lights.append({"name": name, "type": "point", "frame": "object", "position_mm": scaled(lamp, LAMP_DISTANCE), "radius_mm": LAMP_RADIUS, "radiant_intensity_rgb": [LAMP_DISTANCE**2] * 3})
        rotation = [right, [-x for x in up], [-x for x in camera]]  # a camera looks along +z with y down
        photographs.append({"name": name, "file": f"{name}.exr", "camera": "camera.json", "lights": [name], "camera_from_object": {"rotation": rotation, "translation_mm": [0, 0, DISTANCE]}})
    layer = {**json.loads((CUBE / "truth.json").read_text())["layers"][0], "surface": str(CUBE / "cube.ply")}
    for key in ("ior", "g"):
        layer[key] = {"fixed": layer[key]}
    for key in ("reduced_scattering_per_mm", "absorption_per_mm"):
        layer[key] = {"initial": layer[key]}
    rendered, source = folder / "rendered", folder / "source"
    write(rendered / "light_rig.json", {"format": "crownfit-light-rig/1", "lights": lights})
    write(rendered / "camera.json", {"format": "crownfit-camera/1", "width": WIDTH, "height": HEIGHT, "fx": fx, "fy": fx, "cx": WIDTH / 2, "cy": HEIGHT / 2})
    write(rendered / "capture.json", {"format": "crownfit-capture/1", "object": {"layers": [layer], "surface": {"roughness": {"initial": 0.2}, "wetness": {"fixed": 0}}}, "light_rig": "light_rig.json", "photographs": photographs})
    write(source / "transforms.json", {"camera_model": "PINHOLE", "w": WIDTH, "h": HEIGHT, "fl_x": fx, "fl_y": fx, "cx": WIDTH / 2, "cy": HEIGHT / 2, "frames": frames})
    if not all((source / "images" / f"{name}.exr").exists() for name in names):
        subprocess.run([crownfit, "render", rendered, "-o", source / "images", "--noise", "0.01", "--half", "--progress", "none"], check=True)
    return source, rendered / "light_rig.json"


def timed(*command):
    """Seconds, seconds of processor, and MiB resident at most."""
    begin = time.time()
    process = subprocess.Popen([str(c) for c in command], stdout=subprocess.DEVNULL)
    _, status, used = os.wait4(process.pid, 0)
    if os.waitstatus_to_exitcode(status) not in (0, 1):
        sys.exit(f"{command[1]} failed")
    return time.time() - begin, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024


def main():
    options = arguments()
    source, lights = make_set(options.crownfit, options.output, options.views)
    capture = options.output / "capture"
    rows = []
    for what, command in (("crownfit capture import", ["capture", "import", source / "transforms.json", "-o", capture, "--mesh", f"cube={CUBE / 'cube.ply'}", "--lights", lights]),
                          ("crownfit check", ["check", capture])):
        seconds, processor, memory = timed(options.crownfit, *command, "--progress", "none")
        rows.append([what, f"{seconds:.1f} s", f"{processor:.1f} s", f"{memory:.0f} MiB"])
        print(*rows[-1], sep="  ", flush=True)
    tables.write("views", title="Sets of many views", command="./dev bench views", keyed_by=1,
                 shows=f"What an import and a check take of {options.views} photographs of {WIDTH} x {HEIGHT} pixels, each with a lamp of its own.",
                 columns=["command", "time", "of processor", "memory"], rows=rows)


if __name__ == "__main__":
    main()
