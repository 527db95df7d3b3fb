"""The knife in a real browser, with the server behind it: what the page shows is what Python answers."""

import json
import threading

import numpy as np
import pytest
from press.page.press_stage import CLOSE, READY, STAGE, rest, spots
from press.serve.test_knife import skewed
from report import browser as chromium

from palpate.bodies.cutting.settings import CutSettings
from palpate.press.finished_run import FinishedRun
from palpate.press.serve.command import _page, answers
from palpate.press.serve.pressed_model import Asked
from palpate.press.serve.server import PressServer

pytestmark = [pytest.mark.slow, pytest.mark.skipif(chromium.PROGRAM is None, reason=chromium.NEEDS)]
CUT = f"{STAGE}.cuts.length === 1 && !{STAGE}.severing"
WHOLE = f"{STAGE}.cuts.length === 0 && !{STAGE}.severing"
NOTE = ".knife .advice"


@pytest.fixture(scope="module")
def address(live, finished):
    run = FinishedRun(finished / "config.yaml", finished / "results")
    with PressServer() as server:
        server.offer(_page(live, run, "slab_large", None), answers(live))
        threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True).start()
        yield server.address
        server.shutdown()


@pytest.fixture
def page(browser, address):
    with chromium.visit(browser, address, reduced_motion="reduce") as visited:
        chromium.until(visited.page, READY)
        rest(visited.page)
        yield visited.page
        assert [each for each in visited.complaints if "400" not in each] == []  # a browser tells each refusal


def choose(page, name):
    page.get_by_label("model").select_option(name)
    rest(page)


def way(page, text):
    page.locator(".ways span", has_text=text).click()


def pixel(page, point):
    """The pixel of the page at which a point [m] of the body at rest is seen."""
    return page.evaluate(
        f"""point => {{ const s = {STAGE}, {{ canvas }} = s.panel, box = canvas.getBoundingClientRect();
        const [left, top, w, h] = s.box(0, canvas.clientWidth, canvas.clientHeight);
        const [x, y] = s.camera.project(point, w, h);
        return [box.left + left + x, box.top + top + y]; }}""",
        point,
    )


def cut_across(page, x=0.11, beyond=0.15):
    """Drag the knife over the top, from one side of the body to the other."""
    places = [pixel(page, skewed(x, y)) for y in np.linspace(-beyond + 0.1, beyond, 12)]
    page.mouse.move(*places[0])
    page.mouse.down()
    for place in places[1:]:
        page.mouse.move(*place)
    page.mouse.up()


def test_a_drag_cuts_a_pull_opens_the_lips_and_the_body_is_made_whole(page, live):
    choose(page, "cut_elements")
    before = rest(page)["nodes"]
    page.get_by_role("slider", name="blade").fill("0.04")
    way(page, "Cut")
    cut_across(page)
    chromium.until(page, CUT)
    cuts, nodes, skin = page.evaluate(f"[{STAGE}.cuts, [...{STAGE}.main.surface.nodes], {STAGE}.main.model.skin]")
    model = live.knife("cut_elements")
    surface = model.follow([CutSettings(**cut) for cut in cuts]).surface
    assert cuts[0]["depth_m"] == 0.04 and surface.skin_nodes == skin < len(nodes) / 3
    np.testing.assert_allclose(np.reshape(nodes, (-1, 3)), surface.nodes, atol=1e-7)
    page.wait_for_timeout(250)
    assert "now pull" in page.text_content(NOTE) and "mm apart" not in page.text_content(NOTE)
    way(page, "Pull")
    x, y = pixel(page, skewed(0.16, 0.05))
    chromium.drag(page, x, y, (30, 5), (50, 10))
    found = rest(page)
    (press,) = found["presses"]
    assert np.linalg.norm(press["moved"]) > 0.005
    answer = model.respond([Asked(press["triangle"], np.array(press["weights"]), None, np.array(press["moved"]))])
    shown = np.reshape(found["displacement"], (-1, 3))
    assert np.abs(shown - answer.displacement).max() < CLOSE * np.abs(answer.displacement).max()
    lips = np.unique(np.round(surface.nodes[skin:], 6), axis=0, return_inverse=True)[1].ravel()
    moved = surface.nodes + answer.displacement
    apart = max(np.ptp(moved[skin:][lips == each], axis=0).max() for each in range(lips.max() + 1))
    page.wait_for_timeout(250)
    note = page.text_content(NOTE)
    told = float(note.split("The lips are ")[1].split()[0])
    assert 1e3 * apart <= told * 1.01 and told <= 1e3 * apart * np.sqrt(3) and apart > 1e-3
    assert note.startswith("Cut in ") and "first answer " in note
    # what is red is lips alone
    shades = np.array(page.evaluate(f"[...{STAGE}.main.shades]"))
    assert (shades[skin:] == -2).all() and (shades[:skin] >= 0).all()
    page.get_by_role("button", name="Make whole").click()
    chromium.until(page, WHOLE)
    assert rest(page)["nodes"] == before and rest(page)["presses"] == []


def test_a_refused_cut_is_said_in_one_sentence_and_changes_nothing(page):
    choose(page, "cut_linear")
    before = rest(page)["nodes"]
    page.get_by_role("slider", name="blade").fill("0.001")
    way(page, "Cut")
    (x, y), *_ = spots(page, 1)
    chromium.drag(page, x, y, (10, 0), (20, 0))
    chromium.until(page, f"{STAGE}.refused")
    page.wait_for_timeout(250)
    assert page.text_content(NOTE).startswith("This cut severs nothing, as elements are 30 mm long")
    assert page.evaluate(f"{STAGE}.cuts.length") == 0 and rest(page)["nodes"] == before


def test_what_a_page_sends_for_a_cut_fits_into_a_request():
    from palpate.press.serve.knife import MOST_CUTS, MOST_POINTS, read_cuts
    from palpate.press.serve.server import MAX_BYTES

    path = [[-0.123456, -0.123456, -0.1 - 1e-6 * i] for i in range(MOST_POINTS - 1)]
    cut = {"path_m": [*path, path[0]], "depth_m": 0.12345}  # closed
    body = json.dumps({"presses": [], "cuts": [cut] * MOST_CUTS}).encode()
    assert len(body) < MAX_BYTES - 1000 and len(read_cuts(body)) == MOST_CUTS
