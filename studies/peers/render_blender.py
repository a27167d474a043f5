"""render_blender.py CROWN.PY PHOTOGRAPH layers|one PATHS SEED FILE.EXR: runs in the environment that has bpy; one thread. Prints
seconds."""
import importlib.util
import sys
import time

import bpy

script, photograph, kind, paths, seed, file = sys.argv[1:]
spec = importlib.util.spec_from_file_location("crown", script)
crown = importlib.util.module_from_spec(spec)
spec.loader.exec_module(crown)
crown.build(photograph, kind == "layers")
scene = bpy.context.scene
scene.cycles.samples, scene.cycles.seed = int(paths), int(seed)
scene.render.threads_mode, scene.render.threads = "FIXED", 1
scene.render.filepath = file
begin = time.time()
bpy.ops.render.render(write_still=True)
print("seconds", time.time() - begin)
