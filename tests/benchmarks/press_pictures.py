"""Count the pictures a second of a page on which a body is pressed, and time what a picture is made of.

    python tests/benchmarks/press_pictures.py PAGE [SECONDS]

PAGE is a report, a page of its own, or a portable model, of which a page is made. In Chromium without a graphics card a
pointer drags deeper and out again, slides and turns, SECONDS (default 5) each. Prints a row a way:
pictures a second, then median times [ms] of the main thread, in a second drag: of an answer, of bending and shading the
surface, and of drawing it, until it is drawn. What pictures take beyond their sum is the browser's.
"""

import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "report"))
import browser as chromium

from palpate.press.page.page import PressModel, press_document

STAGE = "document.querySelector('figure.press').stage"
WAYS = ("press", "slide", "turn")
DRAG = """async ([way, seconds, apart]) => {
  const stage = document.querySelector('figure.press').stage, { canvas } = stage.panel, view = stage.main;
  const times = { answer: [], bend: [], draw: [] }, kept = { draw: stage.draw, bend: stage.bend, ask: view.ask };
  const send = (kind, x, y) => canvas.dispatchEvent(new PointerEvent(kind, { clientX: x, clientY: y, pointerId: 7 }));
  const box = canvas.getBoundingClientRect(), x = box.left + 0.55 * box.width, y = box.top + 0.42 * box.height;
  if (apart) {
    let bending = 0;
    view.ask = async function (presses) {
      await kept.ask.call(this, presses);
      if (this.answer.ms >= 0) times.answer.push(this.answer.ms);
    };
    stage.bend = function (...given) {
      const began = performance.now(), found = kept.bend.apply(this, given);
      bending = performance.now() - began;
      times.bend.push(bending);
      return found;
    };
    stage.draw = function () {
      const began = performance.now(), { gl } = this.painter;
      kept.draw.call(this);
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
      times.draw.push(performance.now() - began - bending);
    };
  }
  stage.choose(way);
  send('pointerdown', x, y);
  await new Promise((done) => setTimeout(done, 700));
  send('pointermove', x + 5, y + 5); // farther than a finger that trembles
  const began = performance.now(), before = stage.pictures;
  await new Promise((done) => {
    const move = () => { // once a picture, as browsers do
      const gone = (performance.now() - began) / 1e3, swing = 1 - Math.cos(2 * Math.PI * 0.5 * gone);
      send('pointermove', x + (way === 'press' ? 0 : 60 * swing), y + (way === 'press' ? 30 : 15) * swing);
      if (gone < seconds) requestAnimationFrame(move);
      else done();
    };
    move();
  });
  const rate = (1e3 * (stage.pictures - before)) / (performance.now() - began);
  const size = [canvas.width, canvas.height];
  send('pointerup', x, y);
  stage.release();
  await new Promise((done) => setTimeout(done, 700));
  Object.assign(stage, { draw: kept.draw, bend: kept.bend });
  view.ask = kept.ask;
  const median = (list) => list.sort((a, b) => a - b)[list.length >> 1] ?? NaN;
  return [rate, median(times.answer), median(times.bend), median(times.draw), ...size];
}"""


def main(page: Path, seconds: float) -> None:
    """Print a row for each way of dragging."""
    with tempfile.TemporaryDirectory() as folder, chromium.started() as browser:
        if page.suffix == ".palpate":
            document = press_document([PressModel("contact_modes", "contact modes", page.read_bytes())])
            page = Path(folder) / "press.html"
            page.write_text(document, encoding="utf-8")
        with chromium.visit(browser, page) as visited:
            chromium.until(visited.page, f"{STAGE}?.main && {STAGE}.panel.canvas.width > 310")
            visited.page.evaluate("document.querySelector('.press-stage').scrollIntoView({behavior: 'instant'})")
            print("way,pictures_per_s,answer_ms,bend_ms,draw_ms,width,height")
            for way in WAYS:
                rate, *_ = visited.page.evaluate(DRAG, [way, seconds, False])
                _, answer, bend, draw, *size = visited.page.evaluate(DRAG, [way, seconds, True])
                print(f"{way},{rate:.1f},{answer:.2f},{bend:.2f},{draw:.2f},{size[0]},{size[1]}", flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), float(sys.argv[2]) if sys.argv[2:] else 5.0)
