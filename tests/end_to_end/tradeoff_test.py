#!/usr/bin/env python3
"""tradeoff_test.py CROWNFIT CAPTURE: `crownfit benchmark tradeoff` on a small copy of a capture: what its table and plot must hold."""
import csv
import json
import re
import shutil
import subprocess
import sys
import tempfile
import xml.dom.minidom
from pathlib import Path

program, source = sys.argv[1], Path(sys.argv[2])
faults = []


def require(holds, what):
    if not holds:
        faults.append(what)


with tempfile.TemporaryDirectory() as folder:
    capture, out = Path(folder) / "capture", Path(folder) / "out"
    shutil.copytree(source, capture, ignore=shutil.ignore_patterns("photos"))  # pictures are not needed
    size = 24
    camera = json.loads((capture / "calib/camera.json").read_text())
    camera.update(fx=2600, fy=2600, cx=size / 2, cy=size / 2, width=size, height=size)
    (capture / "calib/camera.json").write_text(json.dumps(camera))
    document = json.loads((capture / "capture.json").read_text())
    # A cube of 1.6 mm: small surfaces are cast in no time.
    corners = [(x, y, z) for x in (-0.8, 0.8) for y in (-0.8, 0.8) for z in (-0.8, 0.8)]
    faces = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)]
    (capture / document["object"]["layers"][0]["surface"]).write_text(
        "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\nelement face 12\nproperty list uchar int vertex_indices\nend_header\n"
        + "".join("%g %g %g\n" % v for v in corners) + "".join("3 %d %d %d\n" % t for t in faces))
    document["photographs"] = document["photographs"][:1]
    name = document["photographs"][0]["name"]
    (capture / "capture.json").write_text(json.dumps(document))
    done = subprocess.run([program, "benchmark", "tradeoff", capture, "-o", out, "--paths", "512"], capture_output=True, text=True, timeout=300)
    require(done.returncode == 0, f"exit {done.returncode}: {done.stderr}")
    rows = list(csv.DictReader(open(out / "tradeoff.csv")))
    models = {r["model"] for r in rows}
    require(models == {"shader", "diffusion", "path"} and len(rows) >= 8, f"{len(rows)} rows of {models}")
    for row in rows:
        require(row["status"] != "failed" and float(row["cpu_s"]) > 0 and float(row["peak_MiB"]) > 10 and float(row["de00_median"]) > 0, f"no figures: {row}")
        require(row["name"] in done.stdout, f"{row['name']} is not printed")
        better = [q for q in rows if float(q["cpu_s"]) <= float(row["cpu_s"]) and float(q["de00_median"]) <= float(row["de00_median"]) and q is not row]
        require((row["on_pareto_front"] == "1") == (not better), f"{row['name']} and the Pareto front: beaten by {[q['name'] for q in better]}")
    paths = {int(re.search(r"\d+", r["name"])[0]): r for r in rows if r["model"] == "path" and "half" not in r["name"]}
    errors = [float(paths[n]["de00_p95"]) for n in sorted(paths)]
    # Noise falls by 8 from 4 to 256 paths; the seed is fixed, so the order is.
    require(errors[0] > 2 * errors[-1], f"more paths are not better: {errors}")
    noise = float(re.search(r"noise of CIEDE2000 ([\d.]+)", done.stdout)[1])
    require(0 < noise < float(paths[4]["de00_median"]), f"the reference is as noisy ({noise}) as 4 paths a pixel")
    plot = xml.dom.minidom.parse(str(out / "prediction.svg"))
    circles = plot.getElementsByTagName("circle")
    require(len(circles) == len(rows) + 3, f"{len(circles)} points for {len(rows)} rows and three models")
    inside = all(72 <= float(c.getAttribute("cx")) <= 760 and 0 <= float(c.getAttribute("cy")) <= 500 for c in circles)
    require(inside, "a point lies outside the plot")
    half = (out / "pictures/shader_half_size" / f"{name}.exr").read_bytes()
    require(b"dataWindow\0box2i\0" + (16).to_bytes(4, "little") + bytes(8) + 2 * (size // 2 - 1).to_bytes(4, "little") in half, "half size is not half")
    done = subprocess.run([program, "benchmark", "tradeoff", Path(folder) / "nowhere", "-o", out], capture_output=True, text=True)
    require(done.returncode == 2 and "nowhere" in done.stderr, "a missing capture is not refused by name")

for fault in faults:
    print("FAIL", fault)
print(f"trade-off: {len(faults)} faults")
sys.exit(1 if faults else 0)
