#!/usr/bin/env python3
"""report_test.py CROWNFIT CAPTURE: report.html of a fit in a real browser: nothing to complain of, no network, the wipe by
keyboard and by hand, light and dark, print; and `crownfit report` on results that were moved or damaged. Exit code 77: no
browser here."""
import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

program, capture = sys.argv[1], Path(sys.argv[2])
sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "support"))
from browser import Page  # noqa: E402


def run(*arguments, expect=0):
    done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True, timeout=300)
    assert done.returncode == expect, (arguments, done.returncode, done.stderr)
    return done


with tempfile.TemporaryDirectory() as folder:
    folder = Path(folder)
    # A name that would be markup if anything took it for that.
    hostile = folder / "<img src=x onerror=alert(1)>"
    shutil.copytree(capture, hostile)
    content = json.loads((hostile / "capture.json").read_text())
    content["photographs"] = [p for p in content["photographs"] if p["name"] in ("front", "side")]
    # Readings of a flat piece of the same two layers stand beside the photographs.
    truth, sample_mm, read = json.loads((capture / "truth.json").read_text()), [0.7, 2.0], {"reflectance": [], "transmittance": []}
    for c in range(3):
        (folder / "slab.json").write_text(json.dumps({"format": "crownfit-slab/1", "layers": [
            {"thickness_mm": mm, "ior": l["ior"], "g": l["g"], "scattering_per_mm": l["reduced_scattering_per_mm"][c] / (1 - l["g"]), "absorption_per_mm": l["absorption_per_mm"][c]}
            for mm, l in zip(sample_mm, truth["layers"])]}))
        answer = json.loads(run("slab", folder / "slab.json").stdout)
        for quantity in read:
            read[quantity].append(answer[f"{quantity}_collimated"])
    content["measurements"] = [{"name": "coupon", "thickness_mm": sample_mm, "geometry": "0/d", **{q: {"value": v, "stddev": 0.004} for q, v in read.items()}}]
    (hostile / "capture.json").write_text(json.dumps(content))
    result = folder / "result"
    fixed = []  # few are free, to be quick
    for layer in truth["layers"]:
        fixed += ["--fix", f"{layer['name']}.reduced_scattering_per_mm=" + ",".join(map(str, layer["reduced_scattering_per_mm"]))]
    run("fit", hostile, "-o", result, "--model", "shader", "--max-pixels", 400, "--profiles", 1, *fixed)
    page, report = result / "report.html", json.loads((result / "report.json").read_text())
    assert page.stat().st_size < 5e6, page.stat().st_size
    names = [p["name"] for p in report["photographs"]]
    material = json.loads((result / "material.json").read_text())
    assert names == list(material["image_error"]["photographs"])
    for reading in material["measurements"]:
        assert all(abs(p / v - 1) < 0.1 for p, v in zip(reading["predicted"], read[reading["quantity"]], strict=True)), reading
    assert len(material["measurements"]) == 2, material["measurements"]
    assert [e["name"] for e in report["entries"]] == [f"{layer}.absorption_per_mm[{c}]" for layer in ("enamel", "dentine") for c in "RGB"] + ["surface.roughness"]
    for profile in report["profiles"]:  # by fits; smallest where the fit ended, larger to either side
        assert profile["by"] == "fits" and profile["delta_chi2"][1] < 0.1 and min(profile["delta_chi2"][0], profile["delta_chi2"][2]) > 1, profile
    assert report["profiles"], "nothing is weak"

    # The material as a flat piece: what predict says of the same file.
    prediction = json.loads((result / "prediction.json").read_text())
    said = json.loads(run("predict", result / "material.json", "--json", "--draws", 100).stdout)
    assert prediction["groups"] == said["groups"] and [g["name"] for g in said["groups"]] == ["design"] + [f"at_{mm}_mm" for mm in ("0.50", "1.00", "1.50", "2.00")]

    with Page(page) as shown:
        assert shown.value("document.title").startswith("<img src=x"), shown.value("document.title")
        assert shown.value("document.querySelector('#verdict h2').textContent").endswith(report["headline"])
        assert shown.value("document.querySelectorAll('.photograph').length") == len(names)
        assert shown.value("[...document.images].every(i => i.complete && i.naturalWidth > 0)"), "a picture is broken"
        assert shown.value("document.querySelectorAll('#measurements tbody tr').length") == 6, "readings beside photographs are not shown"
        # Thirds: three rows a photograph.
        assert shown.value("document.querySelectorAll('.photograph tbody tr').length") == 3 * len(names)
        assert shown.value("document.querySelectorAll('.correlation tbody tr').length") == len(material["joint"]["names"]) == len(report["entries"])
        # Every chart has ink: parameters, profiles, convergence.
        inks = shown.value("""[...document.querySelectorAll('canvas')].map(c => {
            const data = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
            let ink = 0;
            for (let i = 3; i < data.length; i += 4) ink += data[i] > 0;
            return ink / (c.width * c.height); })""")
        assert len(inks) == 2 + len(report["profiles"]) and min(inks) > 0.005, inks

        # A row for every thickness, with its translucency and interval.
        rows = shown.value("[...document.querySelectorAll('#elsewhere > .wide tbody tr')].map(row => row.innerText)")
        for group, text in zip(prediction["groups"], rows, strict=True):
            tp00 = group["figures"]["tp00"]
            for v in (tp00["value"], *tp00["interval95"]):
                assert f"{float(f'{v:.3g}'):g}" in text, (group["name"], v, text)
        assert shown.value("document.querySelectorAll('#elsewhere details tbody tr').length") == 4 * len(rows)

        # The wipe shows the photograph on the left of the slider and the prediction on its right.
        edge = "getComputedStyle(document.querySelector('.first')).clipPath"
        middle = shown.value(edge)
        shown.value("document.querySelector('.wipe input').focus()")
        for _ in range(10):
            shown.press("ArrowRight", 39)
        assert shown.value("document.querySelector('.wipe input').value") == "60"
        assert shown.value(edge) != middle, "the picture does not follow the keyboard"
        shown.press("Home", 36)
        assert "100%" in shown.value(edge) and shown.value("document.activeElement.getAttribute('aria-valuetext')").startswith("0 %")
        shown.value("document.querySelector('.wipe').scrollIntoView({block: 'center'})")
        x, y, width, height = shown.value("(b => [b.x, b.y, b.width, b.height])(document.querySelector('.stack').getBoundingClientRect())")
        shown.drag((x + 0.1 * width, y + height / 2), (x + 0.75 * width, y + height / 2))
        assert abs(int(shown.value("document.querySelector('.wipe input').value")) - 75) <= 1
        # Tab reaches every slider.
        shown.value("document.querySelector('.wipe input').focus()")
        shown.press("Tab", 9)
        assert shown.value("document.activeElement === document.querySelectorAll('.wipe input')[1]"), "Tab passes by the second slider"

        # Dark: other colours, of text and of charts, as readable as WCAG 2.1 asks (4.5 to 1).
        contrast = """(() => {
            const light = text => { const [r, g, b] = text.match(/[\\d.]+/g).map(v => v / 255)
                .map(v => v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
              return 0.2126 * r + 0.7152 * g + 0.0722 * b; };
            const paper = light(getComputedStyle(document.body).backgroundColor);
            return [...document.querySelectorAll('h1, #verdict h2, td, .soft, figcaption')].filter(e => !e.style.background).map(e => {
              const ink = light(getComputedStyle(e).color), [a, b] = ink > paper ? [ink, paper] : [paper, ink];
              return (a + 0.05) / (b + 0.05); }); })()"""
        papers = []
        for dark in (False, True):
            shown.colours(dark)
            papers.append(shown.value("getComputedStyle(document.body).backgroundColor + Chart.defaults.color"))
            assert min(shown.value(contrast)) >= 4.5, (dark, min(shown.value(contrast)))
        assert papers[0] != papers[1], papers

        # Print: both pictures whole, side by side, no slider.
        shown.call("Emulation.setEmulatedMedia", media="print")
        assert shown.value(edge) == "none"
        assert shown.value("getComputedStyle(document.querySelector('.wipe input')).display") == "none"
        boxes = shown.value("[...document.querySelectorAll('.stack img')].slice(0, 2).map(i => [i.getBoundingClientRect().x, i.getBoundingClientRect().y])")
        assert boxes[1][0] < boxes[0][0] and boxes[0][1] == boxes[1][1], boxes
        shown.call("Emulation.setEmulatedMedia", media="")
        shown.pdf(folder / "page.pdf")
        printed = (folder / "page.pdf").read_bytes()
        assert printed.startswith(b"%PDF") and printed.count(b"/Type /Page\n") + printed.count(b"/Type /Page ") >= 2, "nothing is printed"
        assert not shown.said, shown.said

    with Page(page, width=380) as narrow:
        assert narrow.value("document.documentElement.scrollWidth") <= 380, "a narrow window has to be scrolled sideways"

    # The same page again, byte for byte, also elsewhere.
    first = page.read_bytes()
    moved = folder / "moved"
    shutil.move(result, moved)
    (moved / "report.html").unlink()
    assert run("report", moved).stdout.strip() == str(moved / "report.html")
    assert (moved / "report.html").read_bytes() == first

    # Laid up anew: over a stump, with the laboratory's tabs, two of which are nearly one.
    design = prediction["groups"][0]["figures"]
    lab = [design[f"over_black.{c}"]["value"] for c in "Lab"]
    (folder / "tabs.csv").write_text("name,L,a,b\n" + "".join(f"{name},{lab[0] + off},{lab[1]},{lab[2]}\n" for name, off in
                                                              (("near", 0.1), ("beside", 0.3), ("far", 8), ("farther", 16))))
    run("shades", "measured", folder / "tabs.csv", "-o", folder / "tabs.json")
    run("report", moved, "--stump", "black", "--cement", "air", "--tabs", folder / "tabs.json")
    with Page(moved / "report.html") as shown:
        nearest = shown.value("document.querySelector('#elsewhere').innerText")
        assert all(name in nearest for name in ("near", "beside", "far")) and "farther" not in nearest, nearest
        assert "near and beside are too close to tell" in nearest and not shown.said, (nearest, shown.said)
    said = run("report", moved, "--stump", "40,3", expect=2).stderr
    assert "--stump" in said, said

    # What is missing or damaged is named.
    picture = moved / report["photographs"][0]["pictures"]["photograph"]
    kept = picture.read_bytes()
    picture.unlink()
    assert picture.name in run("report", moved, expect=2).stderr
    picture.write_bytes(kept)
    text = (moved / "report.json").read_text()
    for wrong, word in ((text[:len(text) // 2], "not valid JSON"), (text.replace("report/" + picture.name, "../" + picture.name), "outside"),
                        (text.replace('"headline"', '"headlines"'), "headlines")):
        (moved / "report.json").write_text(wrong)
        assert word in run("report", moved, expect=2).stderr, word
    (moved / "report.json").unlink()
    said = run("report", moved, expect=2).stderr
    assert "report.json" in said and "crownfit fit" in said, said
    assert "material.json" in run("report", folder / "nowhere", expect=2).stderr
