"""Turns one photograph of a crownfit capture into a Mitsuba 3 scene and renders it.

Units as in the capture: millimetres, 1/mm, pixel = exposure_scale x pi x radiance. Covered: nested closed meshes, each
layer with a surface of its own, filled with a homogeneous medium of Henyey-Greenstein scattering; smooth or GGX-rough
outermost boundary (the inner ones are smooth); dome, disk and rectangle lights; opaque scenery; one backing tile.
Everything else is refused (Unsupported). One channel is rendered at a time, as grey.

What has to be said to Mitsuba so that it means what crownfit means:
* Lights of crownfit block nothing and the camera does not see them. Area emitters therefore carry the `null` BSDF
  (rays run through and collect the radiance on the way) and the integrator hides emitters at depth 0. A ray that came
  through the object does see them, in both programs.
* An inner surface lies between two media: its interior AND its exterior medium are named, as a path takes its medium
  from the surface it crosses; its indices are those of the two layers, not those against air.
* `sample_emitters` of a medium is off: a line to a light always meets a dielectric boundary first, so it would only
  cost time. Lights are then found by the paths that leave the object.
* g > 0 scatters forward in both. sigma_t = scattering + absorption, albedo = scattering / sigma_t.
* Radiance changes by n^2 at each boundary; camera and lights are both outside, so nothing is left of it.
* Russian roulette kills at least 5 % at every event once it has begun, so it begins late.
* Mitsuba's camera looks along +z with x to the left and y up; crownfit's has x to the right and y down. Its principal
  point moves against the picture.
"""
import json
import math
import random
import re
from pathlib import Path

import drjit
import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")  # needs no LLVM; as fast here as llvm_ad_mono, whose lanes wait for the longest path

import rough_boundary  # noqa: E402  (its base class belongs to the variant)

rough_boundary.register()

SMOOTH_BELOW = 0.001  # roughness that crownfit treats as none


class Unsupported(Exception):
    """The capture holds something this writer has no words for."""


def read_json(path):
    """JSON with // comments."""
    return json.loads(re.sub(r'("(?:\\.|[^"\\])*")|//[^\n]*', lambda m: m.group(1) or "", Path(path).read_text()))


def value(parameter, channel=1):
    """Fixed or initial value of a capture's parameter, of one channel."""
    v = parameter["fixed"] if "fixed" in parameter else parameter["initial"]
    return v[channel] if isinstance(v, list) else v


def grey(x):
    return {"type": "rgb", "value": [float(x)] * 3}


def columns(x, y, z, origin=(0, 0, 0)):
    """The transform whose matrix has these columns."""
    matrix = np.eye(4)
    matrix[:3] = np.array([x, y, z, origin], dtype=float).T
    return mi.ScalarTransform4f(matrix)


def tangents(n):
    """The two directions along which crownfit lays the sides of a tile (Duff et al. 2017)."""
    sign = math.copysign(1.0, n[2])
    a = -1.0 / (sign + n[2])
    b = n[0] * n[1] * a
    return np.array([1 + sign * n[0] ** 2 * a, sign * b, -sign * n[0]]), np.array([b, sign + n[1] ** 2 * a, -n[1]])


def medium(layer, channel):
    """Homogeneous Henyey-Greenstein medium of a layer."""
    if value(layer.get("isotropic_fraction", {"fixed": 0}), channel):
        raise Unsupported("isotropic_fraction other than 0")
    g = value(layer["g"], channel)
    scattering = value(layer["reduced_scattering_per_mm"], channel) / (1 - g)
    extinction = scattering + value(layer["absorption_per_mm"], channel)
    return {"type": "homogeneous", "sigma_t": extinction, "albedo": scattering / extinction, "sample_emitters": False,
            "phase": {"type": "hg", "g": g}}


def boundary(inside, outside, roughness):
    """BSDF between two indices. Not Mitsuba's `roughdielectric`: see rough_boundary.py."""
    if inside == outside:
        return {"type": "null"}
    if roughness < SMOOTH_BELOW:
        return {"type": "dielectric", "int_ior": inside, "ext_ior": outside}
    return {"type": "crownfit_rough", "alpha": roughness, "int_ior": inside, "ext_ior": outside}


def mesh(path):
    """Faceted triangle mesh; the order of its corners says what is outside."""
    kind = Path(path).suffix[1:].lower()
    if kind not in ("ply", "obj"):
        raise Unsupported(f"mesh format {kind}")
    return {"type": kind, "filename": str(path), "face_normals": True}


def light(spec, object_from_camera, channel):
    """Emitter of one entry of the light rig; area lights shine to one side."""
    radiance = grey(spec["radiance_rgb"][channel] * value(spec.get("intensity_scale", {"fixed": 1}), channel)) if "radiance_rgb" in spec else None
    if spec["type"] == "dome":
        return {"type": "constant", "radiance": radiance}
    move = object_from_camera if spec.get("frame") == "camera" else np.eye(4)
    point, turn = (lambda p: move[:3, :3] @ p + move[:3, 3]), (lambda d: move[:3, :3] @ d)
    if spec["type"] == "disk":
        n = turn(spec["normal"]) / np.linalg.norm(spec["normal"])
        u, v = (spec["radius_mm"] * t for t in tangents(n))
    elif spec["type"] == "rectangle":
        u, v = turn(spec["half_axis_u_mm"]), turn(spec["half_axis_v_mm"])
        n = np.cross(u, v) / np.linalg.norm(np.cross(u, v))
    else:
        raise Unsupported(f"light of type {spec['type']}")
    return {"type": spec["type"], "to_world": columns(u, v, n, point(spec["centre_mm"])), "bsdf": {"type": "null"},
            "emitter": {"type": "area", "radiance": radiance}}


def scene_of(capture_folder, photograph, channel=1):
    """(Mitsuba scene as a dict, factor from its radiance to the pixel) of the photograph of this name."""
    folder = Path(capture_folder)
    capture = read_json(folder / "capture.json")
    shot = next(p for p in capture["photographs"] if p["name"] == photograph)
    camera = read_json(folder / shot["camera"])
    if shot.get("polarisation", "none") != "none" or any(camera.get("distortion", [])) or camera["fx"] != camera["fy"]:
        raise Unsupported("polarisers, lens distortion, pixels that are not square")
    camera_from_object = np.eye(4)
    camera_from_object[:3, :3] = shot["camera_from_object"]["rotation"]
    camera_from_object[:3, 3] = shot["camera_from_object"]["translation_mm"]
    object_from_camera = np.linalg.inv(camera_from_object)
    width, height = camera["width"], camera["height"]
    scene = {
        "type": "scene",
        # -1: no end; roulette only where a path would otherwise run for ever
        "integrator": {"type": "volpath", "max_depth": -1, "rr_depth": 100000, "hide_emitters": True},
        "sensor": {
            "type": "perspective", "to_world": mi.ScalarTransform4f(object_from_camera @ np.diag([-1.0, -1, 1, 1])),
            "fov_axis": "x", "fov": math.degrees(2 * math.atan(0.5 * width / camera["fx"])), "near_clip": 1.0, "far_clip": 1e5,
            "principal_point_offset_x": 0.5 - camera["cx"] / width, "principal_point_offset_y": 0.5 - camera["cy"] / height,
            "film": {"type": "hdrfilm", "width": width, "height": height, "pixel_format": "luminance", "component_format": "float32",
                     "rfilter": {"type": "box"}},
            "sampler": {"type": "independent"}}}

    layers = capture["object"]["layers"]
    surface = capture["object"].get("surface", {})
    if value(surface.get("wetness", {"fixed": 0}), channel):
        raise Unsupported("wetness")
    ior = [capture["object"].get("outside_ior", 1.0)] + [value(layer["ior"], channel) for layer in layers]
    for i, layer in enumerate(layers):
        if "surface" not in layer:
            raise Unsupported(f"layer {layer['name']} has no surface of its own")
        scene[f"medium_{i}"] = medium(layer, channel)
        scene[f"surface_{i}"] = mesh(folder / layer["surface"]) | {
            "bsdf": boundary(ior[i + 1], ior[i], value(surface["roughness"], channel) if i == 0 else 0.0),
            "interior": {"type": "ref", "id": f"medium_{i}"}}
        if i > 0:
            scene[f"surface_{i}"]["exterior"] = {"type": "ref", "id": f"medium_{i - 1}"}

    for thing in capture["object"].get("scenery", []):
        if thing["name"] in shot.get("scenery", []):
            scene[f"scenery_{thing['name']}"] = mesh(folder / thing["mesh"]) | {"bsdf": tile_bsdf(thing["reflectance_rgb"][channel])}
    if shot.get("backing", "none") != "none":
        tile = capture["object"]["backings"][shot["backing"]]
        n = np.array(tile["normal"]) / np.linalg.norm(tile["normal"])
        u, v = (0.5 * tile.get("size_mm", 30.0) * t for t in tangents(n))
        scene["backing"] = {"type": "rectangle", "to_world": columns(u, v, n, tile["point_mm"]), "bsdf": tile_bsdf(tile["reflectance_rgb"][channel])}

    rig = {spec["name"]: spec for spec in read_json(folder / capture["light_rig"])["lights"]}
    for name in shot["lights"]:
        scene[f"light_{name}"] = light(rig[name], object_from_camera, channel)
    return scene, math.pi * value(shot.get("exposure_scale", {"fixed": 1}), channel)


def tile_bsdf(reflectance):
    return {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": grey(reflectance)}}


def render(scene, factor, paths, seeds):
    """Pixels [seed, row, column] of independent renders with `paths` paths per pixel each."""
    loaded = mi.load_dict(scene)
    threads = drjit.thread_count()
    drjit.set_thread_count(1)
    pictures = []
    for seed in seeds:
        random.seed(seed)
        pictures.append(np.array(mi.render(loaded, spp=paths, seed=seed), dtype=float)[..., 0])
    drjit.set_thread_count(threads)  # with one thread Mitsuba waits for ever when it reads or writes EXR files
    return factor * np.stack(pictures)
