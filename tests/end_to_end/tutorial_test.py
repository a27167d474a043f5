#!/usr/bin/env python3
"""tutorial_test.py CROWNFIT PROJECT: does what docs/tutorial.md says about a crown of one's own, with its very text."""
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

program, project = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()
text = (project / "docs/tutorial.md").read_text()
scripts, captures = (re.findall(rf"```{kind}\n(.*?)```", text, re.S) for kind in ("sh", "jsonc"))
assert len(scripts) == 2 and len(captures) == 1, "the tutorial has changed: two scripts and a capture were expected"

with tempfile.TemporaryDirectory() as folder:
    (Path(folder) / "build/release").mkdir(parents=True)
    os.symlink(program, Path(folder) / "build/release/crownfit")
    os.symlink(project / "datasets_synthetic", Path(folder) / "datasets_synthetic")
    run = lambda script: subprocess.run(["sh", "-euc", script], cwd=folder, capture_output=True, text=True)
    done = run(scripts[0])
    assert done.returncode == 0, done.stderr
    (Path(folder) / "my_crown/capture.json").write_text(captures[0])
    done = run(scripts[1])
    assert done.returncode == 0 and "valid" in done.stdout, done.stderr
    assert (Path(folder) / "my_slices.png").stat().st_size > 1000
    done = run("build/release/crownfit fit my_crown -o my_result --model shader --max-pixels 1500")
    assert done.returncode in (0, 1), done.stderr
    print(done.stdout)
