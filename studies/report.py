#!/usr/bin/env python3
"""Writes docs/validation.md from the tables that studies left in studies/results. Run by `./dev bench report`."""
import re
import sys
from pathlib import Path

import tables

PAGE = Path(__file__).resolve().parent.parent / "docs/validation.md"
INTRODUCTION = """\
# Validation

This page shows how accurate, how fast and how stable crownfit is, bad figures included. Forward models are compared with published tables, with
other programs and with each other. Fits are compared with captures whose true material is known: path-traced by crownfit or by Mitsuba.
Speed and stability are measured on the same captures.

Every table names the date of its run, and the command that runs it again or that there is none. [studies/README.md](../studies/README.md) lists the studies
and what they cost. A study leaves its table in `studies/results`. `./dev bench report` writes this page from them: edit the tables, not the page.

Unless a table says otherwise: two processor cores, g++ 12.2, release build for baseline x86-64. A dash stands for what was not measured.
`$CROWNFIT_REFERENCE` is a folder of external data that is not part of this project.
"""
# Sections, and the tables in each, by the names of their files. Tables that no section names come last.
SECTIONS = [
    ("Aims", ["aims"]),
    ("Accuracy of the forward models",
     ["formulas", "path_checks", "slab_tables", "sphere", "estimators", "cube", "truth_shader", "truth_shader_photographs", "truth_path",
      "truth_path_photographs", "thesis", "diffusion", "derivatives", "quadrature", "bands", "conversions"]),
    ("Recovery and intervals",
     ["bundled", "recovery", "recovery_errors", "interval_checks", "redraws", "free_thickness", "thickness_causes", "steps", "micro_ct", "unusual_scenes", "self_consistency", "junction",
      "real_teeth", "image_regions"]),
    ("Fits planned for a target", ["promise", "promise_draws", "plan_costs"]),
    ("Identifiability and wrong statements", ["wrong", "requirements", "requirements_fits", "shared_laws", "shared_laws_kept"]),
    ("Speed", ["fit_times", "benchmark", "channels", "tradeoff", "tradeoff_fits", "views", "batch"]),
    ("Viewer", ["viewer_accuracy", "viewer_speed", "viewer_match"]),
    ("Calibration", ["calibration", "exposure_series", "lab_session", "blur"]),
    ("Stability at the extremes", ["stability", "stability_checks", "extremes", "equal_indices"]),
    ("Other programs", ["peers_mitsuba", "peers_fits", "peers"]),
    ("Dental figures", ["published_samples", "aperture"]),
    ("Robustness", ["robustness"]),
]


def anchor(heading):
    """As GitHub makes it."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def section_of(title, contents):
    text = f"\n## {title}\n"
    for table in contents:
        command = f"`{table['command']}`" if table["command"] else "No command prints this table"
        text += f"\n### {table['title']}\n\n{table['shows']}\n{command} ({table['date']}).\n\n{tables.markdown(table)}"
        text += "\n" + " ".join(table["notes"]) + "\n" if table["notes"] else ""
    return text


def main():
    found = tables.read_all()
    named = {name for _, names in SECTIONS for name in names}
    sections = [(title, [found[name] for name in names if name in found]) for title, names in SECTIONS + [("Other tables", sorted(set(found) - named))]]
    sections = [(title, contents) for title, contents in sections if contents]
    headings = [anchor(heading) for title, contents in sections for heading in (title, *(table["title"] for table in contents))]
    if twice := sorted({heading for heading in headings if headings.count(heading) > 1}):
        sys.exit(f"two headings have the anchor {', '.join(twice)}: give one of these tables another title")
    contents_list = "".join(f"- [{title}](#{anchor(title)}): " + ", ".join(f"[{table['title']}](#{anchor(table['title'])})" for table in contents) + "\n"
                            for title, contents in sections)
    PAGE.write_text(INTRODUCTION + "\n" + contents_list + "".join(section_of(*section) for section in sections))
    print(f"{PAGE}: {len(found)} tables")


if __name__ == "__main__":
    main()
