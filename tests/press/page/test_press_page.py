"""The page on which a body is pressed, in a real browser: what it shows is what Python answers to the same presses."""

import base64
import json

import numpy as np
import pytest
from playwright.sync_api import expect
from press.page.press_stage import NOW, READY, RESTING, STAGE, rest, same, spots
from report import browser as chromium

from palpate.press.page.page import PressModel, held_nodes, policy, press_document

pytestmark = [pytest.mark.slow, pytest.mark.skipif(chromium.PROGRAM is None, reason=chromium.NEEDS)]


def test_ten_presses_are_what_python_answers(page, answer):
    chosen = spots(page, 10)
    assert len(chosen) == 10
    triangles = set()
    for x, y in chosen:
        page.mouse.click(x, y)
        found = rest(page)
        same(found, answer[0])
        triangles.add(found["presses"][0]["triangle"])
        # the force is what is read, too
        newtons = np.linalg.norm(found["forces"])
        page.wait_for_timeout(150)
        assert float(page.text_content(".readings b").split()[0]) == pytest.approx(newtons, rel=6e-3)
    assert len(triangles) > 7


def test_a_ball_and_a_punch_press_the_nearest_prepared_place(opened, made_up, touched):
    """What the page shows of each is what Python answers, with its force and a curve."""
    with opened([PressModel("contact_modes", "contact modes", made_up.touched)]) as page:
        assert page.evaluate(f"{STAGE}.main.held === {STAGE}.held")
        for number, name in enumerate(("Ball", "Punch")):
            page.locator(".tools span", has_text=name).click()
            page.evaluate(f"{STAGE}.put({{ triangle: 0, weights: [1, 0, 0] }})")
            rest(page)
            depth, along = page.evaluate(f"[{STAGE}.active.shown, {STAGE}.main.answer.forceAlong]")
            right = touched.touch(number, depth)
            assert depth > 1e-3 and along == pytest.approx(right.force_n, rel=1e-6)
            shown = np.reshape(rest(page)["displacement"], (-1, 3))
            assert np.abs(shown - right.displacement).max() < 1e-5 * np.abs(right.displacement).max()
            page.wait_for_timeout(200)
            assert page.locator(".curve svg polyline").count() == 1
        page.locator(".tools span", has_text="Finger").click()
        assert rest(page)["presses"] == []


def test_a_drag_presses_deeper_and_the_wheel_too(page, answer):
    (x, y), *_ = spots(page, 1)
    page.mouse.move(x, y)
    page.mouse.down()
    before = rest(page)
    page.mouse.move(x, y + 30)
    page.mouse.up()
    after = rest(page)
    same(after, answer[0])
    deeper = [np.linalg.norm(found["presses"][0]["moved"]) for found in (before, after)]
    assert deeper[1] > 1.2 * deeper[0]
    assert before["presses"][0]["triangle"] == after["presses"][0]["triangle"]
    page.mouse.wheel(0, 100)
    assert np.linalg.norm(rest(page)["presses"][0]["moved"]) < deeper[1]


def test_a_press_where_the_organ_is_held_takes_nothing_from_the_next(page, answer):
    bear(page, 1)  # deep enough for any wish
    (x, y), (x2, y2) = spots(page, 9)[0], spots(page, 9)[-1]
    page.mouse.click(x, y)
    before = rest(page)
    bear(page, 0)
    page.mouse.click(x2, y2)
    assert rest(page)["presses"] == []
    page.wait_for_timeout(300)
    assert "held" in page.text_content(".bound")
    bear(page, 1)
    page.mouse.click(x, y)
    after = rest(page)
    assert np.linalg.norm(after["presses"][0]["moved"]) == pytest.approx(np.linalg.norm(before["presses"][0]["moved"]))
    same(after, answer[0])


def test_a_finger_slides(page, answer):
    (x, y), *_ = spots(page, 1)
    page.get_by_text("Slide", exact=True).click()
    page.mouse.move(x, y)
    page.mouse.down()
    first = rest(page)["presses"][0]
    for step in range(1, 5):
        page.mouse.move(x + 10 * step, y)
        found = rest(page)
    page.mouse.up()
    same(found, answer[0])
    assert found["presses"][0]["triangle"] != first["triangle"] and len(found["presses"]) == 1
    # where it ends is what lies under the pointer on the bent surface
    place = page.evaluate(
        f"""(() => {{ const s = {STAGE}, {{ canvas }} = s.panel, box = canvas.getBoundingClientRect();
        const [x, y] = s.camera.project(s.active.mix(s.main.places), canvas.clientWidth, canvas.clientHeight);
        return [box.left + x, box.top + y]; }})()"""
    )
    assert np.hypot(place[0] - x - 40, place[1] - y) < 12


def test_a_finger_tilts(page, answer, liver):
    (x, y), *_ = spots(page, 1)
    page.mouse.click(x, y)
    straight = rest(page)
    page.get_by_text("Tilt", exact=True).click()
    chromium.drag(page, x, y, (40, 0))
    found = rest(page)
    same(found, answer[0])
    ways = [np.array(each["presses"][0]["moved"]) for each in (straight, found)]
    cosine = ways[0] @ ways[1] / np.linalg.norm(ways[0]) / np.linalg.norm(ways[1])
    assert np.degrees(np.arccos(cosine)) == pytest.approx(page.evaluate(f"{STAGE}.active.angles[0]"), abs=0.1)
    assert 10 < np.degrees(np.arccos(cosine)) < 30


def test_two_fingers_press_at_once(page, answer):
    (ax, ay), (bx, by) = spots(page, 40)[0], spots(page, 40)[-1]
    page.mouse.click(ax, ay)
    page.get_by_role("button", name="Pin this finger").click()
    page.mouse.click(bx, by)
    found = rest(page)
    assert len(found["presses"]) == 2
    same(found, answer[0])
    expect(page.get_by_role("slider", name="tilt")).to_be_enabled()
    page.get_by_role("button", name="Let go").click()
    assert rest(page)["presses"] == []
    for role, name in (("button", "Pin this finger"), ("button", "Let go"), ("slider", "tilt"), ("slider", "side")):
        expect(page.get_by_role(role, name=name)).to_be_disabled()
    assert np.abs(rest(page)["displacement"]).max() == 0.0


def test_all_of_it_by_keyboard(page, answer):
    page.focus("canvas")
    page.keyboard.press("Tab")  # the focus is shown after a key
    page.keyboard.press("Shift+Tab")
    page.keyboard.press("ArrowRight")
    page.keyboard.press("Enter")
    first = rest(page)
    same(first, answer[0])
    page.keyboard.press("ArrowDown")
    deeper = rest(page)
    assert np.linalg.norm(deeper["presses"][0]["moved"]) > np.linalg.norm(first["presses"][0]["moved"])
    page.keyboard.press("2")
    page.keyboard.press("ArrowLeft")
    slid = rest(page)
    assert slid["presses"][0] != deeper["presses"][0]
    page.keyboard.press("3")
    page.keyboard.press("ArrowUp")
    assert page.evaluate(f"{STAGE}.active.angles[0]") > 1
    same(rest(page), answer[0])
    page.wait_for_timeout(1000)
    said = page.locator("[aria-live]")  # once the finger rests
    expect(said).to_contain_text("newtons", timeout=10_000)
    expect(said).to_contain_text("deep")
    page.keyboard.press("Escape")
    assert rest(page)["presses"] == []


def test_the_truth_is_shown_where_it_is_known(page, model, answer):
    page.get_by_label("known truth").select_option(index=1)
    found = rest(page)
    same(found, answer[0])
    np.testing.assert_allclose(found["presses"][0]["force"], model.truths[0].force)
    found = np.reshape(found["displacement"], (-1, 3))
    truth = model.truths[0].displacement
    page.wait_for_timeout(150)
    peak = np.linalg.norm(truth, axis=1).max()
    rmse = np.sqrt(np.mean(np.sum((found - truth) ** 2, axis=1))) / peak
    assert f"truly {float(f'{100 * rmse:.3g}'):g} %" in page.text_content(".readings")
    page.get_by_role("button", name="Show the truth").click()
    shown = rest(page)
    moved = np.reshape(shown["places"], (-1, 3)) - np.reshape(shown["nodes"], (-1, 3))
    assert np.abs(moved - truth).max() < 1e-4 * np.linalg.norm(truth, axis=1).max()
    page.get_by_label("colour").select_option("truth")
    rest(page)
    assert "difference from the truth" in page.text_content(".legend")
    # a press of the reader's own has no known truth
    page.focus("canvas")
    (x, y), *_ = spots(page, 1)
    page.mouse.move(x, y)
    page.mouse.wheel(0, -100)
    rest(page)
    expect(page.get_by_role("button", name="Show the truth")).to_be_disabled()
    chosen = page.locator(".chosen").all_text_contents()
    assert chosen == ["coarse mesh", "nothing", "displacement", "choose a simulated press"]


def test_a_server_answers_and_its_doubts_are_shown(browser, doubtful, answer):
    asked = []

    def serve(route):
        if route.request.method == "GET":
            return route.fulfill(body=press_document([doubtful]), content_type="text/html")
        presses = json.loads(route.request.post_data)["presses"]
        asked.append(presses)
        found = answer[0].respond(presses)
        moved = base64.b64encode(found.displacement.astype("<f4").tobytes()).decode()
        doubt = "too far" if len(asked) > 1 else ""
        told = {"displacement": moved, "forces": found.forces.tolist(), "error": 0.01, "doubt": doubt, "ms": 2.5}
        return route.fulfill(json=told)

    with browser.new_context(**chromium.DESKTOP, reduced_motion="reduce") as context:
        page = context.new_page()
        said = []
        page.on("console", lambda message: said.append(message.text) if message.type in ("error", "warning") else None)
        page.on("pageerror", lambda error: said.append(str(error)))
        page.route("**/*", serve)
        page.goto("http://localhost:9/token/")
        chromium.until(page, READY)
        (x, y), (x2, y2) = spots(page, 9)[0], spots(page, 9)[-1]
        page.mouse.click(x, y)
        chromium.until(page, f"{STAGE}.pressing?.length === 1 && {RESTING}")
        same(page.evaluate(NOW), answer[0])
        page.wait_for_timeout(150)
        assert "2.5 ms" in page.text_content(".readings") and "± 1 %" in page.text_content(".readings")
        assert not page.is_visible(".doubt")
        page.mouse.click(x2, y2)
        page.wait_for_selector(".doubt:visible")
        assert page.text_content(".doubt") == "The model doubts this answer: too far"
        assert said == []
        page.unroute("**/*")
        page.route("**/*", lambda route: route.abort("connectionrefused"))
        page.mouse.click(x, y)
        chromium.until(page, f"{STAGE}.main.answer.lost")
        page.wait_for_timeout(300)
        assert page.text_content(".doubt") == "No new answer: the server has ended; start palpate press again"


def test_only_a_page_with_a_server_may_ask_one(model, doubtful):
    assert "connect-src" not in policy([model]) and "connect-src 'self'" in policy([model, doubtful])


def test_two_touches_are_two_fingers(opened, model, answer):
    with opened([model], chromium.TELEPHONE) as page:
        assert page.evaluate("document.documentElement.scrollWidth") <= 390
        page.evaluate("document.querySelector('canvas').scrollIntoView()")
        (ax, ay), (bx, by) = spots(page, 30)[0], spots(page, 30)[-1]
        client = page.context.new_cdp_session(page)
        touches = [{"x": ax, "y": ay, "id": 0}, {"x": bx, "y": by, "id": 1}]
        client.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": touches[:1]})
        client.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": touches})
        client.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
        found = rest(page)
        assert len(found["presses"]) == 2
        same(found, answer[0])
        # beside the organ a touch that goes upwards scrolls the page, and turns nothing
        seen = page.evaluate(f"[{STAGE}.camera.yaw, {STAGE}.camera.pitch, scrollY]")
        box = page.locator("canvas").bounding_box()
        beside = {"x": box["x"] + 4, "y": box["y"] + box["height"] - 4, "id": 0}
        client.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": [beside]})
        for step in range(1, 9):
            moved = beside | {"y": beside["y"] - 15 * step}
            client.send("Input.dispatchTouchEvent", {"type": "touchMove", "touchPoints": [moved]})
        client.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
        chromium.until(page, f"scrollY > {seen[2]} + 50")
        assert page.evaluate(f"[{STAGE}.camera.yaw, {STAGE}.camera.pitch]") == seen[:2]


PEAK_M = 0.02
"""Of the pages' models: the fixtures' INFO."""


def bear(page, metres):
    """Let every place bear a press of so many metres."""
    page.evaluate(f"{STAGE}.main.depths = new Map(), {STAGE}.main.model.depth = () => {metres}")


def depth(page):
    rest(page)
    return page.evaluate(f"{STAGE}.active.depth")


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
    chromium.drag(page, x2, y2, (-20, 0))  # a slide by the pointer, too
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


def test_nothing_is_pressed_where_all_of_a_triangle_is_held(opened, model, liver):
    """The coarse mesh does not know what it bears, and would answer with newtons in their thousands."""
    held = held_nodes(liver)
    whole = np.flatnonzero(held[np.searchsorted(liver.fine.surface, liver.fine.triangles)].all(axis=1))
    with opened([model], held=held) as page:
        page.evaluate(f"{STAGE}.put({{ triangle: {whole[0]}, weights: [0.3, 0.3, 0.4] }})")
        assert depth(page) == 0
        assert rest(page)["presses"] == []
        page.wait_for_timeout(300)
        assert page.text_content(".bound") == "here the organ is held, and cannot be pressed"
