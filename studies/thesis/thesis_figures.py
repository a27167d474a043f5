#!/usr/bin/python3
"""thesis_figures.py CROWNFIT PROFILE_STUDY FOLDER: remakes the results of the thesis (chapter 6) with both models.

Every picture is rendered by `shader` and by `path` with the same material, and their CIEDE2000 is measured on the object,
one pixel inside its outline (`crownfit compare`: means of 8 x 8 pixels). Rendered pictures are kept in FOLDER/work and
found again while neither scene nor program change; figures and table.md land in FOLDER. `./dev bench thesis` calls this;
docs/forward_model.md shows the figures.

Needs Debian's python3-numpy, python3-matplotlib and python3-openimageio.
"""
import argparse
import csv
import hashlib
import json
import subprocess
import sys
from pathlib import Path

import matplotlib
import numpy as np
import OpenImageIO as oiio

sys.path[1:1] = [str(Path(__file__).resolve().parent.parent / "peers"), str(Path(__file__).resolve().parent.parent)]
import make_peer_captures as captures  # noqa: E402
import tables  # noqa: E402
import tooth_shapes  # noqa: E402

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
ENAMEL = {"ior": 1.63, "g": 0.96, "reduced_scattering_per_mm": 0.24, "absorption_per_mm": [0.01, 0.02, 0.05], "thickness_mm": 0.7}
DENTINE = {"ior": 1.54, "g": 0.93, "reduced_scattering_per_mm": 2.0, "absorption_per_mm": [0.03, 0.07, 0.2]}
BLACK = {"absorption_per_mm": [20.0] * 3, "reduced_scattering_per_mm": 0.001}
LIGHTS = [captures.softbox("left", [-113, 0, 113], 70, 1.2), captures.softbox("right", [113, 0, 113], 70, 1.2),
          captures.softbox("behind", [0, 0.1, -130], 110, 1.0), captures.softbox("lamp", [-163, 0, 163], 40, 11.0),
          captures.dome(0.06)]


def read_picture(path):
    picture = oiio.ImageBuf(str(path)).get_pixels(oiio.FLOAT)
    if picture is None:
        sys.exit(f"{path}: can't be read")
    return picture


def write_picture(path, pixels):
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], oiio.FLOAT)
    output = oiio.ImageOutput.create(str(path))
    output.open(str(path), spec)
    output.write_image(np.ascontiguousarray(pixels, dtype=np.float32))
    output.close()


class Studio:
    def __init__(self, options):
        self.program = options.crownfit
        self.paths, self.pixels = options.paths, options.pixels
        self.work = options.folder / "work"
        self.program_hash = hashlib.sha256(Path(options.crownfit).read_bytes()).hexdigest()
        self.rows = []

    def run(self, *arguments):
        done = subprocess.run([self.program, *map(str, arguments)], capture_output=True, text=True)
        if done.returncode:
            sys.exit(f"crownfit {' '.join(map(str, arguments))}: exit {done.returncode}: {done.stderr.strip()}")
        return done.stdout

    def render(self, model, mesh, lights, enamel=None, dentine=None, roughness=0.2, wetness=0.0, polarisation="none", backing=None,
               blade=False, width_mm=12.0, aspect=1.0, options=(), texture=None):
        """Linear picture of one scene: height x width x 3."""
        fixed = lambda values: {key: {"fixed": value} if not isinstance(value, dict) else value for key, value in values.items()}
        layers = [{"name": "enamel", "surface": str(mesh)} | fixed(ENAMEL | (enamel or {})), {"name": "dentine"} | fixed(DENTINE | (dentine or {}))]
        if texture:
            layers[0]["absorption_texture"] = texture
        photograph = captures.photograph("view", lights, backing=backing or "none", scenery=["blade"] if blade else []) | {"polarisation": polarisation}
        tile = lambda rho: {"point_mm": [0, 0, -4.0], "normal": [0, 0, 1], "size_mm": 30, "reflectance_rgb": [rho] * 3}
        scene = {"format": "crownfit-capture/1",
                 "object": {"layers": layers, "surface": fixed({"roughness": roughness, "wetness": wetness}), "long_axis": [0, 1, 0],
                            "backings": {"black": tile(0.03), "white": tile(0.9)},
                            "scenery": [{"name": "blade", "mesh": str(ROOT / "datasets_synthetic/incisor/mesh/blade.ply"), "reflectance_rgb": [0.02] * 3}]},
                 "light_rig": "light_rig.json", "photographs": [photograph | {"camera": "camera.json"}]}
        height = round(self.pixels * aspect)
        focal = self.pixels * captures.DISTANCE / width_mm
        camera = {"format": "crownfit-camera/1", "width": self.pixels, "height": height, "fx": focal, "fy": focal,
                  "cx": self.pixels / 2, "cy": height / 2, "distortion": [0] * 5}
        arguments = ["--model", model, *(["--paths", self.paths] if model == "path" else ["--fine"]), *options]
        content = json.dumps([self.program_hash, scene, camera, LIGHTS, list(map(str, arguments)), hashlib.sha256(Path(mesh).read_bytes()).hexdigest()])
        folder = self.work / hashlib.sha256(content.encode()).hexdigest()[:16]
        if not (folder / "view.exr").exists():
            folder.mkdir(parents=True, exist_ok=True)
            for name, value in (("capture.json", scene), ("camera.json", camera), ("light_rig.json", {"format": "crownfit-light-rig/1", "lights": LIGHTS})):
                (folder / name).write_text(json.dumps(value, indent=1))
            self.run("render", folder, "-o", folder, *arguments)
        return read_picture(folder / "view.exr")[:, :, :3]

    def both(self, mesh, lights, **scene):
        return [self.render(model, mesh, lights, **scene) for model in ("shader", "path")]

    def mask(self, mesh, **frame):
        """The object, one pixel inside its outline."""
        lit = self.render("shader", mesh, ["dome", "left", "right"], **frame).sum(axis=2) > 0
        inside = lit.copy()
        for dy in (-1, 0, 1):
            for dx in (-1, 0, 1):
                inside &= np.roll(lit, (dy, dx), (0, 1))
        return inside

    def compare(self, figure, name, a, b, mask):
        """CIEDE2000 of two pictures (median, 95 %), also noted for the table."""
        self.work.mkdir(parents=True, exist_ok=True)
        files = [self.work / f"compared_{x}.exr" for x in "abm"]
        for file, picture in zip(files, (a, b, np.repeat(mask[:, :, None], 3, axis=2).astype(np.float32))):
            write_picture(file, picture)
        found = json.loads(self.run("compare", files[0], files[1], "--mask", files[2], "--json"))
        level = a[mask].sum(axis=0) / b[mask].sum(axis=0) - 1
        self.rows.append((figure, name, found["de00_median"], found["de00_p95"], level))
        print(f"{figure:12} {name:32} CIEDE2000 {found['de00_median']:6.2f} / {found['de00_p95']:6.2f}   shader / path - 1, R G B: "
              + " ".join(f"{100 * x:+6.1f} %" for x in level), flush=True)
        return found["de00_median"], found["de00_p95"]


def displayed(picture, scale):
    x = np.clip(picture * scale, 0, 1)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)


def box_mean(picture, reach=1):
    shifts = [np.roll(picture, (dy, dx), (0, 1)) for dy in range(-reach, reach + 1) for dx in range(-reach, reach + 1)]
    return np.mean(shifts, axis=0)


def figure_of_pairs(file, studio, name, columns, common_scale=True):
    """columns: (title, shader, path, mask). Rows: shader, path, ratio of their green channels."""
    aspect = columns[0][1].shape[0] / columns[0][1].shape[1]
    figure, axes = pyplot.subplots(3, len(columns), figsize=(1.9 * len(columns) + 0.9, 1.9 * 3 * aspect + 1.0), squeeze=False, layout="constrained")
    top = lambda mask, *pictures: max(np.quantile(box_mean(p)[mask], 0.995) for p in pictures)
    scale = 0.95 / max(top(mask, a, b) for _, a, b, mask in columns)
    for i, (title, a, b, mask) in enumerate(columns):
        if not common_scale:
            scale = 0.95 / top(mask, a, b)
        median, high = studio.compare(name, title.replace("\n", " "), a, b, mask)
        axes[0, i].set_title(title, fontsize=9)
        axes[0, i].imshow(displayed(a, scale), interpolation="bicubic")
        axes[1, i].imshow(displayed(b, scale), interpolation="bicubic")
        ratio = np.where(mask, box_mean(a)[:, :, 1] / np.maximum(box_mean(b)[:, :, 1], 1e-6) - 1, np.nan)
        shown = axes[2, i].imshow(100 * ratio, cmap="RdBu_r", vmin=-60, vmax=60)
        axes[2, i].set_xlabel(f"CIEDE2000 {median:.1f} / {high:.1f}", fontsize=8)
    for axis in axes.flat:
        axis.set_xticks([]), axis.set_yticks([])
    for row, label in enumerate(("shader", "path", "shader / path - 1")):
        axes[row, 0].set_ylabel(label, fontsize=9)
    bar = figure.colorbar(shown, ax=list(axes[2]), shrink=0.9)
    bar.set_label("%", fontsize=8)
    bar.ax.tick_params(labelsize=7)
    figure.savefig(file, dpi=100)
    pyplot.close(figure)


def profiles(options):
    text = subprocess.run([options.profile_study, str(options.photons)], check=True, capture_output=True, text=True).stdout
    rows = [{key: float(value) for key, value in row.items()} for row in csv.DictReader(text.splitlines())]
    figure, axes = pyplot.subplots(1, 4, figsize=(12, 3.4), sharey=True, layout="constrained")
    for axis, thickness in zip(axes, sorted({row["thickness_mm"] for row in rows})):
        some = [row for row in rows if row["thickness_mm"] == thickness]
        column = lambda key: np.array([row[key] for row in some])
        r = np.sqrt(0.5 * (column("inner_mm") ** 2 + column("outer_mm") ** 2))
        for key, style, label in (("model", "C0-", "shader"), ("dipole", "C1--", "dipole (Jensen 2001)"),
                                  ("normalised", "C2:", "normalised (Christensen, Burley 2015)"), ("model_transmitted", "C0-", None)):
            if thickness < 50 or key != "model_transmitted":
                axis.loglog(r, column(key), style, label=label, lw=1.2)
        for key, label, mark in (("path", "path", "o"), ("transmitted", "path, transmitted", "s")):
            seen = column(key) > 3 * np.maximum(column(key + "_stddev"), 1e-12)
            if thickness < 50 or key == "path":
                axis.errorbar(r[seen], column(key)[seen], column(key + "_stddev")[seen], fmt="k" + mark, ms=3, lw=0.8, label=label,
                              mfc="k" if key == "path" else "w")
        axis.set_title("half space" if thickness > 50 else f"{thickness:g} mm", fontsize=9)
        axis.set_xlabel("distance (mm)", fontsize=8)
        axis.tick_params(labelsize=7)
        axis.set_xlim(0.05, 8), axis.set_ylim(3e-6, 4)
        area = np.pi * (column("outer_mm") ** 2 - column("inner_mm") ** 2)
        print(f"profiles     {axis.get_title():10} light within 8 mm: " + ", ".join(f"{key} {float((column(key) * area).sum()):.4f}" for key in ("path", "model", "dipole", "normalised")), flush=True)
    axes[0].set_ylabel("light leaving (1/mm$^2$)", fontsize=8)
    axes[0].legend(fontsize=6.5, loc="lower left")
    figure.savefig(options.folder / "thesis_profiles.png", dpi=100)
    pyplot.close(figure)


def components(studio, file):
    front, enamel_alone = ["left", "right"], {"dentine": BLACK}
    mask = studio.mask(INCISOR)
    whole, crossed = studio.both(INCISOR, front), studio.both(INCISOR, front, polarisation="cross")
    enamel = studio.both(INCISOR, front, polarisation="cross", **enamel_alone)
    back = studio.both(INCISOR, ["behind"], polarisation="cross")
    minus = lambda a, b: [x - y for x, y in zip(a, b)]
    figure_of_pairs(file, studio, "components", [("everything", *whole, mask), ("surface reflection\n(whole - crossed)", *minus(whole, crossed), mask),
                    ("enamel alone\n(dentine black)", *enamel, mask), ("by way of dentine\n(crossed - enamel)", *minus(crossed, enamel), mask),
                    ("light from behind", *back, mask)], common_scale=False)


def twelve_taps(studio, file):
    mask, scene = studio.mask(INCISOR), {"polarisation": "cross", "blade": True}
    mask[:, : studio.pixels * 35 // 80] = False  # the blade stands before the left part of the crown
    lights = ["lamp", "dome"]
    coarse = studio.render("shader", INCISOR, lights, options=["--twelve-taps"], **scene)
    fine, path = studio.both(INCISOR, lights, **scene)
    figure_of_pairs(file, studio, "taps", [("1 + 12 taps\nagainst path", coarse, path, mask), ("1 + 48 taps\nagainst path", fine, path, mask),
                    ("1 + 12 taps against\n1 + 48 taps (below)", coarse, fine, mask)])


def roughness(studio, file):
    mask, lights = studio.mask(INCISOR), ["left", "right", "dome"]
    columns = [(f"roughness {r:g}", *studio.both(INCISOR, lights, roughness=r), mask) for r in (0.1, 0.2, 0.4)]
    columns += [(f"roughness 0.4\nwet over {100 * w:g} %", *studio.both(INCISOR, lights, roughness=0.4, wetness=w), mask) for w in (0.5, 1.0)]
    figure_of_pairs(file, studio, "roughness", columns)


def scattering(studio, file):
    mask, front = studio.mask(INCISOR), {"lights": ["left", "right"], "polarisation": "cross"}
    columns = [(f"enamel {s:g} / mm", *studio.both(INCISOR, enamel={"reduced_scattering_per_mm": s}, **front), mask) for s in (0.06, 0.24, 1.0, 2.0)]
    columns += [(f"dentine {s:g} / mm", *studio.both(INCISOR, dentine={"reduced_scattering_per_mm": s}, **front), mask) for s in (1.0, 4.0)]
    figure_of_pairs(file, studio, "scattering", columns)


def thickness(studio, file):
    mask, front = studio.mask(INCISOR), {"lights": ["left", "right"], "polarisation": "cross"}
    columns = [(f"enamel {t:g} mm", *studio.both(INCISOR, enamel={"thickness_mm": t}, **front), mask) for t in (0.35, 0.7, 1.05)]
    zones = {"thickness_mm": {"zones": [0.35, 0.7, 1.05]}}
    columns.append(("0.35 at the neck\nto 1.05 mm", *studio.both(INCISOR, enamel=zones, **front), mask))
    figure_of_pairs(file, studio, "thickness", columns)


def translucency(studio, file):
    mask, front = studio.mask(INCISOR), {"lights": ["left", "right"], "polarisation": "cross"}
    clear = {"absorption_per_mm": [0.01, 0.02, 0.05], "reduced_scattering_per_mm": 1.0}
    columns = [(f"{name}, {'clearer dentine' if d else 'dentine as above'}".replace(", ", "\n"), *studio.both(INCISOR, dentine=d, **scene), mask)
               for d in (None, clear) for name, scene in (("on black", front | {"backing": "black"}), ("on white", front | {"backing": "white"}),
                                                          ("from behind", {"lights": ["behind"], "polarisation": "cross"}))]
    figure_of_pairs(file, studio, "translucency", columns)


def crowns(studio, file):
    lights = ["left", "right", "dome"]
    columns = []
    for name in ("incisor", "canine", "molar"):
        mesh = MESHES / f"{name}.ply"
        columns.append((name, *studio.both(mesh, lights, width_mm=13.0), studio.mask(mesh, width_mm=13.0)))
    figure_of_pairs(file, studio, "crowns", columns)


def teeth(studio, file):
    frame = {"width_mm": 50.0, "aspect": 0.3}
    mesh, pixels = MESHES / "front_teeth.ply", studio.pixels
    studio.pixels = 3 * pixels
    columns = [("six upper front teeth", *studio.both(mesh, ["left", "right", "dome"], **frame), studio.mask(mesh, **frame))]
    studio.pixels = pixels
    figure, axes = pyplot.subplots(3, 1, figsize=(8, 7.6), layout="constrained")
    _, a, b, mask = columns[0]
    median, high = studio.compare("teeth", "six upper front teeth", a, b, mask)
    scale = 0.95 / max(np.quantile(box_mean(p)[mask], 0.995) for p in (a, b))
    axes[0].imshow(displayed(a, scale), interpolation="bicubic"), axes[0].set_title("shader", fontsize=9)
    axes[1].imshow(displayed(b, scale), interpolation="bicubic"), axes[1].set_title("path", fontsize=9)
    ratio = np.where(mask, box_mean(a)[:, :, 1] / np.maximum(box_mean(b)[:, :, 1], 1e-6) - 1, np.nan)
    shown = axes[2].imshow(100 * ratio, cmap="RdBu_r", vmin=-60, vmax=60)
    axes[2].set_title(f"shader / path - 1; CIEDE2000 {median:.1f} / {high:.1f}", fontsize=9)
    figure.colorbar(shown, ax=axes[2], shrink=0.9).set_label("%", fontsize=8)
    for axis in axes:
        axis.set_xticks([]), axis.set_yticks([])
    figure.savefig(file, dpi=100)
    pyplot.close(figure)


def texture(studio, file):
    """Stains between the lobes and at the neck, as a factor on the enamel's absorption in blue more than in red."""
    mesh, mask = MESHES / "stained.ply", studio.mask(INCISOR)
    lights, stain = ["left", "right"], {"vertex_property": ["stain_r", "stain_g", "stain_b"]}
    figure_of_pairs(file, studio, "texture", [("even", *studio.both(INCISOR, lights), mask), ("stained", *studio.both(mesh, lights, texture=stain), mask)])


FIGURES = {"components": components, "taps": twelve_taps, "roughness": roughness, "scattering": scattering, "thickness": thickness,
           "translucency": translucency, "crowns": crowns, "teeth": teeth, "texture": texture}


def main():
    global INCISOR, MESHES
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("crownfit")
    p.add_argument("profile_study")
    p.add_argument("folder", type=Path)
    p.add_argument("--paths", type=int, default=1500, help="per pixel (default 1500)")
    p.add_argument("--pixels", type=int, default=80, help="width of a crown's picture (default 80)")
    p.add_argument("--photons", type=int, default=1000000, help="of the profiles")
    p.add_argument("--only", choices=["profiles", *FIGURES], action="append", help="this figure alone")
    options = p.parse_args()
    options.folder = options.folder.resolve()
    MESHES = options.folder / "work/mesh"
    MESHES.mkdir(parents=True, exist_ok=True)
    INCISOR = MESHES / "incisor.ply"
    tooth_shapes.write_all(MESHES, ROOT / "datasets_synthetic/incisor/mesh/incisor.ply")
    wanted = options.only or ["profiles", *FIGURES]
    if "profiles" in wanted:
        profiles(options)
    studio = Studio(options)
    for name, make in FIGURES.items():
        if name in wanted:
            make(studio, options.folder / f"thesis_{name}.png")
    table = ["| figure | picture | CIEDE2000 median / 95 % | level of shader over path, R G B |", "|---|---|---|---|"]
    table += [f"| {figure} | {name} | {median:.1f} / {high:.1f} | {', '.join(f'{100 * x:+.0f}' for x in level)} % |" for figure, name, median, high, level in studio.rows]
    (options.folder / "table.md").write_text("\n".join(table) + "\n")
    if not options.only:
        tables.write(
            "thesis", title="Both models at the same values", command=f"./dev bench thesis --paths {options.paths}",
            shows="Pictures by the model `shader` of the thesis's scenes, against path tracing at the same values.",
            columns=["figure", "picture", "CIEDE2000, median / 95 %", "light, shader over path, R, G, B"],
            rows=[[figure, name, f"{median:.1f} / {high:.1f}", f"{', '.join(f'{100 * x:+.0f}' for x in level)} %"] for figure, name, median, high, level in studio.rows],
            notes=["Pixels of the object are compared, from one pixel inside its outline.", "The differences include the noise of the path-traced pictures."])


if __name__ == "__main__":
    main()
