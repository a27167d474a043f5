#!/usr/bin/env python3
"""make_peer_captures.py DIR: writes six small captures for renderers to agree on, unpolarised, everything known; their
truth.json is the material. All but coloured_disc are grey.

ceramic_disc   radius 5 mm, 1 mm thick, smooth. Front lit by a dome; by a large lamp; from behind, with a white tile.
cored_sphere   radius 4 mm with a concentric core of 3 mm of other indices and scattering, smooth. Dome; large side light.
nested_crown   incisor-like crown 10 mm high around a similar body of dentine, roughness 0.3. Dome and a softbox at once.
coloured_disc  as ceramic_disc, but channels scatter 1, 2, 3 and absorb 0.02, 0.1, 0.4 / mm. Dome.
open_sphere    a scan open at the neck, smooth. Dome.
environment    sphere of 4 mm, smooth, in a sky that is brightest to its right and above.

Lamps are large, since paths that leave through a dielectric boundary find them by chance only. Scattering is no denser
than 10/mm: Mitsuba (single precision) starts rays some 0.0005 mm off a surface, which skips that share of a free path.
The white tile lies wholly behind the disc, so the camera sees it through the disc only. Lengths in mm.
"""
import json
import math
import sys
from pathlib import Path

import numpy as np

PIXELS = 48
DISTANCE = 250.0  # mm from the camera to the object's origin


def turn(degrees, axis):
    """Rotation about x (0), y (1) or z (2)."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    matrix = np.eye(3)
    i, j = [(1, 2), (2, 0), (0, 1)][axis]
    matrix[i, i] = matrix[j, j] = c
    matrix[i, j], matrix[j, i] = -s, s
    return matrix


FACING = np.diag([1.0, -1.0, -1.0])  # camera on the object's +z side, +y up in the picture


def shell(rings, first, last):
    """Closed surface through rings of equal size, which run anticlockwise as seen from the last, and its two poles."""
    n, count = len(rings[0]), len(rings)
    vertices = np.concatenate([np.array(rings, dtype=float).reshape(-1, 3), [first, last]])
    faces, bottom, top = [], n * count, n * count + 1
    for k in range(count - 1):
        for i in range(n):
            a, b, c, d = k * n + i, k * n + (i + 1) % n, (k + 1) * n + (i + 1) % n, (k + 1) * n + i
            faces += [(a, b, c), (a, c, d)]
    for i in range(n):
        j = (i + 1) % n
        faces += [(bottom, j, i), (top, (count - 1) * n + i, (count - 1) * n + j)]
    faces = np.array(faces)
    corners = vertices[faces]
    assert np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) > 0, "the mesh is inside out"
    return vertices, faces


def circle(radius, z, n):
    angle = 2 * math.pi * np.arange(n) / n
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(n, z)], axis=1)


def disc(radius, thickness, n=128):
    """Flat cylinder about z, centred on the origin."""
    h = 0.5 * thickness
    return shell([circle(radius, -h, n), circle(radius, h, n)], (0, 0, -h), (0, 0, h))


def sphere(radius, n=96):
    """Rings of latitude about z."""
    polar = math.pi * np.arange(1, n // 2) / (n // 2)
    return shell([circle(radius * math.sin(t), -radius * math.cos(t), n) for t in polar], (0, 0, -radius), (0, 0, radius))


def crown(inset, n=96, levels=48):
    """Incisor-like body along y, about 8 x 10 x 6 mm: superelliptic sections that narrow to a biting edge. `inset` (mm)
    draws its surface in; that of a larger inset lies strictly inside."""
    height = 10.0 - 2 * inset
    rings = []
    for u in 0.5 - 0.5 * np.cos(math.pi * np.arange(1, levels) / levels):  # closer near the ends
        y = height * (u - 0.5)
        s = y / 10.0 + 0.5  # 0 at the neck, 1 at the biting edge, of the body without inset
        half_width = 3.4 + 0.8 * math.sin(0.5 * math.pi * s) - inset
        half_depth = 0.9 + 2.2 * (1 - s) ** 1.2 - 0.8 * inset
        cap = (1 - abs(2 * u - 1) ** 8) ** 0.5  # rounds both ends
        angle = -2 * math.pi * np.arange(n) / n  # anticlockwise as seen from +y
        c, t = np.cos(angle), np.sin(angle)
        r = cap * (np.abs(c) ** 2.4 + np.abs(t) ** 2.4) ** (-1 / 2.4)
        rings.append(np.stack([half_width * r * c, np.full(n, y), 0.5 * math.sin(math.pi * s) + half_depth * r * t], axis=1))
    ends = [(0, y, 0.5 * math.sin(math.pi * (y / 10.0 + 0.5))) for y in (-0.5 * height, 0.5 * height)]
    return shell(rings, *ends)


def write_ply(path, mesh):
    """Binary PLY in single precision, so that every reader sees the same numbers."""
    vertices, faces = mesh
    path.parent.mkdir(parents=True, exist_ok=True)
    packed = np.empty(len(faces), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    packed["count"], packed["corners"] = 3, faces
    header = (f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\nproperty float x\nproperty float y\nproperty float z\n"
              f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n")
    path.write_bytes(header.encode() + vertices.astype("<f4").tobytes() + packed.tobytes())


def layer(name, ior, g, reduced_scattering, absorption):
    """Coefficients: one number, or one per channel."""
    def three(x):
        return list(x) if isinstance(x, (list, tuple)) else [x] * 3
    return {"name": name, "ior": ior, "g": g, "reduced_scattering_per_mm": three(reduced_scattering), "absorption_per_mm": three(absorption)}


def stated(layer):
    """A layer as a capture has it, with values that are surely allowed there: those that count are the truth's."""
    def fixed(v, least):
        return {"fixed": [max(x, least) for x in v] if isinstance(v, list) else v}
    return {"name": layer["name"], "surface": f"mesh/{layer['name']}.ply", "ior": fixed(layer["ior"], 1), "g": fixed(layer["g"], 0),
            "reduced_scattering_per_mm": fixed(layer["reduced_scattering_per_mm"], 1e-3), "absorption_per_mm": fixed(layer["absorption_per_mm"], 1e-5)}


def photograph(name, lights, rotation=FACING, backing="none", scenery=()):
    return {"name": name, "file": f"photos/{name}.exr", "camera": "calib/camera.json",
            "camera_from_object": {"rotation": rotation.tolist(), "translation_mm": [0, 0, DISTANCE]},
            "lights": lights, "polarisation": "none", "backing": backing, "scenery": list(scenery), "exposure_scale": {"fixed": 1.0}}


def write_capture(folder, layers, meshes, lights, photographs, roughness=0.0, backings=None, scenery=(), width_mm=12.0, pixels=PIXELS,
                  centre=None, outside_ior=1.0):
    """A capture folder. layers: from layer(); meshes: name -> (vertices, faces); width_mm: what the picture spans at the
    origin; centre: principal point (pixels)."""
    folder = Path(folder)
    (folder / "calib").mkdir(parents=True, exist_ok=True)
    for name, mesh in meshes.items():
        write_ply(folder / f"mesh/{name}.ply", mesh)
    channels = [{"name": "R", "wavelength_nm": 600}, {"name": "G", "wavelength_nm": 540}, {"name": "B", "wavelength_nm": 450}]
    truth = {"format": "crownfit-material/1", "channels": channels, "layers": layers, "surface": {"roughness": roughness, "wetness": 0}}
    capture = {"format": "crownfit-capture/1",
               "object": {"layers": [stated(x) for x in layers], "surface": {"roughness": {"fixed": roughness}}, "scenery": list(scenery),
                          "backings": backings or {}, "outside_ior": outside_ior},
               "channels": channels,
               "light_rig": "calib/light_rig.json", "photographs": photographs}
    focal = pixels * DISTANCE / width_mm
    cx, cy = centre or (pixels / 2, pixels / 2)
    camera = {"format": "crownfit-camera/1", "width": pixels, "height": pixels, "fx": focal, "fy": focal, "cx": cx, "cy": cy,
              "distortion": [0, 0, 0, 0, 0]}
    for path, content in (("capture.json", capture), ("truth.json", truth), ("calib/camera.json", camera),
                          ("calib/light_rig.json", {"format": "crownfit-light-rig/1", "lights": lights})):
        (folder / path).write_text(json.dumps(content, indent=1) + "\n")
    return folder


def dome(radiance=1 / math.pi):
    return {"name": "dome", "type": "dome", "frame": "object", "radiance_rgb": [radiance] * 3}


def lamp(name, centre, radius, radiance):
    """Disk that shines towards the origin."""
    return {"name": name, "type": "disk", "frame": "object", "centre_mm": centre, "normal": [-x for x in centre],
            "radius_mm": radius, "radiance_rgb": [radiance] * 3}


def softbox(name, centre, half_size, radiance):
    """Square that shines towards the origin, its sides as upright (y) as can be."""
    n = -np.array(centre) / np.linalg.norm(centre)
    u = np.cross([0, 1, 0], n)
    u *= half_size / np.linalg.norm(u)
    v = np.cross(n, u)
    return {"name": name, "type": "rectangle", "frame": "object", "centre_mm": centre, "half_axis_u_mm": u.tolist(),
            "half_axis_v_mm": v.tolist(), "radiance_rgb": [radiance] * 3}


def ceramic_disc(folder):
    tilted = FACING @ turn(25, 0)
    tile = {"point_mm": [0, 0, -1], "normal": [0, 0, 1], "size_mm": 6, "reflectance_rgb": [0.8] * 3}
    return write_capture(
        folder, [layer("ceramic", 1.54, 0.8, 2.0, 0.05)], {"ceramic": disc(5, 1)},
        [dome(), lamp("front", [-50, 30, 120], 80, 1.0), lamp("back", [20, 10, -100], 70, 1.0)],
        [photograph("dome", ["dome"], tilted), photograph("lamp", ["front"], tilted), photograph("back", ["back", "front"], backing="white")],
        backings={"white": tile})


def cored_sphere(folder):
    return write_capture(
        folder, [layer("shell", 1.63, 0.68, 2.0, 0.02), layer("core", 1.54, 0.8, 1.5, 0.1)], {"shell": sphere(4), "core": sphere(3)},
        [dome(), softbox("side", [90, 20, 40], 70, 1.0)], [photograph("dome", ["dome"]), photograph("side", ["side"])], width_mm=10.0)


def coloured_disc(folder):
    return write_capture(folder, [layer("ceramic", 1.54, 0.8, [1, 2, 3], [0.02, 0.1, 0.4])], {"ceramic": disc(5, 1)}, [dome()],
                         [photograph("dome", ["dome"], FACING @ turn(25, 0))])


def write_hdr(path, radiance):
    """Radiance's RGBE without compression, of one number a pixel (below 1)."""
    height, width = radiance.shape
    mantissa = np.clip(np.round(radiance * 256), 0, 255).astype(np.uint8)
    pixels = np.stack([mantissa] * 3 + [np.full_like(mantissa, 128)], axis=-1)  # exponent 0
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n" % (height, width) + pixels.tobytes())


def environment(folder):
    rows, columns = np.indices((64, 128)) + 0.5
    polar, azimuth = np.pi * rows / 64, 2 * np.pi * (0.5 - columns / 128)  # +y up, centre along +z, a quarter to its left +x
    x, y, z = np.sin(polar) * np.sin(azimuth), np.cos(polar), np.sin(polar) * np.cos(azimuth)
    write_hdr(Path(folder) / "calib/sky.hdr", 0.35 + 0.2 * x + 0.1 * y + 0.05 * z)
    sky = {"name": "sky", "type": "environment", "frame": "object", "file": "sky.hdr", "radiance_scale_rgb": [1, 1, 1]}
    return write_capture(folder, [layer("ceramic", 1.54, 0.8, 2.0, 0.05)], {"ceramic": sphere(4)}, [sky], [photograph("sky", ["sky"])], width_mm=10.0)


def open_sphere(folder):
    vertices, faces = sphere(4)
    faces = faces[(vertices[faces][:, :, 1] > -2.5).any(axis=1)]  # open below: the neck returns what dentine beyond it would
    return write_capture(folder, [layer("dentine", 1.54, 0.8, 1.0, 0.05)], {"dentine": (vertices, faces)}, [dome()],
                         [photograph("dome", ["dome"], FACING @ turn(-35, 0))], width_mm=10.0)


def nested_crown(folder):
    return write_capture(
        folder, [layer("enamel", 1.63, 0.68, 1.2, 0.02), layer("dentine", 1.54, 0.8, 2.0, 0.08)],
        {"enamel": crown(0), "dentine": crown(0.8)}, [dome(0.2 / math.pi), softbox("left", [-90, 30, 60], 80, 1.0)],
        [photograph("front", ["dome", "left"], FACING @ turn(20, 1))], roughness=0.3)


CAPTURES = {"ceramic_disc": ceramic_disc, "cored_sphere": cored_sphere, "coloured_disc": coloured_disc, "open_sphere": open_sphere, "environment": environment, "nested_crown": nested_crown}


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    for name, write in CAPTURES.items():
        print(write(Path(sys.argv[1]) / name))


if __name__ == "__main__":
    main()
