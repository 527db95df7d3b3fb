"""Film a press in a page: ``python tests/tools/film_press.py results/report.html docs/press.gif``.

A finger presses the body deeper and deeper, slides, tilts and lets go; the page is that of a report, or of its own.
"""

import io
import sys
from collections.abc import Iterator
from pathlib import Path

from PIL import Image

sys.path.insert(0, str(Path(__file__).parents[1] / "report"))
import browser as chromium

STAGE = "document.querySelector('figure.press').stage"
WIDTH, PAUSE_MS, COLOURS = 640, 90, 128


def steps(page) -> Iterator[None]:
    """Press, slide, tilt and let go, a little in each step."""
    box = page.locator(".press-stage canvas").bounding_box()
    x, y = box["x"] + 0.55 * box["width"], box["y"] + 0.42 * box["height"]
    page.mouse.move(x, y)
    page.mouse.down()
    for step in range(12):
        page.mouse.move(x, y + 2 * step)
        yield
    page.mouse.up()
    for mode, across, down, count in (("slide", 5, 3, 14), ("tilt", -6, 0, 8)):
        page.evaluate(f"{STAGE}.choose('{mode}')")
        x, y = page.evaluate(
            f"""(() => {{ const s = {STAGE}, c = s.panel.canvas, b = c.getBoundingClientRect();
            const [x, y] = s.camera.project(s.active.mix(s.main.places), c.clientWidth, c.clientHeight);
            return [b.left + x, b.top + y]; }})()"""
        )
        page.mouse.move(x, y)
        page.mouse.down()
        for step in range(1, count):
            page.mouse.move(x + across * step, y + down * step)
            yield
        page.mouse.up()
    page.evaluate(f"{STAGE}.choose('press')")
    page.evaluate(f"{STAGE}.release()")
    for _ in range(6):
        yield


def film(file: Path, out: Path) -> None:
    """Write the pictures of a press as an animation."""
    pictures = []
    device = {"viewport": {"width": 1120, "height": 760}}
    with chromium.started() as browser, chromium.visit(browser, file, device, reduced_motion="reduce") as visited:
        page = visited.page
        chromium.until(page, f"{STAGE}?.main && {STAGE}.panel.canvas.width > 310")
        page.evaluate("document.querySelector('.press-stage').scrollIntoView({behavior: 'instant'})")
        for _ in steps(page):
            chromium.until(page, f"!{STAGE}.stale && !{STAGE}.busy && {STAGE}.waiting === null")
            page.wait_for_timeout(420)  # until numbers are told, and edges are smooth
            data = page.locator(".press-stage").screenshot()
            picture = Image.open(io.BytesIO(data)).convert("RGB")
            pictures.append(picture.resize((WIDTH, round(picture.height * WIDTH / picture.width)), Image.LANCZOS))
    # colours of pictures from the whole film, side by side
    some = pictures[:: len(pictures) // 4]
    strip = Image.new("RGB", (WIDTH, sum(picture.height for picture in some)))
    for i, picture in enumerate(some):
        strip.paste(picture, (0, sum(before.height for before in some[:i])))
    palette = strip.quantize(COLOURS)
    first, *rest = [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    first.save(out, save_all=True, append_images=rest, duration=PAUSE_MS, loop=0, optimize=True)


if __name__ == "__main__":
    film(Path(sys.argv[1]), Path(sys.argv[2]))
