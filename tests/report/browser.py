"""Chromium without a window, driven over its DevTools pipe.

To look at a page: ``python tests/figures/browser.py results/report.html pictures/``.
"""

import base64
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

PROGRAM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
_FLAGS = ["--headless=new", "--remote-debugging-pipe", "--no-first-run", "--use-angle=swiftshader"]
_FLAGS += ["--enable-unsafe-swiftshader", "--disable-dev-shm-usage", "--hide-scrollbars", "--force-color-profile=srgb"]
_PATIENCE_S = 60.0


class Browser:
    """One page; a context manager. ``complaints`` holds all errors and warnings it wrote, ``asked`` all it fetched."""

    def __init__(self, width: int = 1280, height: int = 900):
        self._size, self._count = (width, height), 0
        self.complaints, self.asked = [], []

    def __enter__(self) -> "Browser":
        self._home = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        (inside, self._to), (self._from, outside) = os.pipe(), os.pipe()
        flags = [*_FLAGS, *(["--no-sandbox"] if os.geteuid() == 0 else [])]
        # the browser reads its orders from file 3 and answers in file 4
        command = ["sh", "-c", f'exec "$@" 3</proc/self/fd/{inside} 4>/proc/self/fd/{outside}', "sh", PROGRAM, *flags]
        width, height = self._size
        command += [f"--user-data-dir={self._home.name}", f"--window-size={width},{height}", "about:blank"]
        quiet = subprocess.DEVNULL
        self._process = subprocess.Popen(command, pass_fds=(inside, outside), stdout=quiet, stderr=quiet)
        os.close(inside)
        os.close(outside)
        self._heard = b""
        self._session = None
        targets = self.call("Target.getTargets")["targetInfos"]
        page = next(target["targetId"] for target in targets if target["type"] == "page")
        self._session = self.call("Target.attachToTarget", targetId=page, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")
        return self

    def __exit__(self, *_) -> None:
        self._process.terminate()
        self._process.wait()
        os.close(self._to)
        os.close(self._from)
        self._home.cleanup()

    def call(self, method: str, **params) -> dict:
        """Give an order and wait for its answer; raises RuntimeError if it is refused."""
        self._count += 1
        order = {"id": self._count, "method": method, "params": params}
        if self._session:
            order["sessionId"] = self._session
        os.write(self._to, json.dumps(order).encode() + b"\0")
        end = time.monotonic() + _PATIENCE_S
        while time.monotonic() < end:
            told = self._next()
            if told.get("id") == self._count:
                if "error" in told:
                    raise RuntimeError(f"{method}: {told['error']['message']}")
                return told["result"]
        raise RuntimeError(f"{method}: no answer")

    def _next(self) -> dict:
        """The next message; what the page complains of, or asks of the network, is kept."""
        while b"\0" not in self._heard:
            piece = os.read(self._from, 1 << 20)
            if not piece:
                raise RuntimeError("the browser has gone")
            self._heard += piece
        line, self._heard = self._heard.split(b"\0", 1)
        told = json.loads(line)
        method, params = told.get("method"), told.get("params", {})
        if method == "Runtime.exceptionThrown":
            self.complaints.append(str(params["exceptionDetails"]))
        elif method == "Runtime.consoleAPICalled" and params["type"] in ("error", "warning", "assert"):
            self.complaints.append(str(params["args"]))
        elif method == "Log.entryAdded" and params["entry"]["level"] in ("error", "warning"):
            self.complaints.append(params["entry"]["text"])
        elif method == "Network.requestWillBeSent":
            self.asked.append(params["request"]["url"][:80])
        return told

    def open(self, page: Path) -> None:
        """Load a file and wait until it is there."""
        self.call("Page.navigate", url=page.resolve().as_uri())
        self.wait("document.readyState === 'complete'")

    def ask(self, expression: str):
        """The value of a JavaScript expression; promises are awaited."""
        told = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in told:
            raise RuntimeError(f"{expression}: {told['exceptionDetails']}")
        return told["result"].get("value")

    def wait(self, condition: str) -> None:
        """Until a JavaScript expression is true; RuntimeError if that takes too long."""
        end = time.monotonic() + _PATIENCE_S
        while not self.ask(condition):
            if time.monotonic() > end:
                raise RuntimeError(f"never true: {condition}")
            time.sleep(0.05)

    def press(self, key: str) -> None:
        """A key goes down and up where the focus is."""
        text = {"Enter": "\r", " ": " "}.get(key, key if len(key) == 1 else "")
        self.call("Input.dispatchKeyEvent", type="keyDown", key=key, code=key, text=text)
        self.call("Input.dispatchKeyEvent", type="keyUp", key=key, code=key)

    def drag(self, selector: str, right: int, down: int) -> None:
        """The mouse takes the middle of an element and pulls it [pixel]."""
        x, y = self.ask(
            f"(() => {{const b = document.querySelector({json.dumps(selector)}).getBoundingClientRect();"
            "return [b.x + b.width / 2, b.y + b.height / 2]})()"
        )
        mouse = {"button": "left", "buttons": 1, "clickCount": 1}
        self.call("Input.dispatchMouseEvent", type="mousePressed", x=x, y=y, **mouse)
        self.call("Input.dispatchMouseEvent", type="mouseMoved", x=x + right, y=y + down, **mouse)
        self.call("Input.dispatchMouseEvent", type="mouseReleased", x=x + right, y=y + down, **mouse)

    def picture(self, path: Path) -> None:
        """Write what can be seen as PNG."""
        told = self.call("Page.captureScreenshot", format="png")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(base64.b64decode(told["data"]))


def look(page: Path, folder: Path) -> list[str]:
    """Screenshots of the top of the page (also dark, and on a telephone), of each part and of each view that turns.

    Returns what the page complained of.
    """
    with Browser() as browser:
        browser.open(page)
        browser.picture(folder / "top.png")
        browser.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "dark"}])
        browser.picture(folder / "dark.png")
        browser.call("Emulation.setEmulatedMedia", features=[])
        browser.call("Emulation.setDeviceMetricsOverride", width=390, height=844, deviceScaleFactor=2, mobile=True)
        browser.picture(folder / "telephone.png")
        browser.call("Emulation.clearDeviceMetricsOverride")
        places = browser.ask("[...document.querySelectorAll('main > section, .turn')].map(e => e.id)")
        for place in places:
            browser.ask(f"document.getElementById({json.dumps(place)}).scrollIntoView({{behavior: 'instant'}})")
            time.sleep(0.6)
            browser.picture(folder / f"{place}.png")
        return browser.complaints


if __name__ == "__main__":
    print(*look(Path(sys.argv[1]), Path(sys.argv[2])), sep="\n")
