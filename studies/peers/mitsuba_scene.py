"""Renders with Mitsuba 3 what `crownfit export --to mitsuba` wrote."""
import random
import subprocess
from pathlib import Path

import drjit
import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")  # needs no LLVM; as fast here as llvm_ad_rgb, whose lanes wait for the longest path

import rough_boundary  # noqa: E402  (its base class belongs to the variant)

rough_boundary.register()


def export(crownfit, capture, folder, keeps_energy=True, material=None, paths=2):
    """Exports the capture with its truth, or with another material; `paths` a pixel of the reference pictures. `keeps_energy`: the rough boundary follows light until it has left, as crownfit's
    does, in place of Mitsuba's roughdielectric, which drops what meets the facets twice (rough_boundary.py)."""
    command = [crownfit, "export", str(material or Path(capture) / "truth.json"), "--to", "mitsuba", "--capture", str(capture), "-o", str(folder),
               "--paths", str(paths), "--progress", "none"]
    subprocess.run(command, check=True, capture_output=True, text=True)
    material = Path(folder) / "material.xml"
    text = material.read_text()
    is_rough = "roughdielectric" in text
    if keeps_energy:
        material.write_text(text.replace("roughdielectric", "crownfit_rough"))
    return is_rough


def render(folder, photograph, paths, seeds, integrator="volpathmis"):
    """Pixels [seed, row, column, channel] of independent renders with `paths` paths per pixel each, by one thread."""
    threads = drjit.thread_count()
    scene = mi.load_file(str(Path(folder) / f"{photograph}.xml"), spp=str(paths), integrator=integrator)
    drjit.set_thread_count(1)
    pictures = []
    for seed in seeds:
        random.seed(seed)
        pictures.append(np.array(mi.render(scene, spp=paths, seed=seed), dtype=float))
    drjit.set_thread_count(threads)  # with one thread Mitsuba waits for ever when it reads or writes files
    return np.stack(pictures)


def read_exr(path):
    """{layer: pixels} of an EXR as crownfit writes it; the picture's own layer is called ""."""
    bitmap = mi.Bitmap(str(path))
    names = [field.name for field in bitmap.struct_()]
    values = np.array(bitmap, dtype=float)
    layers = {name[:-1].rstrip(".") for name in names}
    return {layer: values[..., [names.index((layer + "." if layer else "") + c) for c in "RGB"]] for layer in layers}
