#!/usr/bin/env python3
"""report_pictures.py RESULT FOLDER: docs/images' picture of a result's report.html: its verdict and first photograph."""
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests/support"))
from browser import Page  # noqa: E402

result, folder = Path(sys.argv[1]), Path(sys.argv[2])
with Page(result / "report.html", width=1000) as page:
    bottom = page.value("document.querySelector('.photograph').getBoundingClientRect().bottom + scrollY")
    page.picture(folder / "report.png", [0, 0, 1000, int(bottom) + 16])
