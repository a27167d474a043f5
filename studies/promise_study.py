#!/usr/bin/env python3
"""promise_study.py CROWNFIT REFERENCE WORK [--seed N] [--discs N] [--crowns N]: whether fits planned by --budget-s and
--target-de00 keep what was asked, on captures drawn by REFERENCE/acceptance/make_recipes.py (64 x 64 pixels).

Every capture is fitted within 30, 60, 120 or 300 s of two cores (kept when the processor took at most twice that) and to
CIEDE2000 0.5, 1, 2 or 4: kept when photographs of the fitted and of the true material differ by at most that, median over
blocks. A fit by walks is wrong by its numbers alone: both materials are shown by walks that are handed over to diffusion late, with
common random numbers (what those leave of their noise counts as a difference). A fit by shader is compared by walks to their
end. A plan may refuse: then nothing was promised. Of all these fits' values that are called fitted it
is counted how many intervals hold the truth. What a run was stopped at is gone on with.
"""
import argparse
import json
import math
import re
import resource
import subprocess
import sys
from pathlib import Path

import tables
from recovery_study import chi2_of, values_of

BUDGETS, TARGETS = (30, 60, 120, 300), (0.5, 1, 2, 4)
PATHS = 1024  # a pixel of a fit by shader
HANDED_OVER = ["--model", "diffusion", "--collisions", 33, "--paths", 256]


def call(*words):
    """The program's end and the processor's seconds it took."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([str(w) for w in words], capture_output=True, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return done, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def planned(program, capture, result, *asked):
    """(model, the plan's line, seconds) of a fit; None where the plan refuses. Kept in the result's folder."""
    note = result / "promise.json"
    if not note.exists():
        result.mkdir(parents=True, exist_ok=True)
        done, seconds = call(program, "fit", capture, "-o", result, "--model", "auto", *asked, "--progress", "none")
        if done.returncode not in (0, 1, 2):
            sys.exit(f"{capture}: exit {done.returncode}: {done.stderr}")
        if done.returncode == 2:
            note.write_text(json.dumps({"refused": done.stderr.strip()}))
        else:
            plan = re.search(r"Plan: (.*)\.$", done.stderr, re.M)[1]
            note.write_text(json.dumps({"plan": plan, "seconds": seconds}))
    return json.loads(note.read_text())


def difference(program, capture, result, by_walks):
    """CIEDE2000 of photographs with the fitted and with the true material, median over blocks; mean over photographs."""
    shots = [p["name"] for p in json.loads((capture / "capture.json").read_text())["photographs"] if p["use"] == "fit"]
    shots = shots[:1] if by_walks else shots
    model = ["--model", "path", "--paths", PATHS] if by_walks else HANDED_OVER
    off = []
    for shot in shots:
        for name, material in (("true", capture / "truth.json"), ("fitted", result / "material.json")):
            call(program, "render", capture, "--material", material, "-o", result / name, "--photograph", shot, *model)
        said = call(program, "compare", result / f"true/{shot}.exr", result / f"fitted/{shot}.exr")[0].stdout
        off.append(float(re.search(r"de00_median (\S+)", said)[1]))
    return sum(off) / len(off)


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("crownfit")
    p.add_argument("reference", type=Path)
    p.add_argument("work", type=Path)
    p.add_argument("--seed", type=int, default=1)
    p.add_argument("--discs", type=int, default=8)
    p.add_argument("--crowns", type=int, default=12)
    p.add_argument("--calibration-error", action="store_true")
    o = p.parse_args()
    work = o.work / f"seed{o.seed}{'_calibration' if o.calibration_error else ''}"
    subprocess.run([sys.executable, o.reference / "acceptance/make_recipes.py", work / "recipes", "--seed", str(o.seed), "--discs", str(o.discs),
                    "--crowns", str(o.crowns), "--pixels", "64", "--paths", "256"] + ["--calibration-error"] * o.calibration_error, check=True, stdout=subprocess.DEVNULL)
    kept, made = {"budget": 0, "target": 0}, {"budget": 0, "target": 0}
    pulls, held, chi2, freedom = [], [], 0, 0
    rows, refused, reached = [], [], []

    def judge(what, asked, fit, found, is_kept, result, capture):
        nonlocal chi2, freedom
        kept[what] += is_kept
        made[what] += 1
        values = [(pull, holds) for *_, pull, holds, status in values_of(result, capture) if status == "fitted"]
        pulls.extend(pull for pull, _ in values)
        held.extend(holds for _, holds in values)
        of_fit, free = chi2_of(result, capture)
        chi2, freedom = chi2 + of_fit, freedom + free
        status = json.loads((result / "material.json").read_text())["status"]
        rows.append([f"`{capture.name}`", asked, fit["plan"], f"{'kept' if is_kept else '**broken**'}: {found}", f"{sum(h for _, h in values)} of {len(values)}",
                     f"{of_fit:.1f} of {free}"])
        print(f"  {fit['plan']}; {found}: {'kept' if is_kept else 'BROKEN'}; {status}, intervals hold {sum(h for _, h in values)} of {len(values)}, chi2 {of_fit:.1f} of {free}", flush=True)

    for i, recipe in enumerate(sorted((work / "recipes").iterdir(), key=lambda r: (int(r.name[-2:]), r.name))):
        capture = work / recipe.name
        if not (capture / "truth.json").exists():
            subprocess.run([o.crownfit, "synthesize", recipe / "recipe.json", "-o", capture, "--progress", "none"], check=True, stdout=subprocess.DEVNULL)
        print(recipe.name)
        budget, target = BUDGETS[i % 4], TARGETS[i // 2 % 4]
        result = work / f"{recipe.name}_budget"
        fit = planned(o.crownfit, capture, result, "--budget-s", budget)
        if "refused" in fit:
            print(f"  refused {budget} s")
            refused.append(f"{budget} s")
        else:
            judge("budget", f"{budget} s", fit, f"{fit['seconds'] / 2:.0f} s", fit["seconds"] / 2 <= budget, result, capture)
        result = work / f"{recipe.name}_target"
        fit = planned(o.crownfit, capture, result, "--target-de00", target)
        if "refused" in fit:
            print(f"  refused CIEDE2000 {target}")
            refused.append(f"CIEDE2000 {target}")
        else:
            off = difference(o.crownfit, capture, result, by_walks=fit["plan"].startswith("model shader"))
            reached.append(off)
            judge("target", f"CIEDE2000 {target}", fit, f"{off:.2f}, {fit['seconds'] / 2:.0f} s", off <= target, result, capture)
    for what in kept:
        print(f"{what}: kept {kept[what]} of {made[what]}")
    if pulls:
        rms = math.sqrt(sum(q * q for q in pulls) / len(pulls))
        print(f"intervals hold {sum(held)} of {len(held)}; pulls: rms {rms:.2f}, worst {max(pulls, key=abs):+.2f}; chi2 {chi2:.0f}, expected {freedom} +- {math.sqrt(2 * freedom):.0f}")
        tables.write(
            "promise", title="Plans and what they kept", command=f"./dev bench promise {' '.join(sys.argv[4:])}",
            shows="Whether fits with `--target-de00` or `--budget-s` keep the target or the budget, on captures drawn at random with a known material.",
            columns=["capture", "asked", "planned, at most", "result", "intervals of fitted values that hold", "chi-squared of all values"], rows=rows,
            notes=["Photographs have 64 x 64 pixels. Seconds are half of the processor time.",
                   "CIEDE2000 compares pictures of the fitted and of the true material by the model `diffusion` after 33 collisions, with common random numbers."])
        tables.write(
            "promise_draws", title="Draws of planned fits", command="./dev bench promise --seed N --discs 4 --crowns 6 --calibration-error", keyed_by=1,
            shows="How many plans were kept in each draw of captures, against their known materials.",
            columns=["seed", "date", "plans kept", "CIEDE2000 reached", "refused", "intervals of fitted values that hold", "chi-squared of all values"],
            rows=[[o.seed, tables.today(), f"{sum(kept.values())} of {sum(made.values())}", f"{min(reached):.2f} to {max(reached):.2f}" if reached else "-",
                   ", ".join(refused) or "-", f"{sum(held)} of {len(held)}", f"{chi2:.0f} of {freedom} +- {math.sqrt(2 * freedom):.0f}"]],
            notes=["A refused budget or target promises nothing."])


if __name__ == "__main__":
    main()
