"""A real browser without a window, moved by its mouse and keys, for tests of pages."""

import base64
import json
import os
import shutil
import subprocess
import time

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)


class Browser:
    """Chromium, spoken to over two pipes; ``with Browser(folder) as browser``."""

    def __init__(self, folder):
        self.folder, self.count, self.messages, self.errors = folder, 0, b"", []

    def __enter__(self):
        import fcntl  # not on every system

        taken, self.asks = os.pipe()
        self.answers, given = os.pipe()
        command = [BROWSER, "--headless", "--no-sandbox", "--disable-gpu", "--force-prefers-reduced-motion"]
        command += [f"--user-data-dir={self.folder / 'profile'}", "--remote-debugging-pipe"]
        # The browser reads its pipe as file 3 and writes file 4.
        taken, given = (fcntl.fcntl(one, fcntl.F_DUPFD, 10) for one in (taken, given))
        self.process = subprocess.Popen(
            command,
            preexec_fn=lambda: (os.dup2(taken, 3), os.dup2(given, 4)),
            pass_fds=(3, 4),
            stderr=subprocess.DEVNULL,
        )
        os.close(taken)
        os.close(given)
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self.session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log"):
            self.call(f"{domain}.enable")
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait()
        os.close(self.asks)
        os.close(self.answers)

    def call(self, method, **given):
        """One command and its answer; errors of pages that come in between are kept."""
        self.count += 1
        asked = {"id": self.count, "method": method, "params": given}
        if hasattr(self, "session"):
            asked["sessionId"] = self.session
        os.write(self.asks, json.dumps(asked).encode() + b"\0")
        while True:
            while b"\0" not in self.messages:
                self.messages += os.read(self.answers, 1 << 16)
            text, _, self.messages = self.messages.partition(b"\0")
            told = json.loads(text)
            if told.get("id") == self.count:
                assert "error" not in told, told
                return told["result"]
            if told.get("method") in ("Runtime.exceptionThrown", "Log.entryAdded"):
                self.errors.append(told["params"])

    def open(self, address, width=1400, height=900):
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=False,
        )
        self.call("Page.navigate", url=address)
        self.until("document.readyState === 'complete'")

    def find(self, script):
        """The value of an expression in the page."""
        told = self.call("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in told, told
        return told["result"].get("value")

    def until(self, script, seconds=60.0):
        """Wait until an expression is true in the page."""
        end = time.monotonic() + seconds
        while not self.find(script):
            assert time.monotonic() < end, script
            time.sleep(0.02)

    def mouse(self, kind, x, y, **more):
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, **{"button": "left", **more})

    def drag(self, start, end, steps=8):
        self.mouse("mousePressed", *start, buttons=1, clickCount=1)
        for step in range(1, steps + 1):
            share = step / steps
            place = [one + share * (other - one) for one, other in zip(start, end, strict=True)]
            self.mouse("mouseMoved", *place, buttons=1)
        self.mouse("mouseReleased", *end, clickCount=1)

    def key(self, name):
        for kind in ("keyDown", "keyUp"):
            self.call(
                "Input.dispatchKeyEvent",
                type=kind,
                key=name,
                code=name,
                windowsVirtualKeyCode={"ArrowRight": 39, " ": 32}[name],
            )

    def picture(self, path):
        path.write_bytes(
            base64.b64decode(self.call("Page.captureScreenshot", captureBeyondViewport=True)["data"])
        )
