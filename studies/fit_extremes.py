#!/usr/bin/env python3
"""fit_extremes.py CROWNFIT DATASETS DIR [COUNT] [--case N]: fits of random captures over the whole range of every parameter.

Case N is the same in every run: a bundled body of 32 to 64 pixels, materials and surfaces drawn from their whole ranges, often
from a corner, lit as bundled or 100 times brighter or darker, some of its photographs, some of its numbers free, started off by up
to a factor 4. Four of five are made by the model `shader` with 1 % noise and fitted by it (with the same light samples); the fifth is path-traced and fitted by walks.
Every fit must end with a true status. Faults: a crash, a time-out, a number that is none, a number called at its bound that is
not, a result that is not usable without a reason, a result called usable in which a number called fitted misses the truth by more than 4 of
its standard deviations. One line a case goes to DIR/results.jsonl; the
same command goes on where it was stopped. Captures with a fault stay in DIR. Times are of the processor:
none may take more than 900 s.
"""
import argparse
import json
import math
import random
import resource
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import tables

BOUNDS = {"reduced_scattering_per_mm": (1e-3, 100), "absorption_per_mm": (1e-5, 20), "roughness": (0.01, 1), "thickness_mm": (0.02, 20), "ior": (1, 3), "g": (-0.99, 0.99)}
BODIES = ("disc", "incisor_shader", "sphere")
CHANNELS = "RGB"
LIMIT_S = 900  # of processor time, so that what runs beside does not matter


def drawn(r, low, high, corners, log=True):
    """From the whole range; one time in four a corner."""
    if r.random() < 0.25:
        return r.choice(corners)
    return math.exp(r.uniform(math.log(low), math.log(high))) if log else r.uniform(low, high)


def channels(r, low, high, corners):
    middle = drawn(r, low, high, corners)
    return [min(high, max(low, middle * math.exp(r.gauss(0, 0.5)))) for _ in range(3)]


def true_capture(r, source):
    """The bundled capture with other values, every one fixed; and which of them a fit is to find."""
    capture = json.loads((source / "capture.json").read_text())
    free = []
    for layer in capture["object"]["layers"]:
        scattering = channels(r, 1e-3, 100, (1e-3, 0.01, 30, 100))
        layer["reduced_scattering_per_mm"] = {"fixed": scattering if r.random() < 0.5 else scattering[0]}
        layer["absorption_per_mm"] = {"fixed": channels(r, 1e-5, 20, (1e-5, 1e-3, 5, 20))}
        layer["ior"] = {"fixed": drawn(r, 1.2, 1.8, (1.0, 1.33, 2.4, 3.0), log=False)}
        layer["g"] = {"fixed": drawn(r, 0.0, 0.95, (-0.99, 0.0, 0.99), log=False)}
        if "thickness_mm" in layer:
            thickness = drawn(r, 0.1, 1.0, (0.05, 1.2))
            if layer is not capture["object"]["layers"][-1]:  # whose mesh is as deep as it is
                layer["thickness_mm"] = {"fixed": thickness}
        free += [(layer["name"], "reduced_scattering_per_mm"), (layer["name"], "absorption_per_mm")]
        for key, chance in (("ior", 0.1), ("g", 0.1), ("thickness_mm", 0.2)):
            if key in layer and r.random() < chance:
                free.append((layer["name"], key))
    surface = capture["object"]["surface"]
    surface["roughness"] = {"fixed": drawn(r, 0.01, 1.0, (0.01, 1.0))}
    surface["wetness"] = {"fixed": r.choice((0, 0, 0, 0.5, 1))}
    if r.random() < 0.6:
        free.append(("surface", "roughness"))
    shots = [p for p in capture["photographs"] if p["use"] == "fit"]
    r.shuffle(shots)
    capture["photographs"] = shots[: r.randint(1, len(shots))]
    for shot in capture["photographs"]:
        shot.pop("variance", None)
    return capture, free


def call(*words):
    """The program's end, and the processor time it took."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([str(w) for w in words] + ["--progress", "none"], capture_output=True, text=True, errors="replace",
                          preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (LIMIT_S, LIMIT_S)))
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return done, round(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, 1)


def owner_of(document, name):
    return document["object"]["surface"] if name == "surface" else next(l for l in document["object"]["layers"] if l["name"] == name)


def started_off(r, capture, free):
    """What the fit is given: start values in place of the true ones."""
    given = json.loads(json.dumps(capture))
    for name, key in free:
        truth, (low, high) = owner_of(capture, name)[key]["fixed"], BOUNDS[key]
        off = lambda v: min(high, max(low, v + r.uniform(-0.1, 0.1) if key in ("ior", "g") else v * math.exp(r.uniform(-1, 1) * math.log(4))))
        owner_of(given, name)[key] = {"initial": [off(v) for v in truth] if isinstance(truth, list) else off(truth)}
    if r.random() < 0.2:
        for shot in given["photographs"]:
            shot["exposure_scale"] = {"initial": 1}
    return given


def make(program, source, folder, number):
    """Writes the capture; returns how it was made, or why it can't be."""
    r = random.Random(number)
    by_path = number % 5 == 4
    shutil.copytree(source, folder, ignore=shutil.ignore_patterns("photos", "truth.json"))
    size, brightness = r.choice((32, 48, 64)), r.choice((1, 1, 1, 0.01, 100))
    camera = json.loads((folder / "calib/camera.json").read_text())
    scale = size / camera["width"]
    camera.update(width=size, height=size, **{k: camera[k] * scale for k in ("fx", "fy", "cx", "cy")})
    (folder / "calib/camera.json").write_text(json.dumps(camera))
    rig = json.loads((folder / "calib/light_rig.json").read_text())
    for light in rig["lights"]:
        light["radiance_rgb"] = [brightness * v for v in light["radiance_rgb"]]
    (folder / "calib/light_rig.json").write_text(json.dumps(rig))
    truth, free = true_capture(r, source)
    given = started_off(r, truth, free)
    what = dict(case=number, body=source.name, pixels=size, brightness=brightness, maker="path" if by_path else "shader",
                photographs=[p["name"] for p in given["photographs"]], free=[".".join(f) for f in free])
    if by_path:
        recipe = dict(truth, format="crownfit-recipe/1", synthesis={"paths_per_pixel": 128, "seed": number, "initial_factor": 2, "free": what["free"]})
        (folder / "recipe.json").write_text(json.dumps(recipe))
        (folder / "capture.json").unlink()
        return truth, folder / "made", what, call(program, "synthesize", folder / "recipe.json", "-o", folder / "made")[0]
    (folder / "capture.json").write_text(json.dumps(truth))
    done = call(program, "render", folder, "-o", folder / "photos", "--noise", "0.01", "--seed", number)[0]
    (folder / "capture.json").write_text(json.dumps(given))
    return truth, folder, what, done


def judged(material, truth, free):
    """(name, status, z of ln or of the value) for everything free; and what is wrong."""
    rows, faults = [], []
    for name, key in free:
        mine = (material["surface"] if name == "surface" else next(l for l in material["layers"] if l["name"] == name))[key]
        right = owner_of(truth, name)[key]["fixed"]
        values = mine["value"] if isinstance(mine["value"], list) else [mine["value"]]
        intervals = mine["interval95"] if isinstance(mine["interval95"][0], list) else [mine["interval95"]]
        ends = [abs(v - end) <= 0.05 * abs(end) for v in values if v is not None for end in BOUNDS[key]]
        if mine["status"] == "at_bound" and key != "thickness_mm" and not any(ends):  # a thickness ends where its layer does
            faults.append(f"{name}.{key} is called at its bound: {values}")
        for c, (value, interval) in enumerate(zip(values, intervals)):
            goal = right[c] if isinstance(right, list) else right
            label = f"{name}.{key}" + (f"[{CHANNELS[c]}]" if len(values) > 1 else "")
            if value is None or any(end is None for end in interval):
                if value is None or mine["status"] != "not_identified":
                    faults.append(f"{label} is no number")
                continue
            low, high = interval
            if low > 0 and value > 0 and goal > 0 and key not in ("ior", "g"):
                low, high, value, goal = map(math.log, (low, high, value, goal))
            z = (value - goal) / max(1e-9, (high - low) / 3.92)
            rows.append((label, mine["status"], round(z, 2)))
    return rows, faults


def run(program, datasets, folder, number):
    source = datasets / BODIES[number % len(BODIES)]
    shutil.rmtree(folder, ignore_errors=True)
    truth, capture, what, made = make(program, source, folder, number)
    if made.returncode != 0:
        what.update(exit=made.returncode, status="not made", reasons=[made.stderr.strip()[:300]], faults=[] if made.returncode == 2 else ["its photographs could not be made"])
        return what
    model = ["--model", "path", "--walks", "100000"] if what["maker"] == "path" else ["--model", "shader", "--profiles", "0"]
    done, seconds = call(program, "fit", capture, "-o", folder / "result", *model)
    what.update(exit=done.returncode, seconds=seconds)
    if done.returncode == 2:
        what.update(status="refused", reasons=[done.stderr.strip()[:300]], faults=[])
        return what
    if done.returncode not in (0, 1):
        slow = done.returncode in (-signal.SIGXCPU, -signal.SIGKILL)
        what.update(status="too slow" if slow else "crashed", faults=[f"exit {done.returncode}: {done.stderr.strip()[-300:]}"])
        return what
    material = json.loads((folder / "result/material.json").read_text())
    rows, faults = judged(material, truth, [tuple(f.split(".", 1)) for f in what["free"]])
    usable = material["status"] == "usable"
    if not usable and not material["reasons"]:
        faults.append("not usable, and no reason given")
    fitted = [(label, z) for label, status, z in rows if status == "fitted"]
    if usable:
        faults += [f"{label} is called fitted and off by {z} standard deviations" for label, z in fitted if abs(z) > 4]
    what.update(status=material["status"], reasons=material["reasons"], chi2=material["identifiability"]["reduced_chi2"], numbers=rows,
                fitted=len(fitted), held=sum(abs(z) <= 1.96 for _, z in fitted), faults=faults)
    return what


def summary(lines):
    of = lambda status: [l for l in lines if l.get("status") == status]
    print(f"{len(lines)} cases: " + ", ".join(f"{len(of(s))} {s}" for s in sorted({l.get("status", "no end") for l in lines})))
    for maker in ("shader", "path"):
        good = [l for l in of("usable") if l["maker"] == maker]
        fitted, held = sum(l["fitted"] for l in good), sum(l["held"] for l in good)
        if fitted:
            print(f"made by {maker}: {len(good)} usable, 95 % intervals of what is called fitted hold the truth {held} of {fitted} times")
    reasons = [reason.split(":")[0][:110] for l in lines for reason in l.get("reasons", [])]
    for reason in sorted(set(reasons), key=reasons.count, reverse=True):
        print(f"  {reasons.count(reason):3d} x {reason}")
    for line in lines:
        for fault in line["faults"]:
            print(f"FAULT in case {line['case']}: {fault}")


def table(lines):
    """The rows of docs/validation.md, for either maker."""
    columns = []
    for maker in ("shader", "path"):
        mine = [l for l in lines if l["maker"] == maker]
        good, seconds = [l for l in mine if l.get("status") == "usable"], [l["seconds"] for l in mine if "seconds" in l]
        worst = [abs(z) for l in good for _, status, z in l["numbers"] if status == "fitted"]
        columns.append([len(mine), len(good), len(mine) - len(good), sum(l["fitted"] for l in good), sum(l["held"] for l in good), f"{max(worst, default=0):.1f}",
                        f"{sum(seconds) / max(1, len(seconds)):.0f} s, at most {max(seconds, default=0):.0f} s", sum(len(l["faults"]) for l in mine)])
    names = ["cases", "usable", "not usable or refused", "values reported as fitted in usable results", "of these within their 95 % intervals",
             "furthest, nominal deviations", "processor time of a fit", "faults"]
    return [[name, *values] for name, *values in zip(names, *columns)]


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("crownfit")
    p.add_argument("datasets", type=Path)
    p.add_argument("folder", type=Path)
    p.add_argument("count", type=int, nargs="?", default=30)
    p.add_argument("--case", type=int, help="only this one, again")
    a = p.parse_args()
    a.folder.mkdir(parents=True, exist_ok=True)
    file = a.folder / "results.jsonl"
    lines = {l["case"]: l for l in map(json.loads, file.read_text().splitlines())} if file.exists() else {}
    for number in range(a.count) if a.case is None else [a.case]:
        if number in lines and a.case is None:
            continue
        folder = a.folder / f"case_{number}"
        lines[number] = run(a.crownfit, a.datasets, folder, number)
        with open(file, "a") as f:
            f.write(json.dumps(lines[number]) + "\n")
        print(json.dumps({k: v for k, v in lines[number].items() if k != "numbers"}), flush=True)
        if not lines[number]["faults"] and a.case is None:
            shutil.rmtree(folder)
    summary([lines[n] for n in sorted(lines)])
    if a.case is None:
        tables.write(
            "extremes", title="Fits over the whole range", command=f"./dev bench extremes {a.count}",
            shows="Fits of random captures over the whole range of every parameter, against their known materials.",
            columns=["quantity", "made and fitted by `shader`", "path-traced, fitted by `path` with 100,000 paths a photograph"], rows=table([lines[n] for n in sorted(lines)]),
            notes=["Faults are crashes, more than 900 s, values that are no numbers, missing reasons, and usable values more than 4 deviations off."])
    return 1 if any(l["faults"] for l in lines.values()) else 0


if __name__ == "__main__":
    sys.exit(main())
