#!/usr/bin/env python3
"""batch_test.py CROWNFIT: `crownfit batch` loses nothing and harms nothing. Fits are pretended (pretend_fit.sh), so that
crashes, hangs and floods can be had for the asking; kill_resume_test.py runs true ones."""
import csv
import hashlib
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

program, here = sys.argv[1], Path(__file__).resolve().parent
fresh = {"format": "crownfit-material/1", "status": "usable", "reasons": [], "channels": [{"name": "R"}],
         "image_error": {"fit": {"de00_median": 0.5, "de00_p95": 1.0}}, "surface": {}}


class Lab:
    """A folder with captures, a manifest and a result to hand out."""

    def __init__(self, folder, names):
        self.folder, self.out = folder, folder / "out"
        self.names = names
        for name in names:
            (folder / name).mkdir()
            (folder / name / "capture.json").write_text("{}")
        self.hand_out("usable", 0.02)
        self.write([(n, n) for n in names])

    def hand_out(self, status, absorption):
        result = self.folder / "result"
        (result / "figures").mkdir(parents=True, exist_ok=True)
        (result / "figures/front.png").write_bytes(b"picture")
        layer = {"name": "dentine", "absorption_per_mm": {"value": [absorption], "stddev": [0.001], "interval95": [[absorption - 0.002, absorption + 0.002]], "status": "fitted"}}
        digest = hashlib.sha256((self.folder / self.names[0] / "capture.json").read_bytes()).hexdigest()
        (result / "material.json").write_text(json.dumps({**fresh, "status": status, "layers": [layer], "provenance": {"inputs_sha256": {"capture.json": digest}}}))

    def write(self, rows, header="id,capture"):
        self.manifest = self.folder / "manifest.csv"
        self.manifest.write_text("\n".join([header] + [",".join(r) for r in rows]) + "\n")

    def command(self, *more, out=None):
        return [program, "batch", str(self.manifest), "-o", str(out or self.out), "--program", str(here / "pretend_fit.sh"), *map(str, more)]

    def run(self, *more, expect=0, out=None):
        done = subprocess.run(self.command(*more, out=out), capture_output=True, text=True, timeout=120, env={**os.environ, "PRETEND_RESULT": str(self.folder / "result")})
        assert done.returncode == expect, (more, done.returncode, done.stdout, done.stderr)
        return done

    def start(self, *more):
        return subprocess.Popen(self.command(*more), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env={**os.environ, "PRETEND_RESULT": str(self.folder / "result")})

    def summary(self):
        with open(self.out / "summary.csv") as file:
            return {row["id"]: row for row in csv.DictReader(file)}


def files(root):
    return {str(p.relative_to(root)) for p in root.rglob("*") if p.is_file()}


def children_named(text):
    return [p for p in Path("/proc").iterdir() if p.name.isdigit() and text in command_line(p)]


def command_line(process):
    try:
        return (process / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
    except OSError:
        return ""


def a_second_run_fits_nothing_and_a_changed_capture_is_fitted_again(folder):
    lab = Lab(folder, ["a", "b", "c"])
    assert "3 fitted now" in lab.run().stdout
    contents = lambda: {f: (lab.out / f).read_bytes() for f in files(lab.out) - {"batch.lock"}}  # which names the process
    before = contents()
    assert "0 fitted now" in lab.run().stdout
    assert before == contents()
    (lab.out / "crowns/c/material.json").unlink()
    assert "1 fitted now" in lab.run().stdout and (lab.out / "crowns/c/material.json").exists()
    os.utime(folder / "a/capture.json")  # the same content
    assert "0 fitted now" in lab.run().stdout
    (folder / "b/capture.json").write_text("{ }")
    assert "1 fitted now" in lab.run().stdout
    lab.write([("a", "a", "300"), ("b", "b", ""), ("c", "c", "")], "id,capture,max_pixels")
    assert " fitted now" in lab.run().stdout and "a" in lab.summary()


def a_crown_that_crashes_hangs_floods_or_is_wrong_harms_no_other(folder):
    lab = Lab(folder, ["a", "crash", "hang", "greedy", "wrong", "once", "z"])
    done = lab.run("--jobs", 3, "--time-limit", 1.5, "--memory-limit", 150, expect=1)
    summary = lab.summary()
    assert {i: r["status"] for i, r in summary.items()} == {"a": "usable", "crash": "failed", "hang": "failed", "greedy": "failed", "wrong": "failed", "once": "usable", "z": "usable"}
    for name, words in {"crash": "signal 11", "hang": "longer than 1.5 s", "greedy": "more than 150 MiB", "wrong": "photographs: there is none"}.items():
        assert words in summary[name]["reasons"], summary[name]
        assert words in json.loads((lab.out / f"failed/{name}.json").read_text())["reason"]
        assert words in done.stderr
    assert "there is none" in json.loads((lab.out / "failed/wrong.json").read_text())["stderr"]
    assert "failed: crash hang greedy wrong" in done.stdout, done.stdout
    assert not (lab.out / "work").exists()
    shutil.rmtree(folder / "wrong")
    (folder / "mended").mkdir()
    (folder / "mended/capture.json").write_text("{}")
    lab.write([("a", "a"), ("wrong", "mended")])
    lab.run()
    assert not (lab.out / "failed/wrong.json").exists()


def every_fault_of_a_manifest_is_named_before_anything_starts(folder):
    lab = Lab(folder, ["a", "b"])
    lab.write([("a", "a", "300", "1"), ("a", "b", "300", ""), ("b", "absent", "300", ""), ("../c", "b", "300", ""), ("d", "b", "12", ""), ("", "b", "", "")], "id,capture,max_pixels,no-priors")
    said = lab.run(expect=2).stderr
    for words in ("line 2: no-priors", "line 3: id: 'a' occurs twice; the first is line 2", "line 4: capture", "absent", "line 5: id", "line 6: --max-pixels", "line 7: id"):
        assert words in said, (words, said)
    assert not lab.out.exists()
    lab.write([("a", "sub\\a")])
    assert "Write / between folders" in lab.run(expect=2).stderr
    lab.write([("a", "a"), ("a", "b"), ("b", "b")])
    lab.run("--keep-going", expect=1)
    assert [r["status"] for r in lab.summary().values()] == ["faulty", "usable"]  # by id; the second `a` is the faulty one
    lab.write([("a", "a", "red")], "id,capture,colour")
    said = lab.run("--keep-going", expect=2).stderr
    assert said.count("colour") == 1 and "Known: id, capture, group, model" in said, said
    lab.manifest.write_bytes(b'\xef\xbb\xbfid;capture;fix\r\nx;a;"dentine.absorption_per_mm=0.05,0.06,0.07; enamel.g=0.9"\r\n\r\n')  # as a spreadsheet saves it
    lab.run()
    assert json.loads((lab.out / "crowns/x/crown.json").read_text())["arguments"] == ["--model", "shader", "--fix", "dentine.absorption_per_mm=0.05,0.06,0.07", "--fix", "enamel.g=0.9", "--profiles", "0"]
    (folder / "p.json").write_text("{}")  # beside the manifest, not in the working folder
    (folder / "m.json").write_text(json.dumps({"format": "crownfit-manifest/1", "crowns": [{"id": "x", "capture": "a", "fix": ["dentine.g=0.9", "enamel.g=0.9"], "max_pixels": 400, "no_priors": True, "prior": "p.json"}]}))
    lab.manifest = folder / "m.json"
    lab.run()
    arguments = json.loads((lab.out / "crowns/x/crown.json").read_text())["arguments"]
    assert sorted(arguments) == sorted(["--model", "shader", "--fix", "dentine.g=0.9", "--fix", "enamel.g=0.9", "--prior", str(folder / "p.json"), "--no-priors", "--profiles", "0", "--max-pixels", "400"]), arguments


def a_column_that_stands_twice_and_a_list_for_one_value_are_refused(folder):
    lab = Lab(folder, ["a", "b"])
    for header, row, named in (("id,capture,group,group", "x,a,G,H", "group"), ("id,capture,id", "x,a,y", "id"), ("id,capture,max_pixels,max-pixels", "x,a,100,200", "max-pixels"), ("id,capture,fix,fix", "x,a,enamel.g=0.9,enamel.ior=1.6", "fix")):
        lab.write([row.split(",")], header)
        for options in ((), ("--keep-going",)):
            said = lab.run(*options, expect=2).stderr
            assert f"manifest.csv: {named}: this column stands twice" in said, said
    lab.manifest = folder / "m.json"
    for key in ("group", "capture", "seed", "no_priors"):
        crown = {"id": "x", "capture": "a", key: [True, False] if key == "no_priors" else ["a", "b"]}
        lab.manifest.write_text(json.dumps({"format": "crownfit-manifest/1", "crowns": [crown]}))
        said = lab.run(expect=2).stderr
        assert f"crowns[0]: {key.replace('_', '-')}: expected one value, found 2" in said, said
    assert not lab.out.exists()


def flags_are_read_as_spreadsheets_write_them(folder):
    lab = Lab(folder, ["a", "b"])
    lab.write([("a", "a", "TRUE"), ("b", "b", "FALSE")], "id,capture,no_priors")
    lab.run()
    arguments = {i: json.loads((lab.out / f"crowns/{i}/crown.json").read_text())["arguments"] for i in "ab"}
    assert "--no-priors" in arguments["a"] and "--no-priors" not in arguments["b"], arguments


def a_capture_that_statistics_count_twice_is_named(folder):
    lab = Lab(folder, ["a", "b"])
    (folder / "linked").symlink_to("a")
    twice = "has the same capture as x, so that statistics.csv counts it twice"
    lab.write([("x", "a", "G"), ("y", "b", "G"), ("z", "linked", "G"), ("other", "a/capture.json", "H")], "id,capture,group")
    said = lab.run().stderr
    assert f"z: {twice}" in said and said.count("counts it twice") == 1, said
    lab.write([("x", "a", "G"), ("z", "a/capture.json", "G")], "id,capture,group")
    assert f"z: {twice}" in lab.run().stderr
    collected = subprocess.run([program, "batch", "collect", str(lab.out)], capture_output=True, text=True, check=True)
    assert f"z: {twice}" in collected.stderr, collected.stderr


def a_relative_prior_is_the_same_file_from_every_folder(folder):
    lab = Lab(folder, ["a"])
    (folder / "p.json").write_text("{}")
    environment = {**os.environ, "PRETEND_RESULT": str(folder / "result")}
    subprocess.run(lab.command("--prior", "p.json"), cwd=folder, env=environment, check=True, capture_output=True)
    (folder / "else").mkdir()
    said = subprocess.run([program, "batch", "status", str(lab.out)], cwd=folder / "else", capture_output=True, text=True, check=True).stdout
    assert "faulty" not in said, said
    assert str(folder / "p.json") in json.loads((lab.out / "crowns/a/crown.json").read_text())["arguments"]


def two_batches_never_work_in_one_folder(folder):
    lab = Lab(folder, ["slow", "a"])
    first = lab.start()
    while not (lab.out / "work/all/stderr/slow").exists():
        time.sleep(0.01)
    assert "another batch is running here" in lab.run(expect=2).stderr
    assert first.wait(timeout=30) == 0


def children_do_not_outlive_a_killed_parent_and_nothing_half_made_stays(folder):
    lab = Lab(folder, ["a", "hang"])
    for how in (signal.SIGKILL, signal.SIGTERM, signal.SIGINT):
        batch = lab.start()
        while not (lab.out / "crowns/a/material.json").exists() or not children_named("sleep 1000"):
            time.sleep(0.01)
        batch.send_signal(how)
        code = batch.wait(timeout=10)
        assert code == {signal.SIGKILL: -9, signal.SIGTERM: 75, signal.SIGINT: 3}[how], code
        time.sleep(0.2)
        assert not children_named("sleep 1000"), how
    lab.write([("a", "a")])
    assert "0 fitted now" in lab.run().stdout
    assert files(lab.out) == {"batch.json", "batch.lock", "summary.csv", "summary.html", "statistics.csv", "times.csv", "crowns/a/material.json", "crowns/a/figures/front.png", "crowns/a/crown.json"}


def a_full_disk_stops_the_batch_and_room_lets_it_go_on(folder):
    lab = Lab(folder, [f"c{i}" for i in range(6)])
    (folder / "result/figures/front.png").write_bytes(bytes(1 << 20))
    small = folder / "small"
    small.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=3m", "tmpfs", small], capture_output=True).returncode != 0:
        print("  NOT RUN here: a small file system can't be mounted")
        return
    try:
        lab.out = small / "out"
        said = lab.run("--jobs", 1, expect=2).stderr
        assert "the disk is full" in said and "Free some space" in said, said
        whole = list((lab.out / "crowns").iterdir())
        assert 1 <= len(whole) <= 2 and all((c / "crown.json").exists() for c in whole), whole
        subprocess.run(["mount", "-o", "remount,size=30m", small], check=True)
        assert f"{6 - len(whole)} fitted now" in lab.run().stdout
        subprocess.run(["mount", "-o", "remount,ro", small], check=True)
        assert "Choose" in lab.run(expect=2).stderr
    finally:
        subprocess.run(["umount", "-l", small], check=True)


def the_summary_flags_what_a_person_should_see(folder):
    lab = Lab(folder, [f"c{i}" for i in range(8)])
    for i in range(8):
        lab.write([(f"c{i}", f"c{i}", "A")], "id,capture,group")
        lab.hand_out("not_usable" if i == 6 else "usable", 0.05 if i == 7 else 0.02 + 0.0001 * i)
        lab.run(expect=1 if i == 6 else 0)
    lab.write([(f"c{i}", f"c{i}", "A") for i in range(8)], "id,capture,group")
    done = lab.run(expect=1)
    assert "0 fitted now" in done.stdout and "not_usable: c6" in done.stdout
    summary = lab.summary()
    assert summary["c6"]["flags"] == "not usable" and summary["c7"]["flags"] == "outlier: dentine.absorption_per_mm[R]", summary
    assert summary["c1"]["flags"] == "" and summary["c1"]["dentine.absorption_per_mm[R] low95"] == "0.0181"
    with open(lab.out / "statistics.csv") as file:
        row = next(csv.DictReader(file))
    values = [0.02 + 0.0001 * i for i in range(6)] + [0.05]
    mean = sum(values) / 7
    spread = (sum((v - mean) ** 2 for v in values) / 6) ** 0.5
    assert row["number"] == "7" and abs(float(row["mean"]) / mean - 1) < 1e-5 and abs(float(row["spread"]) / spread - 1) < 1e-5
    # Equal intervals: the widened error of the mean is the spread over the root of the number.
    assert abs(float(row["error_of_mean"]) / (spread / 7**0.5) - 1) < 1e-5, row
    page = (lab.out / "summary.html").read_text()
    assert page.count("<img") == 8 and "outlier: dentine.absorption_per_mm[R]" in page


for test in (
    a_second_run_fits_nothing_and_a_changed_capture_is_fitted_again,
    a_crown_that_crashes_hangs_floods_or_is_wrong_harms_no_other,
    every_fault_of_a_manifest_is_named_before_anything_starts,
    a_column_that_stands_twice_and_a_list_for_one_value_are_refused,
    flags_are_read_as_spreadsheets_write_them,
    a_capture_that_statistics_count_twice_is_named,
    a_relative_prior_is_the_same_file_from_every_folder,
    two_batches_never_work_in_one_folder,
    children_do_not_outlive_a_killed_parent_and_nothing_half_made_stays,
    a_full_disk_stops_the_batch_and_room_lets_it_go_on,
    the_summary_flags_what_a_person_should_see,
):
    with tempfile.TemporaryDirectory() as temporary:
        test(Path(temporary))
    print(test.__name__.replace("_", " "))
