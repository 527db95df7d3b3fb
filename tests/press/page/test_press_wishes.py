"""How deep a finger presses: what it asked for, as far as a place is known to bear it, in a real browser."""

from dataclasses import replace

import browser as chromium
import numpy as np
import pytest
from press_stage import READY, STAGE, rest, spots

from palpate.press.page.page import held_nodes, press_document

pytestmark = pytest.mark.skipif(chromium.PROGRAM is None, reason=chromium.NEEDS)
PEAK_M = 0.02
"""Of the pages' models: the fixtures' INFO."""


@pytest.fixture
def twins(browser, model, tmp_path):
    """The page with the same model twice, the second one as "other"; it must not complain."""
    file = tmp_path / "press.html"
    file.write_text(press_document([model, replace(model, name="other", title="other")]), encoding="utf-8")
    with chromium.visit(browser, file, reduced_motion="reduce") as visited:
        chromium.until(visited.page, READY)
        yield visited.page
        assert visited.complaints == []


def bear(page, metres):
    """Let every place bear a press of so many metres."""
    page.evaluate(f"{STAGE}.main.depths = new Map(), {STAGE}.main.model.depth = () => {metres}")


def depth(page):
    rest(page)
    return page.evaluate(f"{STAGE}.active.depth")


def begin(page, metres):
    """Let the stage begin with a model whose places bear so many metres."""
    page.evaluate(f"{STAGE}.depth = null, {STAGE}.choices[0].model.depth = () => {metres}")
    page.evaluate(f"{STAGE}.take({STAGE}.choices[0])")


def slide_keys(page):
    page.focus("canvas")
    page.keyboard.press("2")
    page.keyboard.press("ArrowLeft")


def test_a_carried_wish_stops_at_what_is_known_and_only_the_reader_goes_beyond(page):
    (x, y), *_, (x2, y2) = spots(page, 9)
    bear(page, 0.010)
    page.mouse.click(x, y)
    page.evaluate(f"{STAGE}.deepen(1)")
    assert depth(page) == pytest.approx(1.2 * 0.010)
    bear(page, 0.004)
    page.mouse.click(x2, y2)  # a new place
    assert depth(page) == pytest.approx(0.004)
    slide_keys(page)
    assert depth(page) == pytest.approx(0.004)
    page.mouse.move(x2, y2)  # a slide by the pointer, too
    page.mouse.down()
    page.mouse.move(x2 - 20, y2)
    page.mouse.up()
    assert depth(page) == pytest.approx(0.004)
    page.keyboard.press("1")
    page.keyboard.press("ArrowDown")  # the reader asks for more
    assert depth(page) == pytest.approx(1.2 * 0.004)  # a key's step is 0.0008 m
    page.keyboard.press("ArrowDown")
    assert depth(page) == pytest.approx(1.2 * 0.004)
    bear(page, 0.020)
    slide_keys(page)
    assert depth(page) == pytest.approx(1.2 * 0.010)  # what was asked for at first
    page.keyboard.press("1")
    page.keyboard.press("ArrowUp")  # the reader asks for less
    bear(page, 0.020)
    page.mouse.click(x2, y2)
    assert depth(page) == pytest.approx(1.2 * 0.010 - 0.04 * PEAK_M)


def test_another_model_presses_as_deep_as_it_is_known_to_bear(twins):
    page = twins
    (x, y), *_, (x2, y2) = spots(page, 9)
    bear(page, 0.010)
    page.mouse.click(x, y)
    page.evaluate(f"{STAGE}.deepen(1)")
    page.get_by_role("button", name="Pin this finger").click()
    page.mouse.click(x2, y2)
    assert depth(page) == pytest.approx(0.010)
    page.evaluate(f"{STAGE}.choices[1].model.depth = () => 0.006")
    page.get_by_label("model").select_option("other")
    rest(page)
    np.testing.assert_allclose(page.evaluate(f"{STAGE}.fingers.map((finger) => finger.depth)"), [0.006, 0.006])
    page.get_by_label("model").select_option("coarse")  # which answers the same presses
    rest(page)
    np.testing.assert_allclose(page.evaluate(f"{STAGE}.fingers.map((finger) => finger.depth)"), [0.006, 0.006])
    slide_keys(page)
    assert depth(page) == pytest.approx(0.010)  # of the wish, in a place that bears so much


def test_what_one_model_knows_holds_for_one_that_does_not_say(twins):
    page = twins
    (x, y), *_, (x2, y2) = spots(page, 9)
    begin(page, 0.003)
    page.mouse.click(x, y)
    page.get_by_label("model").select_option("other")
    assert depth(page) == pytest.approx(0.003)
    page.mouse.click(x2, y2)
    assert depth(page) == pytest.approx(0.003)
    page.evaluate(f"{STAGE}.deepen(1)")
    assert depth(page) == pytest.approx(1.2 * 0.003)


def test_a_first_press_shows_and_is_no_deeper_than_its_place_is_known_to_bear(page):
    (x, y), *_ = spots(page, 1)
    begin(page, 1.0)
    page.mouse.click(x, y)
    assert depth(page) == pytest.approx(0.4 * PEAK_M)
    # colours go beyond the middle of their scale
    assert 0.5 < max(page.evaluate(f"[...{STAGE}.main.shades]")) <= 1
    page.evaluate(f"{STAGE}.release()")
    rest(page)
    begin(page, 0.002)
    page.mouse.click(x, y)
    assert depth(page) == pytest.approx(0.002)
    # a tenth of the scale is seen as a third of it
    shades = np.array(page.evaluate(f"[...{STAGE}.main.shades]"))
    moved = np.linalg.norm(np.reshape(rest(page)["displacement"], (-1, 3)), axis=1)
    np.testing.assert_allclose(shades, np.sqrt(moved / PEAK_M), atol=1e-3)
    assert page.locator(".legend .ticks span").all_text_contents() == ["0", "1", "5", "10", "20"]


def test_a_pointer_that_trembles_takes_nothing_from_the_wish(page):
    (x, y), *_ = spots(page, 1)
    begin(page, 0.002)
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 2, y - 2)
    page.mouse.move(x - 1, y + 1)
    page.mouse.up()
    rest(page)
    assert page.evaluate(f"[{STAGE}.active.depth, {STAGE}.active.wish]") == pytest.approx([0.002, 0.4 * PEAK_M])


def test_nothing_is_pressed_where_all_of_a_triangle_is_held(browser, model, liver, tmp_path):
    """The coarse mesh does not know what it bears, and would answer with newtons in their thousands."""
    file, held = tmp_path / "press.html", held_nodes(liver)
    file.write_text(press_document([model], held=held), encoding="utf-8")
    whole = np.flatnonzero(held[np.searchsorted(liver.fine.surface, liver.fine.triangles)].all(axis=1))
    with chromium.visit(browser, file, reduced_motion="reduce") as visited:
        page = visited.page
        chromium.until(page, READY)
        page.evaluate(f"{STAGE}.put({{ triangle: {whole[0]}, weights: [0.3, 0.3, 0.4] }})")
        assert depth(page) == 0
        assert rest(page)["presses"] == []
        page.wait_for_timeout(300)
        assert page.text_content(".bound") == "here the organ is held, and cannot be pressed"
        assert visited.complaints == []
