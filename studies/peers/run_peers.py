#!/usr/bin/env python3
"""run_peers.py CROWNFIT [STUDY ...]: crownfit against other programs, in one table. STUDY: any of truths, mitsuba, gradient,
slabs, colour, formats, blender, certificate, fits (default: all). Run by ./dev bench peers. certificate: the crown that ./dev demo
fitted, exported and rendered by Mitsuba 3.

The peers are installed from PyPI and npm in build/peers beside the build (about 1.5 GB; truths 3 min, mitsuba 8, blender 5, certificate 4,
fits 25, the others under a minute each, one core). A peer that can't be had is a row "missing" and counts as not run, never as passed.
Exit codes: 0 all that ran agrees; 1 something does not; 77 some peer is missing and the rest agrees.
"""
import argparse
import json
import re
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.append(str(HERE.parent))
import tables  # noqa: E402

PLACE = HERE.parent.parent / "build/peers"
# Blender's own numpy is older than what colour-science wants: two environments.
PACKAGES = {"venv": ["mitsuba", "numpy", "scipy", "iadpython", "colour-science", "materialx"], "blender": ["bpy"]}
STUDIES = {"truths": ("venv", "mitsuba_truths.py"), "mitsuba": ("venv", "compare_mitsuba.py"), "gradient": ("venv", "compare_gradient.py"),
           "slabs": ("venv", "compare_slabs.py"), "colour": ("venv", "compare_colour.py"), "formats": ("venv", "validate_formats.py"),
           "blender": ("venv", "compare_blender.py"), "certificate": ("venv", "compare_mitsuba.py"), "fits": ("venv", "fit_mitsuba.py")}

ROOT = HERE.parent.parent
DEMO = ROOT / "demo_result"
MORE = {"certificate": ["--result", DEMO, "--capture", ROOT / "datasets_synthetic/incisor", "--photograph", "front_black", "--paths", "480"]}


def missing(study, what):
    return [{"peer": study, "what": "", "against": "", "result": what, "limit": "", "verdict": "missing"}]


def run(command, **more):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, **more)
    if done.returncode != 0:
        raise RuntimeError((done.stderr or done.stdout).strip().splitlines()[-1:] or ["exit %d" % done.returncode])


def provide():
    """Virtual environments and node modules; what can't be had shows where it is asked for."""
    for name, packages in PACKAGES.items():
        done = PLACE / name / "installed.txt"
        if done.exists() and done.read_text().split() == packages:
            continue
        print(f"installing {', '.join(packages)} in {PLACE / name}", flush=True)
        try:
            run([sys.executable, "-m", "venv", PLACE / name])
            for package in packages:
                run([PLACE / name / "bin/pip", "install", "--quiet", package])
            done.write_text("\n".join(packages))
        except RuntimeError as error:
            print(f"not installed: {error}", flush=True)
    if not (PLACE / "npm/node_modules/gltf-validator").exists():
        (PLACE / "npm").mkdir(parents=True, exist_ok=True)
        try:
            run(["npm", "install", "--silent", "gltf-validator"], cwd=PLACE / "npm")
        except (RuntimeError, OSError) as error:
            print(f"not installed: gltf-validator: {error}", flush=True)


def rows_of(study, crownfit):
    environment, script = STUDIES[study]
    python = PLACE / environment / "bin/python"
    if not python.exists():
        return missing(study, f"{python} is missing")
    if study == "certificate" and not (DEMO / "material.json").exists():
        return missing(study, "there is no demo_result: ./dev demo makes it")
    begin = subprocess.Popen([str(python), str(HERE / script), crownfit, *map(str, MORE.get(study, []))], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    rows, said = [], []
    for line in begin.stdout:
        if "ROW{" in line:  # after what a peer may have written on the line
            rows.append(json.loads(line[line.index("ROW{") + 3:]))
            line = " ".join(str(rows[-1][k]) for k in ("peer", "what", "result", "verdict")) + "\n"
        said.append(line.rstrip())
        print(line, end="", flush=True)
    code = begin.wait()
    if code != 0:
        is_missing = any("ModuleNotFoundError" in s or "ImportError" in s for s in said)
        rows.append({"peer": study, "what": "the study as a whole", "against": "", "result": f"exit {code}: {(said or [''])[-1][:120]}",
                     "limit": "", "verdict": "missing" if is_missing else "FAIL"})
    elif not rows:
        rows.append({"peer": study, "what": "all of it", "against": "", "result": "see above", "limit": "", "verdict": "agrees"})
    return rows


def pictures_of(rows):
    """Rows of the table of pictures: a comparison, its time at equal noise, and the same with the peer's own boundary."""
    times = {r["what"].partition(": time at equal noise")[0]: r["result"].partition(" times")[0] for r in rows if "time at equal noise" in r["what"]}
    found = []
    for r in rows:
        compared = re.fullmatch(r"(.*), (\d+) blocks", r["what"])
        ratio = re.search(r"(?:ratio|crownfit / Mitsuba) ([\d.]+ \+- [\d.]+)", r["result"])
        z = re.search(r"rms ([\d.]+), largest ([\d.]+)", r["result"])
        if compared and z:
            found.append([compared[1], compared[2], z[1], z[2], ratio[1], times.get(compared[1], "-"), r["verdict"]])
        elif "roughdielectric" in r["what"] and ratio:
            found.append([r["what"], "-", "-", "-", ratio[1], "-", "loses light between facets"])
    return found


def leave_tables(rows):
    """Pictures, fits and the rest; a study that was not run keeps its rows."""
    rows = [r for r in rows if r["verdict"] != "missing" or r["peer"] == "pbrt-v4"]
    fits = [r for r in rows if r["what"].startswith("crown '")]
    pictures = pictures_of(rows)
    rest = [r for r in rows if r not in fits and not (r["peer"] == "Mitsuba 3" and re.search("blocks$|time at equal|roughdielectric", r["what"]))]
    if pictures:
        tables.write(
            "peers_mitsuba", title="Pictures by Mitsuba 3", command="./dev bench peers mitsuba certificate", keyed_by=1,
            shows="Pictures by the model `path`, against those by Mitsuba 3 of what `crownfit export` wrote.",
            columns=["scene", "blocks", "rms z", "largest z", "crownfit / Mitsuba, whole picture", "time at equal noise, Mitsuba / crownfit", "verdict"], rows=pictures,
            notes=["48 x 48 pixels, 400 paths a pixel (of Mitsuba a quarter in rough scenes), blocks of 6 x 6 pixels.", "z is a difference in combined standard errors; the limit is 4.",
                   "Mitsuba's variance comes from eight seeds, so z has wider tails than a normal distribution."])
    if fits:
        tables.write(
            "peers_fits", title="Crowns photographed by Mitsuba 3", command="./dev bench peers fits", keyed_by=1,
            shows="Fits of crowns that Mitsuba 3 photographed, against the material that Mitsuba rendered.", columns=["value", "result", "limit", "verdict"],
            rows=[[r["what"].replace(" photographed by it", ""), r["result"], r["limit"] or "-", r["verdict"]] for r in fits],
            notes=["Photographs have 64 x 64 pixels, 512 paths a pixel and channel and 1 % noise.", "Fits start off by a factor 2."])
    if rest:
        tables.write(
            "peers", title="Other comparisons", command="./dev bench peers", keyed_by=1,
            shows="Other results of crownfit, against other programs and their tables.", columns=["peer", "what", "result", "limit", "verdict"],
            rows=[[r["peer"], r["what"] or "-", r["result"], r["limit"] or "-", r["verdict"] or "-"] for r in rest],
            notes=["No verdict: nothing is claimed."])


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("crownfit")
    p.add_argument("studies", nargs="*", metavar="STUDY", choices=[[], *STUDIES])
    options = p.parse_args()
    provide()
    rows = [row for study in options.studies or STUDIES for row in rows_of(study, options.crownfit)]
    if not options.studies:
        rows += missing("pbrt-v4", "in none of the package archives used: no picture of its export was compared")
    keys = ("peer", "what", "against", "result", "limit", "verdict")
    print("\n| " + " | ".join(keys) + " |\n|" + "---|" * len(keys))
    for row in rows:
        print("| " + " | ".join(str(row[k]) for k in keys) + " |")
    leave_tables(rows)
    verdicts = [row["verdict"] for row in rows]
    print(f"\n{verdicts.count('agrees')} agree, {verdicts.count('FAIL')} fail, {verdicts.count('missing')} missing")
    sys.exit(1 if "FAIL" in verdicts else 77 if "missing" in verdicts else 0)


if __name__ == "__main__":
    main()
