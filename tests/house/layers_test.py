#!/usr/bin/env python3
"""Reads every #include line in src/ against the tables in docs/architecture.md: which module may include which, and in
which file a heavy library may be named. Fails on an arrow the tables do not allow, on a module they do not list, and on
files that include each other in a circle (a header and its .cpp count as one file)."""
import re
import sys
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

root = Path(__file__).resolve().parent.parent.parent
text = (root / "docs/architecture.md").read_text()


def table(heading):
    section = text.split(heading, 1)[1].split("\n## ", 1)[0]
    rows = [[c.strip().strip("`") for c in line.strip("|").split("|")] for line in section.splitlines() if line.startswith("|")]
    return [r for r in rows if not set(r[0]) <= {"-", " "}][1:]


allowed = {}
for module, may in table("## Who may include whom"):
    direct = [m.strip(" `") for m in may.split(",") if m.strip(" `-")]
    allowed[module] = {module} | set(direct).union(*[allowed[m] for m in direct])
libraries = [(header, [f.strip(" `") for f in files.split(",")]) for header, files in table("## Where libraries are named")]

bad = []
included = {}  # by file, without its ending
seen = {header: False for header, _ in libraries}
for file in sorted((root / "src").rglob("*")):
    if file.suffix not in (".h", ".cpp"):
        continue
    relative = file.relative_to(root / "src").as_posix()
    module = relative.split("/")[0] if "/" in relative else "jobs"
    if module not in allowed:
        bad.append(f"{relative}: module '{module}' is not in docs/architecture.md")
        continue
    for name in re.findall(r'^#include\s+["<]([^">]+)[">]', file.read_text(), re.M):
        target = name.split("/")[0] if (root / "src" / name).exists() and "/" in name else ("jobs" if (root / "src" / name).exists() else None)
        if (root / "src" / name).exists() and name.rsplit(".", 1)[0] != relative.rsplit(".", 1)[0]:
            included.setdefault(relative.rsplit(".", 1)[0], set()).add(name.rsplit(".", 1)[0])
        if target and target not in allowed[module]:
            bad.append(f"{relative} includes {name}: '{module}' may not include '{target}'")
        for header, files in libraries:
            if name.startswith(header):
                seen[header] = True
                if not any(relative == f or relative.startswith(f.rstrip("/") + "/") for f in files):
                    bad.append(f"{relative} includes <{name}>, which belongs in {', '.join(files)}")
try:
    TopologicalSorter(included).prepare()
except CycleError as e:
    bad.append("files include each other in a circle: " + " <- ".join(e.args[1]))
bad += [f"docs/architecture.md lists <{header}>, which nothing includes" for header, used in seen.items() if not used]
for line in bad:
    print("FAIL", line)
print(f"{len(allowed)} modules, {len(libraries)} libraries, {len(bad)} faults")
sys.exit(1 if bad else 0)
