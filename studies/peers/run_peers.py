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
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
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
    verdicts = [row["verdict"] for row in rows]
    print(f"\n{verdicts.count('agrees')} agree, {verdicts.count('FAIL')} fail, {verdicts.count('missing')} missing")
    sys.exit(1 if "FAIL" in verdicts else 77 if "missing" in verdicts else 0)


if __name__ == "__main__":
    main()
