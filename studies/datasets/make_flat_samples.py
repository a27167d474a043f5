#!/usr/bin/env python3
"""make_flat_samples.py CROWNFIT FOLDER: a capture of measurements with a known answer: total reflectance and transmittance of
ceramic discs of three thicknesses by `crownfit slab`, with noise of 0.003 drawn; one more disc held out; truth.json."""
import json
import random
import subprocess
import sys
from pathlib import Path

program, folder = sys.argv[1], Path(sys.argv[2])
STDDEV, IOR, G = 0.003, 1.54, 0.8
SCATTERING, ABSORPTION = [2.0, 2.3, 2.9], [0.02, 0.04, 0.12]  # reduced, 1/mm; R, G, B
draw = random.Random(7)
folder.mkdir(parents=True, exist_ok=True)


def totals(mm, c):
    slab = folder / "slab.json"
    slab.write_text(json.dumps({"format": "crownfit-slab/1", "layers": [{"ior": IOR, "g": G, "scattering_per_mm": SCATTERING[c] / (1 - G),
                                                                         "absorption_per_mm": ABSORPTION[c], "thickness_mm": mm}]}))
    answer = json.loads(subprocess.run([program, "slab", slab], capture_output=True, text=True, check=True).stdout)
    slab.unlink()
    return answer["specular"] + answer["reflectance_collimated"], answer["transmittance_collimated"]


def read(value):
    return round(value + STDDEV * draw.gauss(0, 1), 4)


measurements = []
for mm in (0.5, 1.0, 2.0, 1.5):
    rt = [totals(mm, c) for c in range(3)]
    measurements.append({"name": f"disc {mm} mm", "thickness_mm": mm, "thickness_stddev_mm": 0.005, "geometry": "0/d", "specular": "included",
                         "reflectance": {"value": [read(r) for r, t in rt], "stddev": STDDEV},
                         "transmittance": {"value": [read(t) for r, t in rt], "stddev": STDDEV}})
measurements[-1]["use"] = "holdout"
capture = {"format": "crownfit-capture/1",
           "object": {"layers": [{"name": "ceramic", "ior": {"fixed": IOR}, "g": {"fixed": G}, "reduced_scattering_per_mm": {"initial": 2, "shared": "none"},
                                  "absorption_per_mm": {"initial": 0.05, "shared": "none"}}]},
           "measurements": measurements}
truth = {"format": "crownfit-material/1",
         "layers": [{"name": "ceramic", "ior": IOR, "g": G, "reduced_scattering_per_mm": SCATTERING, "absorption_per_mm": ABSORPTION}]}
for name, content in (("capture.json", capture), ("truth.json", truth)):
    (folder / name).write_text(json.dumps(content, indent=2) + "\n")
