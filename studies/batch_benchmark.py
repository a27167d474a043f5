#!/usr/bin/env python3
"""batch_benchmark.py CROWNFIT CAPTURE: what a batch costs beside the fits, how two jobs share two processors, and how soon
a finished manifest is known to be finished."""
import hashlib
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import tables

program, capture, here = sys.argv[1], Path(sys.argv[2]).resolve(), Path(__file__).resolve().parent.parent / "tests/batch"


def timed(*line, env={}):
    """Seconds, and MiB resident at most."""
    begin = time.time()
    batch = subprocess.Popen([program, "batch", *map(str, line)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env={**os.environ, **env})
    _, status, used = os.wait4(batch.pid, 0)
    assert os.waitstatus_to_exitcode(status) in (0, 1)
    return time.time() - begin, used.ru_maxrss / 1024


with tempfile.TemporaryDirectory() as folder:
    folder = Path(folder)
    # Captures with as many files as a true one has, all of which are looked at.
    files = [f"file{i}" for i in range(16)]
    (folder / "result/figures").mkdir(parents=True)
    (folder / "result/figures/front.png").write_bytes(bytes(100000))
    digests = {name: hashlib.sha256(name.encode()).hexdigest() for name in ["capture.json", *files]}
    parameters = {f"absorption_{k}": {"value": [0.1, 0.2, 0.3], "stddev": [0.01, 0.01, 0.01], "interval95": [[0, 1]] * 3, "status": "fitted"} for k in range(4)}
    (folder / "result/material.json").write_text(json.dumps({
        "format": "crownfit-material/1", "status": "usable", "reasons": [], "channels": [{"name": c} for c in "RGB"],
        "image_error": {"fit": {"de00_median": 0.5, "de00_p95": 1.0}}, "layers": [{"name": "enamel", **parameters}, {"name": "dentine", **parameters}],
        "surface": {}, "provenance": {"inputs_sha256": digests}}))
    rows = 5000
    for i in range(rows):
        (folder / f"c{i}").mkdir()
        for name in ["capture.json", *files]:
            (folder / f"c{i}" / name).write_text("{}")
    manifest = folder / "manifest.csv"
    pretend = ["--program", here / "pretend_fit.sh"]
    env = {"PRETEND_RESULT": str(folder / "result")}
    manifest.write_text("id,capture,group\n" + "".join(f"c{i},c{i},{'AB'[i % 2]}\n" for i in range(200)))
    alone = time.time()
    for i in range(200):
        subprocess.run([here / "pretend_fit.sh", "fit", folder / f"c{i}", "-o", folder / f"alone/{i}"], check=True, env={**os.environ, **env})
    alone = time.time() - alone
    whole, _ = timed(manifest, "-o", folder / "few", "--jobs", 1, *pretend, env=env)
    print(f"200 pretended fits, one at a time: {1000 * alone / 200:.1f} ms each alone, {1000 * whole / 200:.1f} ms in a batch: "
          f"{1000 * (whole - alone) / 200:.1f} ms for the batch")
    manifest.write_text("id,capture,group\n" + "".join(f"c{i},c{i},{'AB'[i % 2]}\n" for i in range(rows)))
    first, _ = timed(manifest, "-o", folder / "many", *pretend, env=env)
    again, MiB = timed(manifest, "-o", folder / "many", *pretend, env=env)
    print(f"{rows} crowns of {len(files) + 1} files: {first:.1f} s to pretend, {again:.2f} s to see that all are finished, "
          f"with {MiB:.0f} MiB")
    manifest.write_text("id,capture,max_pixels\n" + "".join(f"s{i},{capture},{200 + i}\n" for i in range(8)))
    one, two = (timed(manifest, "-o", folder / f"jobs{j}", "--jobs", j, "--threads", 1)[0] for j in (1, 2))
    print(f"8 fits of {capture.name}, one thread each: {one:.1f} s one at a time, {two:.1f} s two at a time: {one / two:.2f} times as fast")
tables.write(
    "batch", title="What a batch costs", command="./dev bench batch", keyed_by=1,
    shows="Time and memory of `crownfit batch` beside its fits, against the same fits without it.", columns=["what", "cost"],
    rows=[["the batch, a crown (200 pretended fits, one at a time)", f"{1000 * (whole - alone) / 200:.0f} ms"],
          ["8 fits of one thread each, 2 jobs against 1", f"{one / two:.2f} times as fast"],
          ["a finished manifest of 5,000 crowns with 17 files each, run again", f"{again:.1f} s, {MiB:.0f} MiB"]],
    notes=["A batch starts each fit as a process of its own."])
