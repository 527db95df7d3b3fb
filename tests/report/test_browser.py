"""The page in a real browser: no complaints, nothing of the network, tables sort, views turn, all screens show it."""

import shutil
import sys
from pathlib import Path

import pytest
from fixtures.trade_off import OWN
from playwright.sync_api import expect

from palpate.report import page as report
from palpate.studies.enrichment.figures import bodies
from palpate.studies.scenes import motion_pictures as motion

sys.path.insert(0, str(Path(__file__).parent))
import browser as chromium

pytestmark = [pytest.mark.slow, pytest.mark.skipif(chromium.PROGRAM is None, reason=chromium.NEEDS)]

STUDIES = ["tradeoff", "scenes", "ct", "enrichment", "springs", "shape_matching", "collision"]
VIEW, ERRORS = "#turn_motion_sag", "#turn_error_over_body_liver_small"
SWEEP, CLAIMS = "#enrichment_kernel_width details.data", "#verdicts details:has-text('with the verdicts')"
PATIENCE_MS = 60_000
LOOK = """shown => {
  const canvas = Object.assign(document.createElement('canvas'), {width: shown.width, height: shown.height});
  const copy = canvas.getContext('2d', {willReadFrequently: true});
  copy.drawImage(shown, 0, 0);
  const data = copy.getImageData(0, 0, canvas.width, canvas.height).data;
  let sum = 0, full = 0;
  for (let i = 0; i < data.length; i += 4) { full += data[i + 3] > 0; sum = (sum * 31 + data[i] + data[i + 3]) % 1e9; }
  return [full / (data.length / 4), sum];
}"""


PLAIN = '<svg xmlns="http://www.w3.org/2000/svg" height="{0}pt" width="{1}pt" viewBox="0 0 10 10"></svg>'


@pytest.fixture(scope="module")
def file(whole_folder, trade_off_tables, sagging, database, predictions_file, tmp_path_factory):
    """A page about everything, with empty figures of true sizes and real views."""
    folder = tmp_path_factory.mktemp("page")
    shutil.copytree(whole_folder.path, folder, dirs_exist_ok=True)
    for name, table in trade_off_tables.items():
        table.to_csv(folder / "tables" / f"{name}.csv", index=False)
    names = ["advice", "break_even", "truth", "error_bounds", "limit_points", "any_load"]
    for scene in OWN:
        names += [f"work_precision_{scene}", f"best_models_{scene}"]
    for name in [*names, *(path.stem for path in folder.glob("figures/*.svg"))]:
        width, height = (260, 290) if name.startswith("best_models") else (900, 500)
        (folder / f"figures/{name}.svg").write_text(PLAIN.format(height, width))
        (folder / f"figures/{name}.png").write_bytes(b"png")
    errors = bodies.read(predictions_file, "paper", "samples", bodies.JUDGED)
    for view in folder.glob("figures/motion_*.json"):
        motion.write(sagging, view)
    for view in folder.glob("figures/error_over_body_*.json"):
        bodies.write(database, errors, view)
    more = [*trade_off_tables, "claims", "node_mass", "maxwell_creep"]
    report.write(folder, folder / "report.html", STUDIES, whole_folder.scenes, whole_folder.cts, more=more)
    return folder / "report.html"


@pytest.fixture
def device():
    """What the page is looked at with."""
    return chromium.DESKTOP


@pytest.fixture
def page(browser, file, device):
    """The page as it is when it has been opened; it must not complain, nor fetch anything."""
    with chromium.visit(browser, file, device) as visited:
        visited.page.set_default_timeout(PATIENCE_MS)
        yield visited.page
        assert visited.complaints == []
        assert [url for url in visited.asked if not url.startswith(("file:", "data:"))] == []


def seen(page, selector):
    """Share of the view that is covered, and a sum that any change of it changes."""
    page.evaluate(f"document.querySelector('{selector}').scrollIntoView({{behavior: 'instant'}})")
    chromium.until(page, f"document.querySelector('{selector} canvas').width > 300")
    return page.locator(f"{selector} canvas").evaluate(LOOK)


def column(page, table, number):
    return page.locator(f"{table} tbody tr > :nth-child({number + 1})").all_text_contents()


def test_views_are_drawn_and_turn(page):
    covered, before = seen(page, VIEW)
    assert 0.05 < covered < 0.9
    box = page.locator(f"{VIEW} canvas").bounding_box()
    chromium.drag(page, box["x"] + box["width"] / 2, box["y"] + box["height"] / 2, (90, 10))
    dragged = seen(page, VIEW)[1]
    assert dragged != before
    page.focus(f"{VIEW} canvas")
    page.keyboard.press("ArrowLeft")
    turned, after = seen(page, VIEW)
    assert after != dragged
    page.keyboard.press("+")
    assert seen(page, VIEW)[0] > 1.1 * turned
    page.keyboard.press("0")
    assert seen(page, VIEW)[1] == before


def test_a_motion_plays_to_its_end(page):
    seen(page, VIEW)
    button, output = page.locator(f"{VIEW} button"), page.locator(f"{VIEW} output")
    assert output.text_content() == "0.50 s"  # the peak comes first
    page.focus(f"{VIEW} canvas")
    page.keyboard.press(" ")
    assert button.text_content() == "Pause"
    expect(button).to_have_text("Play", timeout=PATIENCE_MS)
    assert output.text_content() == "1.00 s"


def test_a_method_and_a_sample_are_chosen(page):
    page.locator(f"details:has({ERRORS}) summary").first.click()
    before = seen(page, ERRORS)[1]
    choices = page.locator(f"{ERRORS} select")
    assert [choice.locator("option").count() for choice in choices.all()] == [3, 3]
    choices.first.select_option(index=1)
    assert seen(page, ERRORS)[1] != before
    assert page.text_content(f"{ERRORS} output").startswith("sample 4: ")


def test_tables_sort_by_keyboard_and_come_back(page):
    page.locator(f"{CLAIMS} summary").first.click()
    original = column(page, CLAIMS, 5)
    assert original
    page.locator(f"{CLAIMS} th button").nth(5).focus()
    page.keyboard.press("Enter")
    assert column(page, CLAIMS, 5) == sorted(original)
    assert page.locator(f"{CLAIMS} th").nth(5).get_attribute("aria-sort") == "ascending"
    page.keyboard.press("Enter")
    assert column(page, CLAIMS, 5) == sorted(original, reverse=True)
    page.keyboard.press("Enter")
    assert column(page, CLAIMS, 5) == original
    assert page.locator(f"{CLAIMS} [aria-sort]").count() == 0


def test_a_long_table_unfolds_and_sorts(page, results):
    rows = page.locator(f"{SWEEP} tbody tr")
    assert rows.count() == 0
    page.locator(f"{SWEEP} summary").click()
    rows.first.wait_for()
    assert rows.count() == len(results["sigma_sweep"])
    page.locator(f"{SWEEP} th button").nth(7).click()
    values = [float(text) for text in column(page, SWEEP, 7)]
    assert values == sorted(values) and len(set(values)) == 5


@pytest.mark.parametrize("device", [chromium.TELEPHONE], ids=["telephone"])
def test_a_telephone_shows_small_diagrams_and_moves_large_ones_sideways(page):
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    small = page.locator("#figure_work_precision_liver_small img").bounding_box()
    assert 340 < small["width"] < 360
    box, image = (page.locator(f"#figure_collision {name}").bounding_box() for name in (".pane", "img"))
    assert box["width"] < 390 and image["width"] == 1200
    page.locator("#figure_collision .pane.wide").wait_for()  # the page marks it once the picture is laid out
