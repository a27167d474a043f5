"""A window on a virtual screen, and a hand with mouse and keys: Xvfb and xdotool."""
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path


def go_to_virtual_screen(width, height):
    """Runs the calling script again on one. Exits with 77 (not run) when a tool is absent."""
    for tool, package in (("Xvfb", "xvfb"), ("xvfb-run", "xvfb"), ("xauth", "xauth"), ("xdotool", "xdotool")):
        if not shutil.which(tool):
            print(f"NOT RUN: {tool} is absent (package {package})")
            sys.exit(77)
    if "CROWNFIT_ON_VIRTUAL_SCREEN" in os.environ:
        return
    os.environ["CROWNFIT_ON_VIRTUAL_SCREEN"] = "1"
    sys.exit(subprocess.run(["xvfb-run", "-a", "-s", f"-screen 0 {width}x{height}x24", sys.executable, *sys.argv]).returncode)


def hand(*arguments):
    subprocess.run(["xdotool", *map(str, arguments)], check=True, timeout=20)


class Viewer:
    """`crownfit view` with a window; `layout`: its widgets' rectangles by name."""

    def __init__(self, program, *arguments):
        self.process = subprocess.Popen([program, "view", *map(str, arguments), "--print-layout"], stdout=subprocess.PIPE, text=True, bufsize=1)
        self.layout = {}
        for line in self.process.stdout:
            name, *numbers = line.split()
            if name == "end":
                break
            self.layout[name] = [float(n) for n in numbers]
        assert self.layout, "the window printed no layout"

    def line(self):
        return self.process.stdout.readline().strip()

    def save_picture(self):
        """The files that it saves once everything has come to rest: as shown, and linear."""
        hand("key", "s")
        return Path(self.line()), Path(self.line())

    def middle(self, name):
        x, y, width, height = self.layout[name]
        return x + width / 2, y + height / 2

    def drag(self, begin, by, button=1):
        hand("mousemove", *begin)
        time.sleep(0.3)
        hand("mousedown", button)
        time.sleep(0.3)
        for step in range(1, 6):
            hand("mousemove", begin[0] + by[0] * step / 5, begin[1] + by[1] * step / 5)
            time.sleep(0.12)
        time.sleep(0.3)
        hand("mouseup", button)
        time.sleep(0.3)

    def close(self):
        """The exit code."""
        hand("key", "q")
        return self.process.wait(30)
