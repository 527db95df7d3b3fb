"""What the page on which a body is pressed draws, pixel by pixel, in a real browser."""

import browser as chromium
import numpy as np
import pytest
from press_stage import READY, STAGE, rest, spots

from palpate.report.press.compose import held_nodes
from palpate.report.press.page import press_document

pytestmark = pytest.mark.skipif(chromium.PROGRAM is None, reason=chromium.NEEDS)
PIXEL = f"""([x, y]) => {{
  const s = {STAGE}, {{ gl }} = s.painter, pixel = new Uint8Array(4), sharp = gl.canvas.width / gl.canvas.clientWidth;
  s.draw();
  gl.readPixels(x * sharp, gl.canvas.height - y * sharp, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
  return [...pixel.slice(0, 3)]; }}"""
"""The colour under a pixel of the canvas."""


def middles(page, triangles):
    """Pixels of the canvas in the middle of those triangles that can be seen, as it is turned until some can."""
    return page.evaluate(
        f"""numbers => {{
        const s = {STAGE}, {{ nodes, triangles }} = s.main.surface;
        s.aim();
        s.cursorSeen = false;
        const {{ clientWidth: w, clientHeight: h }} = s.panel.canvas, Finger = s.cursor.constructor;
        const middle = (triangle) => new Finger(s.main.surface, {{ triangle, weights: [1 / 3, 1 / 3, 1 / 3] }}, 0).rest;
        for (let turn = 0; turn < 8; turn++) {{
          s.camera.turn(turn && Math.PI / 4, 0);
          const seen = numbers.map((t) => [t, s.camera.project(middle(t), w, h)]);
          const found = seen.filter(([t, [x, y]]) => s.camera.pick(nodes, triangles, x, y, w, h)?.triangle === t);
          if (found.length) return found.map(([, at]) => at);
        }}
        return []; }}""",
        [int(number) for number in triangles],
    )


def test_what_is_held_is_dark_from_the_beginning_and_nothing_else(browser, model, liver, tmp_path):
    file, held = tmp_path / "press.html", held_nodes(liver)
    file.write_text(press_document([model], held=held), encoding="utf-8")
    whole = held[np.searchsorted(liver.fine.surface, liver.fine.triangles)].all(axis=1)
    with chromium.visit(browser, file, reduced_motion="reduce") as visited:
        chromium.until(visited.page, READY)
        rest(visited.page)
        for dark, numbers in ((True, np.flatnonzero(whole)), (False, np.flatnonzero(~whole))):
            seen = middles(visited.page, numbers)
            assert len(seen) >= 3
            brightest = [max(visited.page.evaluate(PIXEL, at)) for at in seen[:40]]
            assert max(brightest) < 0.33 * 255 if dark else min(brightest) > 0.33 * 255


def test_marks_are_drawn_over_the_surface(page):
    (x, y), *_ = spots(page, 1)
    page.mouse.click(x, y)
    rest(page)
    # where the ring crosses a line to the left of the finger, found by halving
    at = page.evaluate(
        f"""(() => {{ const s = {STAGE}, {{ canvas }} = s.panel, {{ clientWidth: w, clientHeight: h }} = canvas;
        const [x, y] = s.camera.project(s.active.mix(s.main.places), w, h), radius = s.main.model.info.radius_m;
        const {{ places, surface }} = s.main, Finger = s.active.constructor;
        const away = (i) => {{
          const place = s.camera.pick(places, surface.triangles, x - i, y, w, h);
          return place ? Math.hypot(...new Finger(surface, place, 0).rest.map((at, k) => at - s.active.rest[k])) : NaN;
        }};
        let [near, far] = [0, 200];
        for (let turn = 0; turn < 30; turn++) {{
          const i = (near + far) / 2;
          if (away(i) < radius) near = i; else far = i;
        }}
        return [x - near, y]; }})()"""
    )
    assert min(page.evaluate(PIXEL, at)) > 240  # the ring of the active finger is white
    beside = [at[0] + 12, at[1]]
    coloured = page.evaluate(PIXEL, beside)
    assert max(coloured) - min(coloured) > 10
    page.evaluate(f"{STAGE}.main.answer.doubt = 'made up'")
    grey = page.evaluate(PIXEL, beside)
    assert max(grey) - min(grey) <= 2
