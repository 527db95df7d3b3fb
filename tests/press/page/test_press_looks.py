"""What the page on which a body is pressed draws, pixel by pixel, in a real browser."""

from dataclasses import replace
from itertools import pairwise

import browser as chromium
import numpy as np
import pytest
from press_stage import READY, STAGE, rest, spots

from palpate.press.page.page import held_nodes, press_document

pytestmark = pytest.mark.skipif(chromium.PROGRAM is None, reason=chromium.NEEDS)
PIXEL = f"""([x, y]) => {{
  const s = {STAGE}, {{ gl }} = s.painter, pixel = new Uint8Array(4), sharp = gl.canvas.width / gl.canvas.clientWidth;
  s.draw();
  gl.readPixels(x * sharp, gl.canvas.height - y * sharp, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
  return [...pixel.slice(0, 3)]; }}"""
"""The colour under a pixel of the canvas."""


ROW = f"""([x, y]) => {{
  const s = {STAGE}, {{ gl }} = s.painter, sharp = gl.canvas.width / gl.canvas.clientWidth, wide = 10 * sharp;
  const pixels = new Uint8Array(4 * wide);
  s.draw();
  gl.readPixels((x - 5) * sharp, gl.canvas.height - y * sharp, wide, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  return Array.from({{ length: wide }}, (_, i) => [...pixels.slice(4 * i, 4 * i + 3)]); }}"""
"""The colours of the ten pixels around one of the canvas, from left to right."""


def middles(page, triangles):
    """Pixels in the middle of those triangles that are seen from 5 pixels before to 5 behind, as the body is turned."""
    return page.evaluate(
        f"""numbers => {{
        const s = {STAGE}, {{ nodes, triangles }} = s.main.surface, ours = new Set(numbers);
        s.aim();
        s.cursorSeen = false;
        const {{ clientWidth: w, clientHeight: h }} = s.panel.canvas, Finger = s.cursor.constructor;
        const middle = (triangle) => new Finger(s.main.surface, {{ triangle, weights: [1 / 3, 1 / 3, 1 / 3] }}, 0).rest;
        const at = (x, y) => s.camera.pick(nodes, triangles, x, y, w, h)?.triangle;
        for (let turn = 0; turn < 8; turn++) {{
          s.camera.turn(turn && Math.PI / 4, 0);
          const seen = numbers.map((t) => [t, s.camera.project(middle(t), w, h)]);
          const whole = (x, y) => [x - 6, x + 6].every((side) => ours.has(at(side, y)));
          const found = seen.filter(([t, [x, y]]) => at(x, y) === t && whole(x, y));
          if (found.length > 2) return found.map(([, pixel]) => pixel);
        }}
        return []; }}""",
        [int(number) for number in triangles],
    )


def luminance(colours):
    """Return how bright colours (n, 3) of 0 to 255 look, 0 to 1, as in the guidelines for accessible pages."""
    parts = np.asarray(colours) / 255
    return np.where(parts > 0.04045, ((parts + 0.055) / 1.055) ** 2.4, parts / 12.92) @ [0.2126, 0.7152, 0.0722]


def contrast(some, other):
    bright, dark = max(some, other), min(some, other)
    return (bright + 0.05) / (dark + 0.05)


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_what_is_held_is_hatched_on_pages_of_both_kinds_and_nothing_else(browser, model, liver, tmp_path, scheme):
    file, held = tmp_path / "press.html", held_nodes(liver)
    file.write_text(press_document([model], held=held), encoding="utf-8")
    whole = held[np.searchsorted(liver.fine.surface, liver.fine.triangles)].all(axis=1)
    with chromium.visit(browser, file, reduced_motion="reduce", color_scheme=scheme) as visited:
        page = visited.page
        chromium.until(page, READY)
        rest(page)
        paper = float(luminance(page.evaluate(PIXEL, [3, 3])))
        assert paper < 0.05 if scheme == "dark" else paper > 0.8
        for hatched, numbers in ((True, np.flatnonzero(whole)), (False, np.flatnonzero(~whole))):
            seen = middles(page, numbers)
            assert len(seen) >= 3
            rows = [luminance(page.evaluate(ROW, at)) for at in seen[:40]]
            across = [contrast(row.max(), row.min()) for row in rows]
            assert min(across) > 3 if hatched else max(across) < 2
            if hatched:  # a line, or what is between lines, stands out from the page
                assert min(max(contrast(each, paper) for each in row) for row in rows) > 3
        key = page.locator(".legend .held")
        assert key.bounding_box()["width"] > 50 and key.text_content() == "held"
        assert "repeating-linear-gradient" in key.evaluate("key => getComputedStyle(key, '::before').backgroundImage")


DEVICES = {"wide": chromium.DESKTOP, "middle": {"viewport": {"width": 800, "height": 900}}, "phone": chromium.TELEPHONE}
LONG = "quadratic elements, L-BFGS (level=2, start=rest, iterations=4)"


@pytest.mark.parametrize("device", DEVICES)
def test_names_and_marks_are_read_on_screens_of_all_sizes(browser, model, tmp_path, device):
    file = tmp_path / "press.html"
    file.write_text(press_document([model, replace(model, name="long", title=LONG)]), encoding="utf-8")
    with chromium.visit(browser, file, DEVICES[device], reduced_motion="reduce") as visited:
        page = visited.page
        chromium.until(page, READY)
        assert page.locator(".chosen").first.text_content() == "coarse mesh"
        for name in ("model", "beside it"):
            box = page.get_by_role("combobox", name=name, exact=True)  # what a screen reader calls it
            box.select_option("long")
            chosen = page.locator(".choice", has=box).locator(".chosen")
            assert chosen.text_content() == LONG
            # nothing of it is cut off, and all of it lies on the screen
            cut = chosen.evaluate("e => [e.scrollWidth - e.clientWidth, e.scrollHeight - e.clientHeight]")
            assert max(cut) <= 0
            lies = chosen.bounding_box()
            assert lies["x"] >= 0 and lies["x"] + lies["width"] <= DEVICES[device]["viewport"]["width"]
        # of two views each has the model's name on one line, without settings
        names = page.locator(".names span")
        assert names.all_text_contents() == ["quadratic elements, L-BFGS"] * 2
        assert all(each.bounding_box()["height"] < 40 for each in names.all())

        scale, marks = page.locator(".errorscale").bounding_box(), page.locator(".errorscale span")
        assert marks.all_text_contents() == ["0.1 %", "1 %", "10 %"]
        boxes = [mark.bounding_box() for mark in marks.all()]
        middle = [(box["x"] + box["width"] / 2 - scale["x"]) / scale["width"] for box in boxes]
        np.testing.assert_allclose(middle, [0.25, 0.5, 0.75], atol=0.01)
        assert all(one["x"] + one["width"] < two["x"] - 8 for one, two in pairwise(boxes))
        assert boxes[0]["y"] + boxes[0]["height"] <= page.locator(".bound").bounding_box()["y"]


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_marks_of_the_error_bar_stand_out_and_are_said(browser, model, tmp_path, scheme):
    file = tmp_path / "press.html"
    file.write_text(press_document([model]), encoding="utf-8")
    with chromium.visit(browser, file, reduced_motion="reduce", color_scheme=scheme) as visited:
        page = visited.page
        chromium.until(page, READY)
        ink, paper = page.evaluate(
            """[[".errorscale span", "color"], [".press-stage", "backgroundColor"]].map(([name, part]) =>
            getComputedStyle(document.querySelector(name))[part].match(/[\\d.]+/g).map(Number).slice(0, 3))"""
        )
        assert contrast(float(luminance(ink)), float(luminance(paper))) > 4.5
        for error, share, said in (
            ("0.01", 0.5, "estimated 1 %"),
            ("0.1", 0.75, "estimated 10 %"),
            ("NaN", 0, "no estimate"),
        ):
            # at once, before the page tells its own numbers again
            heard, width = page.evaluate(
                f"""(() => {{ const {{ panel }} = {STAGE}; panel.bars({error});
                const wide = (part) => part.getBoundingClientRect().width;
                return [panel.scale.ariaLabel, wide(panel.bar) / wide(panel.bar.parentElement)]; }})()"""
            )
            assert width == pytest.approx(share, abs=0.01)
            assert heard == f"error bar with marks at 0.1 %, 1 %, 10 % of the peak: {said}"
        page.wait_for_timeout(200)
        assert page.get_by_role("img", name="error bar with marks").count() == 1


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
