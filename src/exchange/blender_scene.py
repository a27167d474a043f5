
# ---- What follows is the same in every export. ----------------------------------------------------------------------
import math
import sys
from pathlib import Path

import bpy
from mathutils import Matrix

HERE = Path(__file__).resolve().parent
GAP_MM = 1e-3  # between a layer's inner skin and the next layer: faces in one place hide each other


def node(tree, kind, **values):
    """A shader node; values by the names of its sockets (_ stands for a space)."""
    n = tree.nodes.new(kind)
    for name, value in values.items():
        n.inputs[name.replace("_", " ")].default_value = value
    return n


def new_material(name):
    """An empty material: (material, its node tree, its output)."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    return material, tree, tree.nodes.new("ShaderNodeOutputMaterial")


def subsurface_material():
    """All layers as one medium behind a surface: Principled BSDF, random walk."""
    m = SCENE["one_medium"]
    material, tree, out = new_material("crown_subsurface")
    shader = node(tree, "ShaderNodeBsdfPrincipled", Base_Color=(*m["albedo"], 1), Roughness=math.sqrt(SCENE["roughness"]), IOR=m["ior"],
                  Subsurface_Weight=1, Subsurface_Radius=m["radius_mm"], Subsurface_Scale=1)
    shader.subsurface_method = "RANDOM_WALK"
    tree.links.new(shader.outputs["BSDF"], out.inputs["Surface"])
    return material


def volume_material(number):
    """A layer's boundary (refraction) and what is in it (Principled Volume). Where the mesh's attribute `inner` is 1 light
    passes as if nothing were there: the skin towards the next layer, which refracts by itself."""
    layer = SCENE["layers"][number]
    material, tree, out = new_material("layer_" + layer["name"])
    roughness = math.sqrt(SCENE["roughness"]) if number == 0 else 0
    boundary = node(tree, "ShaderNodeBsdfPrincipled", Base_Color=(1, 1, 1, 1), Roughness=roughness, IOR=layer["relative_ior"], Transmission_Weight=1)
    passing, mixed = tree.nodes.new("ShaderNodeBsdfTransparent"), tree.nodes.new("ShaderNodeMixShader")
    inner = tree.nodes.new("ShaderNodeAttribute")
    inner.attribute_name = "inner"
    tree.links.new(inner.outputs["Fac"], mixed.inputs[0])
    tree.links.new(boundary.outputs["BSDF"], mixed.inputs[1])
    tree.links.new(passing.outputs["BSDF"], mixed.inputs[2])
    tree.links.new(mixed.outputs["Shader"], out.inputs["Surface"])
    # Scattering = density x colour; absorption = density x (1 - colour) x (1 - sqrt(absorption colour)).
    s, a = layer["scattering_per_mm"], layer["absorption_per_mm"]
    density = 1.001 * max([x + y for x, y in zip(s, a)] + [1e-9])
    colour = [x / density for x in s]
    absorbed = [(1 - y / (density - x)) ** 2 for x, y in zip(s, a)]
    volume = node(tree, "ShaderNodeVolumePrincipled", Color=(*colour, 1), Density=density, Anisotropy=layer["g"], Absorption_Color=(*absorbed, 1))
    tree.links.new(volume.outputs["Volume"], out.inputs["Volume"])
    return material


def lamp_material(name, radiance):
    """Shines to the front, and lets all other light through."""
    material, tree, out = new_material(name)
    strength = max(max(radiance), 1e-9)
    emission = node(tree, "ShaderNodeEmission", Color=(*(x / strength for x in radiance), 1), Strength=strength)
    side, mixed, black = (tree.nodes.new("ShaderNode" + k) for k in ("NewGeometry", "MixShader", "BsdfTransparent"))
    both, clear = tree.nodes.new("ShaderNodeAddShader"), tree.nodes.new("ShaderNodeBsdfTransparent")
    black.inputs["Color"].default_value = (0, 0, 0, 1)
    tree.links.new(side.outputs["Backfacing"], mixed.inputs[0])
    tree.links.new(emission.outputs["Emission"], mixed.inputs[1])
    tree.links.new(black.outputs["BSDF"], mixed.inputs[2])
    tree.links.new(mixed.outputs["Shader"], both.inputs[0])
    tree.links.new(clear.outputs["BSDF"], both.inputs[1])
    tree.links.new(both.outputs["Shader"], out.inputs["Surface"])
    return material


def matte(name, reflectance):
    material, tree, out = new_material(name)
    tree.links.new(node(tree, "ShaderNodeBsdfDiffuse", Color=(*reflectance, 1)).outputs["BSDF"], out.inputs["Surface"])
    return material


def mesh_object(name, file, material):
    """One Blender unit is one millimetre; axes as in the file."""
    bpy.ops.wm.ply_import(filepath=str(HERE / file), forward_axis="Y", up_axis="Z")
    thing = bpy.context.object
    thing.name = name
    thing.data.materials.clear()
    thing.data.materials.append(material)
    for face in thing.data.polygons:
        face.use_smooth = False
    return thing


def add_inner_skin(outer, inner):
    """Makes a layer hollow where the next one is: without it Blender adds up the coefficients of both."""
    mesh, skin = outer.data, inner.data
    vertices = [tuple(v.co) for v in mesh.vertices] + [tuple(v.co + GAP_MM * v.normal) for v in skin.vertices]
    first = len(mesh.vertices)
    faces = [tuple(f.vertices) for f in mesh.polygons] + [tuple(first + i for i in reversed(f.vertices)) for f in skin.polygons]
    hollow = bpy.data.meshes.new(mesh.name + "_hollow")
    hollow.from_pydata(vertices, [], faces)
    flags = hollow.attributes.new("inner", "FLOAT", "FACE")
    flags.data.foreach_set("value", [0.0] * len(mesh.polygons) + [1.0] * len(skin.polygons))
    for material in mesh.materials:
        hollow.materials.append(material)
    outer.data = hollow


def build_object(as_layers):
    if not as_layers:
        return [mesh_object("crown", SCENE["layers"][0]["mesh"], subsurface_material())]
    layers = [mesh_object(layer["name"], layer["mesh"], volume_material(i)) for i, layer in enumerate(SCENE["layers"])]
    for outer, inner in zip(layers, layers[1:]):
        add_inner_skin(outer, inner)
    return layers


def build_camera(shot):
    camera = bpy.data.cameras.new(shot["name"])
    camera.sensor_fit, camera.sensor_width = "HORIZONTAL", 36.0
    w, h = shot["width"], shot["height"]
    camera.lens = 36.0 * shot["focal_px"] / w
    camera.shift_x, camera.shift_y = 0.5 - shot["cx"] / w, (shot["cy"] - 0.5 * h) / w
    camera.clip_start, camera.clip_end = 1.0, 1e5
    thing = bpy.data.objects.new(shot["name"], camera)
    thing.matrix_world = Matrix(shot["world_from_camera"])
    bpy.context.collection.objects.link(thing)
    return thing


def build_lamps(shot):
    world = bpy.data.worlds.new(shot["name"])
    world.use_nodes = True
    background = world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (0, 0, 0, 1)
    bpy.context.scene.world = world
    world.cycles_visibility.camera = False
    for lamp in shot["lamps"]:
        strength = max(max(lamp["radiance"]), 1e-9)
        if lamp["type"] == "dome":
            background.inputs["Color"].default_value = (*(x / strength for x in lamp["radiance"]), 1)
            background.inputs["Strength"].default_value = strength
            continue
        if lamp["type"] == "environment":
            picture = world.node_tree.nodes.new("ShaderNodeTexEnvironment")
            picture.image = bpy.data.images.load(str(HERE / lamp["file"]))
            turn = world.node_tree.nodes.new("ShaderNodeMapping")
            turn.inputs["Rotation"].default_value = (math.pi / 2, 0, math.pi / 2)  # +y is up in the file, +z at its centre
            place = world.node_tree.nodes.new("ShaderNodeTexCoord")
            world.node_tree.links.new(place.outputs["Generated"], turn.inputs["Vector"])
            world.node_tree.links.new(turn.outputs["Vector"], picture.inputs["Vector"])
            world.node_tree.links.new(picture.outputs["Color"], background.inputs["Color"])
            continue
        material = lamp_material("lamp_" + lamp["name"], lamp["radiance"])
        if lamp["type"] == "ball":
            bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32, radius=lamp["radius_mm"], location=lamp["centre_mm"])
            thing = bpy.context.object
            thing.data.materials.append(material)
        else:
            thing = mesh_object(lamp["name"], lamp["file"], material)
        thing.visible_camera = False


def build(photograph=None, as_layers=False):
    """The material; with a photograph, its scene too. `as_layers`: every layer as a volume, else one subsurface medium."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.unit_settings.system, scene.unit_settings.scale_length = "METRIC", 0.001
    if not SCENE["photographs"]:
        for material in [subsurface_material(), *(volume_material(i) for i in range(len(SCENE["layers"])))]:
            material.use_fake_user = True
        return
    shot = next((p for p in SCENE["photographs"] if p["name"] == photograph), SCENE["photographs"][0])
    build_object(as_layers)
    for thing in shot["things"]:
        mesh_object(thing["name"], thing["file"], matte("thing_" + thing["name"], thing["reflectance"]))
    scene.camera = build_camera(shot)
    build_lamps(shot)
    render = scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = shot["width"], shot["height"], 100
    render.film_transparent, render.filter_size = False, 0.01
    render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.view_settings.view_transform = "Raw"
    cycles = scene.cycles
    cycles.samples, cycles.use_denoising, cycles.use_adaptive_sampling = 256, False, False
    cycles.pixel_filter_type = "BOX"
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    cycles.caustics_reflective = cycles.caustics_refractive = True
    cycles.blur_glossy = 0
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = cycles.transmission_bounces = 1024
    cycles.volume_bounces = cycles.transparent_max_bounces = 1024


if __name__ == "__main__":
    words = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else []
    build(next((w for w in words if w != "--layers"), None), "--layers" in words)
    bpy.ops.wm.save_as_mainfile(filepath=str(HERE / "crown.blend"))
