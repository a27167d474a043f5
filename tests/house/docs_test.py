#!/usr/bin/env python3
"""Examples in the docs are JSON (with comments). Links lead somewhere, anchors included, and named source files exist."""
import itertools
import json
import re
import sys
from pathlib import Path

root = Path(__file__).resolve().parent.parent.parent
pages = {page: page.read_text() for page in [*sorted(root.glob("*.md")), root / "studies/README.md", *sorted((root / "docs").rglob("*.md"))]}


def is_json(text):
    try:
        json.loads(text)
        return True
    except json.JSONDecodeError:
        return False


def anchors(text):
    """As GitHub makes them of headings."""
    headings = re.findall(r"^#+ +(.*)$", text, re.M)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def files_of(path):
    """Patterns of the files that `path` names: NAME, READER and EXT stand for any word, {a,b} for each of its parts."""
    parts = re.split(r"\{([^}]*)\}", re.sub(r"NAME|READER|EXT", "*", path))
    return ["".join(choice) for choice in itertools.product(*(p.split(",") if i % 2 else [p] for i, p in enumerate(parts)))]


bad, examples, links, named = [], 0, 0, 0
for page, text in pages.items():
    name = page.relative_to(root)
    for block in re.findall(r"```jsonc?\n(.*?)```", text, re.S):
        block = re.sub(r"//[^\n]*", "", block)
        examples += 1
        if not is_json(block) and not is_json("{" + block + "}"):
            bad.append(f"{name}: an example is no JSON: {block.strip().splitlines()[0]} ...")
    prose = re.sub(r"```.*?```", "", text, flags=re.S)
    for target in re.findall(r"\]\(([^)\s]+)\)", prose):
        if re.match(r"[a-z]+:", target):
            continue
        links += 1
        path, _, anchor = target.partition("#")
        other = (page.parent / path).resolve() if path else page
        if not other.exists():
            bad.append(f"{name}: there is no {target}")
        elif anchor and other in pages and anchor not in anchors(pages[other]):
            bad.append(f"{name}: {target} names no heading")
    for path in re.findall(r"`((?:src|tests|shaders|studies)/[^`\s]+)", prose):
        named += 1
        bad += [f"{name}: there is no {file}" for file in files_of(path) if not any(root.glob(file))]

for line in bad:
    print(line)
print(f"{len(pages)} pages, {examples} examples, {links} links, {named} source files, {len(bad)} faults")
sys.exit(1 if bad or not examples or not links or not named else 0)
