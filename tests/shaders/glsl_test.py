#!/usr/bin/env python3
"""shaders/terms.glsl is GLSL too: glslangValidator compiles it with the prefix of a viewer and a main that calls every
term. Exits 77 (not run) when glslangValidator is absent."""
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

if not shutil.which("glslangValidator"):
    print("NOT RUN: glslangValidator is absent (package glslang-tools)")
    sys.exit(77)
terms = (Path(__file__).resolve().parent.parent.parent / "shaders/terms.glsl").read_text()
functions = re.findall(r"^TERM Float (\w+)\(([^)]*)\)", terms, re.M)
assert len(functions) >= 15, functions
calls = "".join(f"  sum += {name}({', '.join('1' if a.split()[0] == 'int' else 'x' for a in arguments.split(','))});\n" for name, arguments in functions)
for version in ("330 core", "450 core"):
    source = (f"#version {version}\n#define Float float\n#define TERM\n#define OUT(T) out T\n#line 1\n{terms}\n"
              f"uniform float x;\nout vec4 colour;\nvoid main() {{\n  float sum = 0.0;\n{calls}  colour = vec4(sum);\n}}\n")
    with tempfile.NamedTemporaryFile("w", suffix=".frag") as file:
        file.write(source)
        file.flush()
        done = subprocess.run(["glslangValidator", file.name], capture_output=True, text=True)
    if done.returncode:
        print(f"FAIL GLSL {version}:\n{done.stdout}")
        sys.exit(1)
print(f"{len(functions)} terms accepted as GLSL 330 and 450")
