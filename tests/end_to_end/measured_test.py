#!/usr/bin/env python3
"""measured_test.py CROWNFIT FLAT_SAMPLES: readings of flat samples as a user meets them: check, fit, report, predict, iad's files in
and out; and what needs a shape says so."""
import json
import subprocess
import sys
import tempfile
from pathlib import Path

program, samples = sys.argv[1], Path(sys.argv[2])


def run(*arguments, expect=0):
    done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True, timeout=120)
    assert done.returncode == expect, (arguments, done.returncode, done.stderr)
    return done


with tempfile.TemporaryDirectory() as folder:
    folder = Path(folder)
    assert "6 values are free" in run("check", samples).stdout
    assert {m["use"] for m in json.loads(run("check", samples, "--json").stdout)["measurements"]} == {"fit", "holdout"}

    summary = run("fit", samples, "-o", folder / "one", "--threads", 1).stdout
    assert "held out" in summary and "usable" in summary, summary
    run("fit", samples, "-o", folder / "two", "--threads", 2)
    one = (folder / "one/material.json").read_bytes()
    assert one == (folder / "two/material.json").read_bytes(), "material.json differs between 1 and 2 threads"
    material, truth = json.loads(one), json.loads((samples / "truth.json").read_text())
    assert material["model"] == "layered" and material["status"] == "usable", material["reasons"]
    held = 0
    for key in ("reduced_scattering_per_mm", "absorption_per_mm"):
        fitted = material["layers"][0][key]
        held += sum(low <= true <= high for (low, high), true in zip(fitted["interval95"], truth["layers"][0][key]))
    assert held >= 5, f"{held} of 6 intervals hold the truth"
    for reading in material["measurements"]:  # the held-out disc too: no further off than its noise and the fit's
        off = max(abs(p - v) / s for p, v, s in zip(reading["predicted"], reading["value"], reading["stddev"]))
        assert off < 5, (reading["name"], off)
    page = (folder / "one/report.html").read_bytes()
    (folder / "one/report.html").unlink()
    run("report", folder / "one")
    assert (folder / "one/report.html").read_bytes() == page
    assert "design.tp00" in run("predict", folder / "one/material.json", "--thickness", 1, "--draws", 40).stdout

    run("export", folder / "one/material.json", "--to", "rxt", "-o", folder / "iad")
    run("capture", "measured", folder / "iad/material.rxt", "-o", folder / "again", "--stddev", 0.001)
    run("fit", folder / "again", "-o", folder / "three", "--profiles", 0)
    again = json.loads((folder / "three/material.json").read_text())["layers"][0]
    for key in ("reduced_scattering_per_mm", "absorption_per_mm"):
        for a, b in zip(again[key]["value"], material["layers"][0][key]["value"]):
            assert abs(a / b - 1) < 0.01, (key, a, b)

    # A fit's own result as its prior moves nothing, whatever its bands: where scattering follows a power law too.
    def banded(name, *nm):
        capture = json.loads((samples / "capture.json").read_text())
        capture["channels"] = [{"name": c, "wavelength_nm": w} for c, w in zip("RGB", nm)]
        capture["object"]["layers"][0]["reduced_scattering_per_mm"]["shared"] = "power_law"
        (folder / name).mkdir()
        (folder / name / "capture.json").write_text(json.dumps(capture))
        return folder / name

    for name, *nm in (("typical", 610, 560, 465), ("infrared", 940, 850, 705)):
        capture = banded(name, *nm)
        run("fit", capture, "-o", folder / f"{name}_alone", "--profiles", 0)
        alone = folder / f"{name}_alone/material.json"
        done = subprocess.run([program, "fit", capture, "-o", folder / f"{name}_prior", "--profiles", "0", "--prior", alone], capture_output=True, text=True)
        if name == "typical":  # the prior says everything
            assert done.returncode == 1 and "can be used by itself" in done.stdout and "If the model held" not in done.stdout, done
        else:  # far from 540 nm a level and an exponent, each by itself, say less
            assert done.returncode == 0, done
        before, after = (json.loads((folder / f"{name}_{how}/material.json").read_text()) for how in ("alone", "prior"))
        for key in ("reduced_scattering_per_mm", "absorption_per_mm"):
            b, a = before["layers"][0][key], after["layers"][0][key]
            off = max(abs(x - y) / s for x, y, s in zip(a["value"], b["value"], b["stddev"]))
            assert off < 0.3, (name, key, off, a, b)
    said = run("fit", samples, "-o", folder / "no", "--prior", folder / "typical_alone/material.json", expect=2).stderr
    assert "610, 560, 465 nm" in said and "600, 540, 450 nm" in said and "channels" in said, said
    assert "false colours" in run("predict", folder / "infrared_alone/material.json", "--thickness", 1, "--draws", 40).stderr
    said = run("check", banded("grey", 540, 540, 540), expect=2).stderr
    assert "channels" in said and "power law" in said, said

    # What needs a shape, or photographs' models, says so.
    has_viewer = "--screenshot" in run("view", "--help").stdout
    for command in (["render", samples, "-o", folder / "no"],
                    *[["view", folder / "one/material.json", "--capture", samples, "--screenshot", folder / "no.png"]] * has_viewer,
                    ["export", folder / "one/material.json", "--to", "gltf", "--capture", samples, "-o", folder / "no"],
                    ["match", folder / "one/material.json", "--capture", samples, "-o", folder / "no.json"], ["check", samples, "-o", folder / "no.png"],
                    ["fit", samples, "-o", folder / "no", "--model", "path"]):
        said = run(*command, expect=2).stderr
        assert "measurements alone" in said or "--model" in said, (command, said)
