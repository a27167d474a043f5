#!/usr/bin/env python3
"""make_cube.py -o DIR: the cube, a set of photographs by Mitsuba 3 whose material, cameras and lamps are known.

A translucent cube of 40 mm with round edges and a rough surface, seen by 20 cameras from all around, each with a lamp of
its own. There are two versions, each in a folder that needs no other:

DIR/even       absorption is the same everywhere
DIR/streaked   absorption varies threefold in the volume, in streaks 3 mm thick and 8 mm long, the same in every channel

Each holds images/ (photographs and the variances of their pixels), transforms.json (cameras as NeRF programs state them),
light_rig.json (a lamp per photograph, of its name), cube.ply, truth.json (the material, as crownfit states it), and
mitsuba/ (a scene per photograph). DIR/cube.json has all that the set was made of. Photographs that exist are kept.

Light is followed by Mitsuba's volpath in single precision, every channel on its own, so that channels share no noise. Its
`roughdielectric` is replaced by rough_lanes.py, which loses no light and lets paths look for lamps from the boundary.
Weak paths end by roulette_phase.py. By default the standard error of a pixel on the object is a third of its value, in the
median, and several times its value where a face is dark.
Needs mitsuba with LLVM 19 (DRJIT_LIBLLVM_PATH names the library; with LLVM 15 it aborts), numpy and two processor cores for 40 minutes.
"""
import argparse
import json
import math
import re
import tempfile
import time
from pathlib import Path

import mitsuba as mi
import numpy as np

mi.set_variant("llvm_ad_mono")  # channels are rendered one by one

import drjit as dr  # noqa: E402
import rough_lanes  # noqa: E402  (its base class belongs to the variant)
import roulette_phase  # noqa: E402

rough_lanes.register()
roulette_phase.register()

EDGE, ROUND, SEGMENTS = 40.0, 2.0, 8  # mm, mm, flat strips per quarter round
VIEWS, PIXELS, DISTANCE = 20, 96, 300.0  # the distance of the cameras from the centre, mm
WIDTH = 74.0  # mm that a picture shows across at the centre
HOLDOUT = range(3, VIEWS, 4)
LAMP_DISTANCE, LAMP_DIAMETER = 400.0, 4.0  # mm, degrees
LAMP_ANGLES = 10.0, 110.0  # degrees between the lamp and the camera
OFF_FACE = 12.0  # degrees that a camera is off the normals of all faces, at least
INDEX, ASYMMETRY, ROUGHNESS = 1.4, 0.8, 0.2
REDUCED_SCATTERING, ABSORPTION = 0.3, (0.02, 0.03, 0.15)  # 1/mm
SCATTERING = REDUCED_SCATTERING / (1 - ASYMMETRY)
VOXELS, VOXEL = 42, 1.0  # along each axis, mm; a millimetre more than the cube at every side
STREAK, SPREAD = (3.0, 8.0), 3.0  # thickness and length at half height, mm; largest over smallest absorption
CHANNELS = ("R", "G", "B")
SEED = 20
BATCHES = 32
MORE_PATHS = (1, 1, 1.3)  # of each channel: blue light is absorbed most, and its paths are short
EVENTS = 100.0  # equal contributions to a pooled variance, at least
FLOOR = 0.02  # standard error of every pixel, relative to the mean over the object
ROULETTE = 0.95  # the albedo below which Mitsuba's own roulette leaves the variance finite
RADIANCE = 1 / math.sin(math.radians(LAMP_DIAMETER / 2)) ** 2  # in Mitsuba: a white card at the centre, turned to the lamp, has radiance 1


def arguments():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("-o", "--output", type=Path, required=True, metavar="DIR", help="folder for the set; it is created if missing")
    p.add_argument("--paths", type=int, default=1280, help="paths per pixel, of blue 1.3 times as many (default 1280)")
    p.add_argument("--only", choices=("even", "streaked"), help="make only this version")
    p.add_argument("--views", type=int, default=VIEWS, help="photographs to take, the first ones (default: all)")
    p.add_argument("--files-only", action="store_true", help="write everything but the photographs")
    return p.parse_args()


# The shape


def rounded_cube():
    """(vertices, faces) of a closed mesh. A quarter round is SEGMENTS flat strips between points of the true round, a corner
    an eighth of a sphere, a face two triangles."""
    half, n = EDGE / 2 - ROUND, SEGMENTS
    places, vertices, faces = {}, [], []

    def vertex(centre, direction):
        p = np.array(centre) * half + ROUND * direction / np.linalg.norm(direction)
        return places.setdefault(tuple(np.round(p, 9)), len(places)), p

    def add(*corners):
        ids = []
        for number, p in corners:
            if number == len(vertices):
                vertices.append(p)
            ids.append(number)
        a, b, c = (vertices[i] for i in ids)
        outwards = np.dot(np.cross(b - a, c - a), a + b + c) > 0
        faces.append(ids if outwards else [ids[0], ids[2], ids[1]])

    def quad(a, b, c, d):
        add(a, b, c)
        add(a, c, d)

    def on_arc(k, first, second):
        """Direction k of n from axis `first` to axis `second`."""
        angle = 0.5 * math.pi * k / n
        return math.cos(angle) * first + math.sin(angle) * second

    axes = np.eye(3)
    signs = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    for s in signs:  # corners: rows of points from the axis z down to the arc between x and y
        x, y, z = (s[k] * axes[k] for k in range(3))
        rows = [[vertex(s, on_arc(j, z, on_arc(k * n / j if j else 0, x, y))) for k in range(j + 1)] for j in range(n + 1)]
        for j in range(n):
            for k in range(j + 1):
                add(rows[j][k], rows[j + 1][k], rows[j + 1][k + 1])
                if k < j:
                    add(rows[j][k], rows[j + 1][k + 1], rows[j][k + 1])
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for su in (-1, 1):
            for sv in (-1, 1):  # an edge along `axis`
                ends = [np.zeros(3), np.zeros(3)]
                for end, s in zip(ends, (-1, 1)):
                    end[[axis, u, v]] = s, su, sv
                arc = [on_arc(k, su * axes[u], sv * axes[v]) for k in range(n + 1)]
                for k in range(n):
                    quad(vertex(ends[0], arc[k]), vertex(ends[0], arc[k + 1]), vertex(ends[1], arc[k + 1]), vertex(ends[1], arc[k]))
        for s in (-1, 1):  # a face
            corners = []
            for su, sv in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
                c = np.zeros(3)
                c[[axis, u, v]] = s, su, sv
                corners.append(vertex(c, s * axes[axis]))
            quad(*corners)
    return np.array(vertices), np.array(faces)


def check_closed(vertices, faces):
    """Every edge is shared by two triangles that run along it in opposite directions, and the outside is outside."""
    edges = [(a, b) for f in faces for a, b in zip(f, np.roll(f, -1))]
    assert len(set(edges)) == len(edges) and all((b, a) in set(edges) for a, b in edges), "the mesh is not closed"
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    assert np.einsum("ij,ij->", a, np.cross(b, c)) > 0, "the mesh is inside out"


def write_ply(path, vertices, faces):
    head = f"ply\nformat ascii 1.0\nelement vertex {len(vertices)}\nproperty float x\nproperty float y\nproperty float z\nelement face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    rows = [" ".join(f"{v:.9g}" for v in p) for p in vertices.astype(np.float32)] + ["3 " + " ".join(map(str, f)) for f in faces]
    path.write_text(head + "\n".join(rows) + "\n")


# Cameras and lamps


def directions():
    """Towards the cameras: a Fibonacci sphere, turned until no camera looks straight at a face."""
    k = np.arange(VIEWS)
    z, angle = 1 - (2 * k + 1) / VIEWS, k * math.pi * (3 - math.sqrt(5))
    points = np.stack([np.sqrt(1 - z * z) * np.cos(angle), np.sqrt(1 - z * z) * np.sin(angle), z], axis=1)
    generator = np.random.default_rng(SEED)
    while True:
        turn = np.linalg.qr(generator.standard_normal((3, 3)))[0]
        turned = points @ turn.T
        if np.abs(turned).max() < math.cos(math.radians(OFF_FACE)):
            return turned[generator.permutation(VIEWS)]


def lamp_directions(cameras):
    """Towards the lamps: evenly spread angles from the cameras' directions, in random order, at random azimuths."""
    generator = np.random.default_rng(SEED + 1)
    angles = np.radians(np.linspace(*LAMP_ANGLES, VIEWS))[generator.permutation(VIEWS)]
    found = []
    for d, angle, azimuth in zip(cameras, angles, 2 * math.pi * generator.random(VIEWS)):
        u = np.cross(d, np.eye(3)[np.abs(d).argmin()])
        u /= np.linalg.norm(u)
        found.append(math.cos(angle) * d + math.sin(angle) * (math.cos(azimuth) * u + math.sin(azimuth) * np.cross(d, u)))
    return np.array(found)


def camera_axes(d):
    """Right, up and backward of a camera that looks at the centre from direction d."""
    right = np.cross([0.0, 0.0, 1.0], d)
    right /= np.linalg.norm(right)
    return right, np.cross(d, right), d


def write_transforms(path, names, cameras):
    frames = []
    for name, d in zip(names, cameras):
        matrix = np.eye(4)
        matrix[:3, :3] = np.stack(camera_axes(d), axis=1)
        matrix[:3, 3] = DISTANCE * d
        frames.append({"file_path": f"images/{name}.exr", "transform_matrix": matrix.tolist()})
    focal = PIXELS * DISTANCE / WIDTH
    path.write_text(json.dumps({"camera_model": "PINHOLE", "w": PIXELS, "h": PIXELS, "fl_x": focal, "fl_y": focal, "cx": PIXELS / 2, "cy": PIXELS / 2, "frames": frames}, indent=1) + "\n")


def write_rig(path, names, lamps):
    """Pixels in crownfit are pi x radiance, and in Mitsuba radiance. So a lamp has 1 / pi of its radiance in Mitsuba."""
    radius = LAMP_DISTANCE * math.sin(math.radians(LAMP_DIAMETER / 2))
    intensity = RADIANCE / math.pi * math.pi * radius**2  # radiance x the area of the lamp's outline
    lights = [{"name": name, "type": "point", "frame": "object", "position_mm": (LAMP_DISTANCE * d).tolist(), "radiant_intensity_rgb": [intensity] * 3, "radius_mm": radius}
              for name, d in zip(names, lamps)]
    path.write_text(json.dumps({"format": "crownfit-light-rig/1", "lights": lights}, indent=1) + "\n")


# The material


def streaks():
    """Factor of absorption [z, y, x] in voxels: elongated bright and dark spots of random places and directions, whose ranks
    are mapped to a factor spread evenly in its logarithm. The mean over the cube is 1."""
    generator = np.random.default_rng(SEED + 2)
    middles = VOXEL * (np.arange(VOXELS) + 0.5 - VOXELS / 2)
    z, y, x = np.meshgrid(middles, middles, middles, indexing="ij")
    at = np.stack([x, y, z], axis=-1)
    thick, long = (w / math.sqrt(8 * math.log(2)) for w in STREAK)
    field = np.zeros_like(x)
    reach = VOXELS * VOXEL / 2 + STREAK[1]
    for _ in range(4000):
        axis = generator.standard_normal(3)
        axis /= np.linalg.norm(axis)
        away = at - generator.uniform(-reach, reach, 3)
        along = away @ axis
        field += generator.choice((-1, 1)) * np.exp(-0.5 * (along**2 / long**2 + ((away**2).sum(-1) - along**2) / thick**2))
    inside = (np.abs(at) < EDGE / 2).all(-1)
    ranks = np.searchsorted(np.sort(field[inside]), field) / inside.sum()
    factor = SPREAD ** (np.clip(ranks, 0, 1) - 0.5)
    return factor / factor[inside].mean()


def write_volumes(folder, factor, channels):
    """sigma_t.vol and albedo.vol with these channels."""
    absorption = factor[..., None] * np.array([ABSORPTION[c] for c in channels])
    extinction = SCATTERING + absorption
    mi.VolumeGrid(extinction.astype(np.float32)).write(str(folder / "sigma_t.vol"))
    mi.VolumeGrid((SCATTERING / extinction).astype(np.float32)).write(str(folder / "albedo.vol"))


def write_truth(path, version):
    truth = {"format": "crownfit-material/1", "model": "path", "channels": [{"name": n, "wavelength_nm": w} for n, w in zip(CHANNELS, (600, 540, 450))],
             "layers": [{"name": "cube", "ior": INDEX, "g": ASYMMETRY, "reduced_scattering_per_mm": [REDUCED_SCATTERING] * 3, "absorption_per_mm": list(ABSORPTION)}],
             "surface": {"roughness": ROUGHNESS, "wetness": 0}}
    if version == "streaked":
        truth["provenance"] = {"absorption": "mean over the cube; the factor in each voxel is in absorption_factor.vol"}
    path.write_text(json.dumps(truth, indent=1) + "\n")


# Mitsuba's scenes


def rgb(values):
    return ", ".join(f"{v:.9g}" for v in values)


def material_xml(version):
    if version == "even":
        extinction = [SCATTERING + a for a in ABSORPTION]
        scale = max(extinction)  # values of <rgb> go up to 1
        inner = f"""  <medium type="homogeneous" id="inside">
    <rgb name="sigma_t" value="{rgb(e / scale for e in extinction)}"/>
    <float name="scale" value="{scale:.9g}"/>
    <rgb name="albedo" value="{rgb(SCATTERING / e for e in extinction)}"/>
"""
    else:
        side = VOXELS * VOXEL
        place = f'<transform name="to_world"><scale value="{side:g}"/><translate x="{-side / 2:g}" y="{-side / 2:g}" z="{-side / 2:g}"/></transform>'
        grid = '    <volume type="gridvolume" name="{0}"><string name="filename" value="{0}.vol"/><boolean name="raw" value="true"/><string name="filter_type" value="nearest"/>\n      {1}</volume>\n'
        inner = '  <medium type="heterogeneous" id="inside">\n' + grid.format("sigma_t", place) + grid.format("albedo", place)
    return inner + f"""    <boolean name="sample_emitters" value="false"/>
    <phase type="hg"><float name="g" value="{ASYMMETRY}"/></phase>
  </medium>
  <bsdf type="roughdielectric" id="boundary">
    <string name="distribution" value="ggx"/>
    <float name="alpha" value="{ROUGHNESS}"/>
    <float name="int_ior" value="{INDEX}"/>
    <float name="ext_ior" value="1.0"/>
  </bsdf>
"""


def scene_xml(version, camera, lamp):
    """The lamp blocks nothing and is not seen by the camera. Its BSDF is `null`, and the integrator hides emitters.
    Mitsuba's camera looks along +z with x to the left and y up."""
    right, up, back = camera_axes(camera)
    pose = np.eye(4)
    pose[:3] = np.stack([-right, up, -back, DISTANCE * camera], axis=1)
    centre, radius = LAMP_DISTANCE * lamp, LAMP_DISTANCE * math.sin(math.radians(LAMP_DIAMETER / 2))
    return f"""<scene version="3.0.0">
  <default name="spp" value="256"/>
  <integrator type="volpathmis">
    <integer name="max_depth" value="-1"/>
    <integer name="rr_depth" value="100000"/>
    <boolean name="hide_emitters" value="true"/>
  </integrator>
  <sensor type="perspective">
    <string name="fov_axis" value="x"/>
    <float name="fov" value="{math.degrees(2 * math.atan(WIDTH / 2 / DISTANCE)):.9g}"/>
    <float name="near_clip" value="1"/>
    <float name="far_clip" value="100000"/>
    <transform name="to_world"><matrix value="{' '.join(f'{v:.9g}' for v in pose.ravel())}"/></transform>
    <film type="hdrfilm">
      <integer name="width" value="{PIXELS}"/>
      <integer name="height" value="{PIXELS}"/>
      <string name="pixel_format" value="rgb"/>
      <string name="component_format" value="float32"/>
      <rfilter type="box"/>
    </film>
    <sampler type="independent"><integer name="sample_count" value="$spp"/></sampler>
  </sensor>
{material_xml(version)}  <shape type="ply">
    <string name="filename" value="../cube.ply"/>
    <boolean name="face_normals" value="true"/>
    <ref id="boundary"/>
    <ref name="interior" id="inside"/>
  </shape>
  <shape type="sphere">
    <point name="center" x="{centre[0]:.9g}" y="{centre[1]:.9g}" z="{centre[2]:.9g}"/>
    <float name="radius" value="{radius:.9g}"/>
    <bsdf type="null"/>
    <emitter type="area"><rgb name="radiance" value="{rgb([RADIANCE] * 3)}"/></emitter>
  </shape>
</scene>
"""


def of_channel(xml, channel):
    """The scene with the values of one channel, for a variant without colours, by the boundary that loses no light.
    Mitsuba's own roulette serves only where absorption outdoes it (roulette_phase.py)."""
    albedo = SCATTERING / (SCATTERING + ABSORPTION[channel])
    if albedo < ROULETTE:
        xml = xml.replace('name="rr_depth" value="100000"', 'name="rr_depth" value="20"')
    else:
        xml = xml.replace('<phase type="hg">', f'<phase type="crownfit_roulette"><float name="survival" value="{albedo:.9g}"/>')
    grey = re.sub(r'<rgb name="(\w+)" value="([^"]*)"/>', lambda m: f'<float name="{m[1]}" value="{m[2].split(", ")[channel]}"/>', xml)
    return grey.replace('"roughdielectric"', '"crownfit_rough_lanes"').replace('"volpathmis"', '"volpath"').replace('value="rgb"', 'value="luminance"')


# Photographs


def render(scene, paths, seed):
    """(mean of every pixel, variance of this mean) from BATCHES independent batches."""
    batches = [np.array(mi.render(scene, spp=paths // BATCHES, seed=seed + k), dtype=float)[..., 0] for k in range(BATCHES)]
    return np.mean(batches, axis=0), np.var(batches, axis=0, ddof=1) / BATCHES


def object_in(scene):
    """(share of every pixel that the object covers, mean normal there), from 8 x 8 rays a pixel."""
    n = 8 * PIXELS
    rows, columns = (v.ravel() for v in np.indices((n, n)))
    place = mi.Point2f((columns + 0.5).astype(np.float32) / n, (rows + 0.5).astype(np.float32) / n)
    ray, _ = scene.sensors()[0].sample_ray(0.0, 0.5, place, mi.Point2f(0.5, 0.5))
    hit = scene.ray_intersect(ray)
    seen = np.array(hit.is_valid()).reshape(n, n)
    normals = np.where(seen[..., None], np.moveaxis(np.array(hit.n), 0, -1).reshape(n, n, 3), 0.0)
    covered, total = (np.add.reduceat(np.add.reduceat(v, range(0, n, 8), 0), range(0, n, 8), 1) for v in (seen.astype(float), normals))
    return covered / 64, total / np.maximum(covered, 1)[..., None]


def pooled_variance(mean, variance, covered, normals):
    """Variances for the file. A pixel's own estimate is low where its value happens to be low, and weights made from it would
    pull a fit down by tens of per cent; a pool of ten events still does by 2 %. So each is the mean over pixels around that
    have a like normal, as many as it takes to hold EVENTS events of about equal size. The noise goes with the share of the
    pixel that is covered. FLOOR is added, because rare paths make all the noise in the dark, and may not have come yet."""
    found = np.zeros((3, *variance.shape))  # sums of shares, of variances, of their squares
    few = np.full(variance.shape, True)
    for reach, tolerance in ((1.5, 0.15), (3, 0.15), (6, 0.15), (10, 0.15), (10, 0.5)):  # pixels; of the normal
        sums, n = np.zeros_like(found), math.ceil(2 * reach)
        for y in range(-n, n + 1):
            for x in range(-n, n + 1):
                share, normal, noise = (np.roll(v, (y, x), (0, 1)) for v in (covered, normals, variance))
                weight = np.exp(-((normals - normal) ** 2).sum(-1) / (2 * tolerance**2) - (x * x + y * y) / (2 * reach**2))
                sums += np.where(share > 0, np.stack([weight * share, weight * noise, (weight * noise) ** 2]), 0.0)
        found = np.where(few, sums, found)
        few &= found[1] ** 2 < EVENTS * found[2]
    return covered * found[1] / np.maximum(found[0], 1e-9) + (FLOOR * mean[covered > 0].mean()) ** 2


def shorten(values):
    """Single precision with 12 bits of mantissa, which compresses; errors of 1e-4 at most, as often up as down."""
    bits = np.asarray(values, dtype=np.float32).view(np.uint32)
    return ((bits + np.uint32(0x7FF) + ((bits >> np.uint32(12)) & np.uint32(1))) & np.uint32(0xFFFFF000)).view(np.float32)


def write_picture(path, channels):
    mi.Bitmap(shorten(np.stack(channels, axis=-1)), mi.Bitmap.PixelFormat.RGB).write(str(path))


def photograph(folder, version, name, view, paths, factor):
    """Takes a photograph and returns the median of its relative standard errors on the object."""
    pictures, variances = [], []
    xml = (folder / "mitsuba" / f"{name}.xml").read_text()
    with tempfile.TemporaryDirectory() as work:
        work = Path(work)
        (work / "cube.ply").write_bytes((folder / "cube.ply").read_bytes())
        (work / "grey").mkdir()
        for channel in range(3):
            if version == "streaked":
                write_volumes(work / "grey", factor, [channel])
            (work / "grey/scene.xml").write_text(of_channel(xml, channel))
            scene = mi.load_file(str(work / "grey/scene.xml"))
            mean, variance = render(scene, round(paths * MORE_PATHS[channel]), 1000 * (3 * view + channel) + (version == "streaked") * 1000000)
            covered, normals = object_in(scene)
            covered = np.where(mean > 0, np.maximum(covered, 0.01), covered)  # paths touch corners that the rays miss
            pictures.append(mean)
            variances.append(pooled_variance(mean, variance, covered, normals))
    write_picture(folder / "images" / f"{name}.exr", pictures)
    write_picture(folder / "images" / f"{name}_variance.exr", variances)
    whole = np.stack([covered == 1] * 3)
    return np.median((np.sqrt(variances) / np.maximum(pictures, 1e-12))[whole])


def check_volume(factor):
    """Mitsuba finds the factors of the voxels where write_volumes means them to be."""
    with tempfile.TemporaryDirectory() as work:
        mi.VolumeGrid(factor[..., None].astype(np.float32)).write(f"{work}/factor.vol")
        side = VOXELS * VOXEL
        place = mi.ScalarTransform4f().translate([-side / 2] * 3).scale([side] * 3)
        volume = mi.load_dict({"type": "gridvolume", "filename": f"{work}/factor.vol", "raw": True, "filter_type": "nearest", "to_world": place})
        at = np.random.default_rng(1).integers(0, VOXELS, (1000, 3))
        point = dr.zeros(mi.Interaction3f, 1000)
        point.p = mi.Point3f(*(VOXEL * (at[:, k] + 0.5 - VOXELS / 2).astype(np.float32) for k in range(3)))
        found = np.array(volume.eval(point)).ravel()
    assert np.allclose(found, factor[at[:, 2], at[:, 1], at[:, 0]], rtol=1e-5), "the grid lies wrongly"


def write_version(folder, version, names, cameras, lamps, shape, factor):
    for sub in ("images", "mitsuba"):
        (folder / sub).mkdir(parents=True, exist_ok=True)
    write_ply(folder / "cube.ply", *shape)
    write_transforms(folder / "transforms.json", names, cameras)
    write_rig(folder / "light_rig.json", names, lamps)
    write_truth(folder / "truth.json", version)
    if version == "streaked":
        write_volumes(folder / "mitsuba", factor, range(3))
        mi.VolumeGrid(factor[..., None].astype(np.float32)).write(str(folder / "absorption_factor.vol"))
    for name, camera, lamp in zip(names, cameras, lamps):
        (folder / "mitsuba" / f"{name}.xml").write_text(scene_xml(version, camera, lamp))


def write_description(path, names, cameras, lamps, paths):
    side = VOXELS * VOXEL
    known = {
        "shape": {"edge_mm": EDGE, "round_mm": ROUND, "segments_per_quarter": SEGMENTS, "mesh": "cube.ply", "normals": "of the flat triangles"},
        "cameras": {"pixels": PIXELS, "distance_mm": DISTANCE, "width_at_centre_mm": WIDTH, "towards": {n: d.tolist() for n, d in zip(names, cameras)}},
        "lamps": {"type": "sphere", "distance_mm": LAMP_DISTANCE, "diameter_deg": LAMP_DIAMETER, "radiance_in_mitsuba": RADIANCE, "white_card_at_centre": 1,
                  "towards": {n: d.tolist() for n, d in zip(names, lamps)},
                  "angle_to_camera_deg": {n: math.degrees(math.acos(c @ d)) for n, c, d in zip(names, cameras, lamps)}},
        "material": {"ior": INDEX, "g": ASYMMETRY, "phase_function": "Henyey-Greenstein", "roughness_ggx_alpha": ROUGHNESS, "scattering_per_mm": [SCATTERING] * 3,
                     "reduced_scattering_per_mm": [REDUCED_SCATTERING] * 3, "absorption_per_mm": list(ABSORPTION)},
        "streaks": {"file": "streaked/absorption_factor.vol", "voxels": [VOXELS] * 3, "voxel_mm": VOXEL, "corner_mm": [-side / 2] * 3, "order": "x fastest, then y, then z",
                    "between_voxels": "steps, no interpolation", "largest_over_smallest": SPREAD, "thickness_and_length_mm": STREAK, "mean_over_the_cube": 1},
        "photographs": {"channels": CHANNELS, "value": "radiance in Mitsuba, which is pi x radiance in light_rig.json", "paths_per_pixel": [round(paths * m) for m in MORE_PATHS],
                        "batches": BATCHES, "variance": "of the mean, pooled over neighbours", "floor_of_standard_error": FLOOR, "holdout": [names[k] for k in HOLDOUT], "fit": [n for k, n in enumerate(names) if k not in HOLDOUT]},
        "seed": SEED,
    }
    path.write_text(json.dumps(known, indent=1) + "\n")


def main():
    options = arguments()
    options.output.mkdir(parents=True, exist_ok=True)
    names = [f"view_{k:02}" for k in range(VIEWS)]
    cameras = directions()
    lamps = lamp_directions(cameras)
    shape, factor = rounded_cube(), streaks()
    check_closed(*shape)
    check_volume(factor)
    write_description(options.output / "cube.json", names, cameras, lamps, options.paths)
    for version in ("even", "streaked"):
        if options.only not in (None, version):
            continue
        folder = options.output / version
        write_version(folder, version, names, cameras, lamps, shape, factor)
        for k, name in enumerate(names[:0 if options.files_only else options.views]):
            if (folder / "images" / f"{name}_variance.exr").exists():
                continue
            begin = time.time()
            error = photograph(folder, version, name, k, options.paths, factor)
            print(f"{version} {name}: {time.time() - begin:.0f} s, median standard error of a pixel on the object {100 * error:.0f} %", flush=True)


if __name__ == "__main__":
    main()
