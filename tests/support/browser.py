"""A page in a headless browser, driven through Chromium's DevTools protocol over a pipe. Exit code 77 when there is none."""
import base64
import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path


class Page:
    """Opens a file; `said` collects what the page writes to the console, throws, or asks the network for."""

    def __init__(self, file, width=1100, height=900, dark=False):
        names = ("chromium-headless-shell", "chromium")
        program = next((found for found in map(shutil.which, names) if found), None)
        if not program:
            print(f"NOT RUN: no browser; install {names[0]}")
            sys.exit(77)
        self.profile = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        to_read, self.to_write = os.pipe()
        self.to_hear, to_say = os.pipe()
        # A container has no sandbox for its root; the page is our own file.
        words = [program, "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--remote-debugging-pipe",
                 f"--user-data-dir={self.profile.name}", "about:blank"]
        self.process = subprocess.Popen(["sh", "-c", f'exec "$@" 3<&{to_read} 4>&{to_say}', "sh", *words],
                                        pass_fds=(to_read, to_say), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(to_read)
        os.close(to_say)
        self.heard, self.count, self.said, self.session = b"", 0, [], None
        target = next(t for t in self.call("Target.getTargets")["targetInfos"] if t["type"] == "page")
        self.session = self.call("Target.attachToTarget", targetId=target["targetId"], flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(domain + ".enable")
        self.size(width, height)
        self.colours(dark)
        self.loaded = False
        self.call("Page.navigate", url=Path(file).resolve().as_uri())
        while not self.loaded:
            self.take()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        # Its helpers end after it and still write to their folder for a moment.
        os.write(self.to_write, json.dumps({"id": 0, "method": "Browser.close"}).encode() + b"\0")
        self.process.wait(timeout=30)
        os.close(self.to_write)
        os.close(self.to_hear)
        self.profile.cleanup()

    def take(self):
        """The next message; events are looked at on the way."""
        while b"\0" not in self.heard:
            more = os.read(self.to_hear, 1 << 20)
            if not more:
                raise RuntimeError("the browser ended")
            self.heard += more
        text, self.heard = self.heard.split(b"\0", 1)
        message = json.loads(text)
        method, parameters = message.get("method"), message.get("params", {})
        if method == "Page.loadEventFired":
            self.loaded = True
        if method == "Runtime.exceptionThrown":
            self.said.append(parameters["exceptionDetails"]["exception"].get("description", "exception"))
        if method == "Runtime.consoleAPICalled":
            self.said.append(str([a.get("value") for a in parameters["args"]]))
        if method == "Log.entryAdded":
            self.said.append(parameters["entry"]["text"])
        if method == "Network.requestWillBeSent" and not parameters["request"]["url"].startswith(("file:", "data:")):
            self.said.append("asks the network for " + parameters["request"]["url"])
        return message

    def call(self, method, **parameters):
        self.count += 1
        message = {"id": self.count, "method": method, "params": parameters}
        if self.session:
            message["sessionId"] = self.session
        os.write(self.to_write, json.dumps(message).encode() + b"\0")
        while True:
            answer = self.take()
            if answer.get("id") == self.count:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']}")
                return answer["result"]

    def size(self, width, height):
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)

    def colours(self, dark):
        self.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}])

    def value(self, script):
        """What a JavaScript expression gives."""
        answer = self.call("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in answer:
            raise RuntimeError(f"{script}: {answer['exceptionDetails']}")
        return answer["result"].get("value")

    def press(self, key, code):
        for kind in ("rawKeyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=key, code=key, windowsVirtualKeyCode=code)

    def drag(self, start, end):
        for kind, (x, y), buttons in (("mousePressed", start, 1), ("mouseMoved", end, 1), ("mouseReleased", end, 0)):
            self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=buttons, clickCount=1)

    def picture(self, file, clip=None):
        """PNG of the whole page, or of a box (x, y, width, height) of it."""
        if clip is None:
            clip = [0, 0, *self.value("[document.documentElement.scrollWidth, document.documentElement.scrollHeight]")]
        box = dict(zip(("x", "y", "width", "height"), clip), scale=1)
        shot = self.call("Page.captureScreenshot", format="png", clip=box, captureBeyondViewport=True)
        Path(file).write_bytes(base64.b64decode(shot["data"]))

    def pdf(self, file):
        Path(file).write_bytes(base64.b64decode(self.call("Page.printToPDF", printBackground=True, paperWidth=8.27, paperHeight=11.69)["data"]))
