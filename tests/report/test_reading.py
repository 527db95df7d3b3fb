"""The page is read in a real browser: the first screen, the navigation, and figures on any screen."""

import shutil
import sys
from pathlib import Path

import pytest
from fixtures.trade_off import OWN

from palpate.report import page as report

sys.path.insert(0, str(Path(__file__).parent))
import browser as chromium

pytestmark = pytest.mark.skipif(chromium.PROGRAM is None, reason=chromium.NEEDS)

STUDIES = ["tradeoff", "scenes", "ct", "enrichment", "springs", "shape_matching", "collision"]
PLAIN = '<svg xmlns="http://www.w3.org/2000/svg" height="{0}pt" width="{1}pt" viewBox="0 0 10 10"></svg>'


@pytest.fixture(scope="module")
def file(whole_folder, trade_off_tables, tmp_path_factory):
    """A page about everything, with empty figures of true sizes."""
    folder = tmp_path_factory.mktemp("reading")
    shutil.copytree(whole_folder.path, folder, dirs_exist_ok=True)
    for name, table in trade_off_tables.items():
        table.to_csv(folder / "tables" / f"{name}.csv", index=False)
    names = ["advice", "advice_flips", "break_even", "truth", "error_bounds", "limit_points", "any_load"]
    for scene in OWN:
        names += [f"work_precision_{scene}", f"best_models_{scene}"]
    for name in [*names, *(path.stem for path in folder.glob("figures/*.svg"))]:
        width, height = (260, 290) if name.startswith("best_models") else (900, 500)
        (folder / f"figures/{name}.svg").write_text(PLAIN.format(height, width))
        (folder / f"figures/{name}.png").write_bytes(b"png")
    for path in folder.glob("figures/*.json"):
        path.unlink()
        path.write_text(
            '{"legend": {"palette": "", "ticks": []}, "frames": {"times_s": [0]}, "window": [1, 1], "axes": []}'
        )
    more = [*trade_off_tables, "node_mass"]
    report.write(folder, folder / "report.html", STUDIES, whole_folder.scenes, whole_folder.cts, more=more)
    return folder / "report.html"


@pytest.fixture
def device():
    """What the page is looked at with."""
    return chromium.DESKTOP


@pytest.fixture
def page(browser, file, device):
    with chromium.visit(browser, file, device) as visited:
        yield visited.page


def test_the_first_screen_shows_the_diagram_beside_the_answer(page):
    picture, answer = (page.locator(f"header {name}").bounding_box() for name in (".first img", ".answer"))
    assert picture["y"] + picture["height"] < 900 and answer["y"] + answer["height"] < 900
    assert answer["x"] + answer["width"] < picture["x"] and picture["width"] > 400


def test_the_navigation_marks_what_is_read_and_fits_the_screen(page):
    for name in ("enrichment", "scenes", "enrichment_times"):
        page.evaluate(f"document.getElementById('{name}').scrollIntoView({{behavior: 'instant'}})")
        chromium.until(page, f"document.querySelector('nav [aria-current]')?.hash === '#{name}'")
        nav = page.locator("nav").bounding_box()
        assert nav["y"] >= 0 and nav["height"] <= 900
        assert page.evaluate("(n => n.scrollHeight <= n.clientHeight)(document.querySelector('nav'))")
    open_parts = page.locator("nav > ul > li.current ul a")
    assert open_parts.count() == page.locator("#enrichment > section").count()  # those of other parts are hidden
    assert page.locator("nav a:visible").count() == page.locator("main > section").count() + 1 + open_parts.count()


def test_a_link_into_a_fold_opens_it(page):
    inside = page.locator("#figure_motion_sag")
    assert not inside.is_visible()
    page.evaluate("location.hash = '#figure_motion_sag'")
    inside.wait_for(state="visible")


def test_no_column_of_the_advice_is_cut(page):
    box, table = (
        page.locator(f"#tradeoff_what_to_take {name}").first.bounding_box() for name in (".scroll", ".scroll table")
    )
    assert table["x"] + table["width"] <= box["x"] + box["width"] + 1


def test_a_large_figure_grows_at_a_click_and_shrinks_again(page):
    pane, image = (page.locator(f"#figure_work_precision_liver_small {name}") for name in (".pane", "img"))
    page.evaluate(
        "document.getElementById('tradeoff_error_against_time_scene_by_scene').scrollIntoView({behavior: 'instant'})"
    )
    assert image.bounding_box()["width"] < 1200
    pane.click()
    assert image.bounding_box()["width"] == 1200
    pane.focus()
    page.keyboard.press("Enter")
    assert image.bounding_box()["width"] < 1200


@pytest.mark.parametrize("device", [chromium.TELEPHONE], ids=["telephone"])
def test_a_telephone_shows_small_diagrams_and_moves_large_ones_sideways(page):
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    small = page.locator("#figure_work_precision_liver_small img").bounding_box()
    assert 340 < small["width"] < 360
    box, image = (page.locator(f"#figure_collision {name}").bounding_box() for name in (".pane", "img"))
    assert box["width"] < 390 and image["width"] == 1200
    page.locator("#figure_collision .pane.wide").wait_for()  # the page marks it once the picture is laid out
