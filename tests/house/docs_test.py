#!/usr/bin/env python3
"""Examples in the docs are JSON (with comments), and links lead somewhere, anchors included."""
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


bad, examples, links = [], 0, 0
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

for line in bad:
    print(line)
print(f"{len(pages)} pages, {examples} examples, {links} links, {len(bad)} faults")
sys.exit(1 if bad or not examples or not links else 0)
