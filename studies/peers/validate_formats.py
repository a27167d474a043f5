#!/usr/bin/env python3
"""validate_formats.py CROWNFIT: exports of the peer captures by the formats' own validators: Khronos' glTF validator and
MaterialX's (against its OpenPBR library)."""
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from make_peer_captures import CAPTURES
from table import missing, row

PLACE = Path(__file__).resolve().parent.parent.parent / "build/peers/npm"
VALIDATE = """const v = require("gltf-validator"), fs = require("fs");
v.validateBytes(new Uint8Array(fs.readFileSync(process.argv[1]))).then(r => console.log(JSON.stringify(r.issues)));"""


def export(crownfit, capture, kind, folder):
    subprocess.run([crownfit, "export", str(capture / "truth.json"), "--to", kind, "--capture", str(capture), "-o", str(folder), "--paths", "2"],
                   check=True, capture_output=True)


def gltf(file):
    done = subprocess.run(["node", "-e", VALIDATE, str(file)], capture_output=True, text=True, cwd=PLACE, env=os.environ | {"NODE_PATH": str(PLACE / "node_modules")})
    return json.loads(done.stdout) if done.returncode == 0 else None


def materialx(file):
    import MaterialX as mx
    document, library = mx.createDocument(), mx.createDocument()
    mx.readFromXmlFile(document, str(file))
    mx.loadLibraries(["libraries"], mx.FileSearchPath(os.path.dirname(mx.__file__)), library)
    document.setDataLibrary(library)
    valid, said = document.validate()
    shaders = document.getNodes("open_pbr_surface")
    known = all(s.getNodeDef() and all(s.getNodeDef().getActiveInput(i.getName()) for i in s.getInputs()) for s in shaders)
    return valid and known and len(shaders) > 1, said


def main():
    with tempfile.TemporaryDirectory() as folder:
        for name, write in CAPTURES.items():
            capture = write(Path(folder) / name)
            export(sys.argv[1], capture, "gltf", capture / "gltf")
            issues = gltf(capture / "gltf/crown.glb")
            if issues is None:
                missing("glTF validator", "gltf-validator does not run; npm and node are needed")
            else:
                other = {m["message"] for m in issues["messages"] if m["code"] != "UNSUPPORTED_EXTENSION"}
                row("glTF validator", f"{name}: crown.glb", "export", f"{issues['numErrors']} errors, {issues['numWarnings']} warnings"
                    + (": " + "; ".join(other) if other else ""), issues["numErrors"] + issues["numWarnings"] == 0, "none")
            export(sys.argv[1], capture, "materialx", capture / "mtlx")
            valid, said = materialx(capture / "mtlx/material.mtlx")
            row("MaterialX", f"{name}: material.mtlx, every input known to open_pbr_surface", "export", "valid" if valid else said or "unknown input", valid)


if __name__ == "__main__":
    main()
