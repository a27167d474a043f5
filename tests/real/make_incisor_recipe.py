#!/usr/bin/env python3
"""make_incisor_recipe.py REFERENCE FOLDER [--paths N] [--size PIXELS]: recipe of the micro-CT incisor, for `crownfit synthesize`.

The meshes come from REFERENCE/data/real (see PROVENANCE.md there). Enamel is its outer surface only and open at the neck,
dentine has small holes, the pulp is closed. Photographed as an extracted tooth: from the front on black and on white
(crossed polarisers on white), lit from behind, lit from the side, and one held out.
"""
import argparse
import csv
import json
import math
import shutil
from pathlib import Path


def sub(a, b):
    return [x - y for x, y in zip(a, b)]


def scaled(a, s):
    return [s * x for x in a]


def add(*vectors):
    return [sum(x) for x in zip(*vectors)]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def unit(a):
    return scaled(a, 1 / math.sqrt(dot(a, a)))


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("reference", type=Path)
    p.add_argument("folder", type=Path)
    p.add_argument("--paths", type=int, default=1000)
    p.add_argument("--size", type=int, default=96)
    options = p.parse_args()
    source = options.reference / "data/real/tooth-human-incisor-enamel-dentine-pulp"
    for name in ("mesh", "calib"):
        (options.folder / name).mkdir(parents=True, exist_ok=True)
    for name in ("enamel", "dentine", "pulp"):
        shutil.copyfile(source / f"{name}.ply", options.folder / f"mesh/{name}.ply")

    # The package's landmarks: four around the neck (lingual, mesial, buccal, distal), apex, incisal edge.
    rows = [[float(x) for x in row] for row in list(csv.reader(open(source / "landmarks.csv")))[1:]]
    lingual, buccal, apex, edge = rows[0], rows[2], rows[4], rows[5]
    down = unit(sub(edge, apex))  # an upper tooth hangs
    front = sub(buccal, lingual)
    front = unit(sub(front, scaled(down, dot(front, down))))
    right = cross(down, scaled(front, -1))
    centre = add(edge, scaled(down, -5.0))

    def place(x, y, z):
        """mm to the right of, below and in front of the middle of the crown."""
        return add(centre, scaled(right, x), scaled(down, y), scaled(front, z))

    def lamp(name, at, size, radiance):
        n = unit(sub(centre, place(*at)))
        u = unit(cross(down, n))
        v = cross(n, u)
        return {"name": name, "type": "rectangle", "frame": "object", "centre_mm": place(*at), "half_axis_u_mm": scaled(u, size),
                "half_axis_v_mm": scaled(v, size), "radiance_rgb": [radiance] * 3}

    rotation = [right, down, scaled(front, -1)]
    pose = {"rotation": rotation, "translation_mm": add(scaled([dot(r, centre) for r in rotation], -1), [0, 0, 250])}
    shot = lambda name, lights, backing="none", polarisation="none", use="fit": {
        "name": name, "file": f"photos/{name}.exr", "camera": "calib/camera.json", "camera_from_object": pose, "lights": lights,
        "polarisation": polarisation, "backing": backing, "exposure_scale": {"fixed": 1}, "use": use}
    tile = lambda rho: {"point_mm": place(0, 0, -7), "normal": front, "size_mm": 40, "reflectance_rgb": [rho] * 3}
    fixed = lambda **values: {key: {"fixed": value} for key, value in values.items()}
    recipe = {
        "format": "crownfit-recipe/1",
        "object": {
            "layers": [
                {"name": "enamel", "surface": "mesh/enamel.ply"} | fixed(ior=1.63, g=0.68, reduced_scattering_per_mm=2.0, absorption_per_mm=[0.01, 0.02, 0.05]),
                {"name": "dentine", "surface": "mesh/dentine.ply"} | fixed(ior=1.54, g=0.93, reduced_scattering_per_mm=2.0, absorption_per_mm=[0.03, 0.07, 0.2]),
                {"name": "pulp", "surface": "mesh/pulp.ply"} | fixed(ior=1.36, g=0.9, reduced_scattering_per_mm=1.0, absorption_per_mm=[0.1, 0.4, 0.8])],
            "surface": fixed(roughness=0.2),
            "backings": {"black": tile(0.03), "white": tile(0.9)}},
        "channels": [{"name": "R", "wavelength_nm": 600}, {"name": "G", "wavelength_nm": 540}, {"name": "B", "wavelength_nm": 450}],
        "light_rig": "calib/light_rig.json",
        "photographs": [shot("front_black", ["left", "right"], "black"), shot("front_white", ["left", "right"], "white", "cross"),
                        shot("back", ["behind"]), shot("edge", ["side"], "black"), shot("heldout", ["left", "side"], "black", use="holdout")],
        "synthesis": {"paths_per_pixel": options.paths, "noise": {"relative": 0.01, "floor": 0.0005}, "seed": 11, "initial_factor": 1.5,
                      "free": ["enamel.reduced_scattering_per_mm", "enamel.absorption_per_mm", "dentine.reduced_scattering_per_mm",
                               "dentine.absorption_per_mm", "surface.roughness"]}}
    size = options.size
    files = {"recipe.json": recipe,
             "calib/camera.json": {"format": "crownfit-camera/1", "width": size, "height": size, "fx": size * 250 / 14, "fy": size * 250 / 14,
                                   "cx": size / 2, "cy": size / 2, "distortion": [0, 0, 0, 0, 0]},
             "calib/light_rig.json": {"format": "crownfit-light-rig/1", "lights": [
                 lamp("left", (-110, 0, 110), 60, 1.2), lamp("right", (110, 0, 110), 60, 1.2), lamp("side", (150, -20, 30), 70, 1.8),
                 lamp("behind", (0, 0, -130), 110, 1.0)]}}
    for name, content in files.items():
        (options.folder / name).write_text(json.dumps(content, indent=1) + "\n")


if __name__ == "__main__":
    main()
