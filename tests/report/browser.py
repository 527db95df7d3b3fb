"""An installed Chromium without a window, driven by playwright; no browser is ever downloaded."""

import os
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from playwright.sync_api import Browser, Page, sync_playwright

PROGRAM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
NEEDS = "Chromium is missing: apt-get install chromium"
"""Why a test that needs a browser is skipped where there is none."""
DESKTOP = {"viewport": {"width": 1280, "height": 900}}
TELEPHONE = {"viewport": {"width": 390, "height": 844}, "device_scale_factor": 2, "is_mobile": True, "has_touch": True}
_FLAGS = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"]  # WebGL without a graphics card


@contextmanager
def started() -> Iterator[Browser]:
    """Start the installed Chromium, and end it afterwards."""
    with sync_playwright() as playwright:
        # Chromium's sandbox refuses to run as root
        browser = playwright.chromium.launch(
            executable_path=PROGRAM, chromium_sandbox=os.geteuid() != 0, args=_FLAGS, timeout=60_000
        )
        try:
            yield browser
        finally:
            browser.close()


@dataclass
class Visit:
    """A page that has been opened, all errors and warnings it wrote, and the addresses of all it fetched."""

    page: Page
    complaints: list[str] = field(default_factory=list)
    asked: list[str] = field(default_factory=list)


@contextmanager
def visit(browser: Browser, place: Path | str, device: dict = DESKTOP, **options) -> Iterator[Visit]:
    """Load a file, or an address, as somebody does who has never seen it, and watch what it says and asks for."""
    with browser.new_context(**device, **options) as context:
        visited = Visit(context.new_page())
        page = visited.page

        def listen(message) -> None:
            if message.type in ("error", "warning", "assert"):
                visited.complaints.append(message.text)

        page.on("console", listen)
        page.on("pageerror", lambda error: visited.complaints.append(str(error)))
        page.on("request", lambda request: visited.asked.append(request.url))
        page.goto(place if isinstance(place, str) else place.resolve().as_uri())
        yield visited


def until(page: Page, condition: str, patience_s: float = 60.0) -> None:
    """Wait until a JavaScript expression is true; TimeoutError if that takes too long.

    Trap: playwright's ``wait_for_function`` calls ``eval`` in the page, which the report's own policy forbids.
    """
    end = time.monotonic() + patience_s
    while not page.evaluate(condition):
        if time.monotonic() > end:
            raise TimeoutError(f"never true: {condition}")
        page.wait_for_timeout(50)


def drag(page: Page, x: float, y: float, *ways: tuple[float, float]) -> None:
    """Press the mouse at a pixel, move it so far from there, one way after the other, and let go."""
    page.mouse.move(x, y)
    page.mouse.down()
    for right, down in ways:
        page.mouse.move(x + right, y + down)
    page.mouse.up()
