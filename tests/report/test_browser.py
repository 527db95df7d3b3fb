"""The page in a real browser: nothing to complain of, nothing asked of the network, tables sort, views turn."""

import shutil
import sys
from pathlib import Path

import pytest

from palpate.figures.enrichment import error_over_body, predictions, turnable_errors
from palpate.figures.scenes import turnable_motion
from palpate.report import page as report

sys.path.insert(0, str(Path(__file__).parent))
import browser as chromium

pytestmark = pytest.mark.skipif(chromium.PROGRAM is None, reason="there is no Chromium; apt-get install chromium")

CAPTIONS = Path(__file__).parents[2] / "workflow" / "report"
PAPERS = ["soft_bodies", "springs", "collision", "enrichment"]
VIEW, ERRORS = "#turn_motion_sag", "#turn_error_over_body_liver_small"
SWEEP = "#sigma details"
LOOK = """(() => {
  const shown = document.querySelector(%r + ' canvas');
  const canvas = Object.assign(document.createElement('canvas'), {width: shown.width, height: shown.height});
  const copy = canvas.getContext('2d', {willReadFrequently: true});
  copy.drawImage(shown, 0, 0);
  const data = copy.getImageData(0, 0, canvas.width, canvas.height).data;
  let sum = 0, full = 0;
  for (let i = 0; i < data.length; i += 4) { full += data[i + 3] > 0; sum = (sum * 31 + data[i] + data[i + 3]) %% 1e9; }
  return [full / (data.length / 4), sum];
})()"""


@pytest.fixture(scope="module")
def browser(whole_folder, sagging, database, predictions_file, tmp_path_factory):
    """A page with real views, and a browser to open it."""
    folder = tmp_path_factory.mktemp("page")
    shutil.copytree(whole_folder.path, folder, dirs_exist_ok=True)
    errors = predictions.read(predictions_file, "paper", "samples", error_over_body.METHODS)
    for view in folder.glob("figures/motion_*.json"):
        turnable_motion.write(sagging, view)
    for view in folder.glob("figures/error_over_body_*.json"):
        turnable_errors.write(database, errors, view)
    report.write(folder, CAPTIONS, folder / "report.html", PAPERS, whole_folder.scenes, whole_folder.cts)
    with chromium.Browser() as opened:
        yield opened, folder / "report.html"


@pytest.fixture
def page(browser):
    """The page as it is when it has been opened; it must not complain, nor fetch anything."""
    opened, path = browser
    opened.call("Emulation.clearDeviceMetricsOverride")
    opened.open(path)
    yield opened
    assert opened.complaints == []
    assert [url for url in opened.asked if not url.startswith(("file:", "data:"))] == []


def seen(page, selector):
    """Share of the view that is covered, and a sum that any change of it changes."""
    page.ask(f"document.querySelector('{selector}').scrollIntoView({{behavior: 'instant'}})")
    page.wait(f"document.querySelector('{selector} canvas').width > 300")
    return page.ask(LOOK % selector)


def column(page, table, number):
    return page.ask(f"[...document.querySelectorAll({table!r} + ' tbody tr')].map(r => r.cells[{number}].textContent)")


def test_views_are_drawn_and_turn(page):
    covered, before = seen(page, VIEW)
    assert 0.05 < covered < 0.9
    page.drag(f"{VIEW} canvas", 90, 10)
    dragged = seen(page, VIEW)[1]
    assert dragged != before
    page.ask(f"document.querySelector('{VIEW} canvas').focus()")
    page.press("ArrowLeft")
    turned, after = seen(page, VIEW)
    assert after != dragged
    page.press("+")
    assert seen(page, VIEW)[0] > 1.1 * turned
    page.press("0")
    assert seen(page, VIEW)[1] == before


def test_a_motion_plays_to_its_end(page):
    seen(page, VIEW)
    assert page.ask(f"document.querySelector('{VIEW} output').textContent") == "0.50 s"  # the peak comes first
    page.ask(f"document.querySelector('{VIEW} canvas').focus()")
    page.press(" ")
    assert page.ask(f"document.querySelector('{VIEW} button').textContent") == "Pause"
    page.wait(f"document.querySelector('{VIEW} button').textContent === 'Play'")
    assert page.ask(f"document.querySelector('{VIEW} output').textContent") == "1.00 s"


def test_a_method_and_a_sample_are_chosen(page):
    before = seen(page, ERRORS)[1]
    options = page.ask(f"[...document.querySelectorAll('{ERRORS} select')].map(s => s.options.length)")
    assert options == [3, 3]
    page.ask(
        f"(() => {{const s = document.querySelectorAll('{ERRORS} select')[0]; s.selectedIndex = 1;"
        "s.dispatchEvent(new Event('change'))})()"
    )
    assert seen(page, ERRORS)[1] != before
    assert page.ask(f"document.querySelector('{ERRORS} output').textContent").startswith("sample 4: ")


def test_tables_sort_by_keyboard_and_come_back(page):
    table = "#verdicts"
    original = column(page, table, 4)
    page.ask(f"document.querySelectorAll('{table} th button')[4].focus()")
    page.press("Enter")
    assert column(page, table, 4) == sorted(original)
    assert page.ask(f"document.querySelectorAll('{table} th')[4].getAttribute('aria-sort')") == "ascending"
    page.press("Enter")
    assert column(page, table, 4) == sorted(original, reverse=True)
    page.press("Enter")
    assert column(page, table, 4) == original
    assert page.ask(f"document.querySelectorAll('{table} [aria-sort]').length") == 0


def test_times_sort_by_what_they_are_and_nothing_stays_last(page):
    page.ask(
        "(() => {const t = document.querySelector('#verdicts table');"
        "[...t.tBodies[0].rows].forEach((r, i) =>"
        "r.cells[3].textContent = "
        "['5\\u00a0ms', '2\\u00a0s', '–', '300\\u00a0µs', '1,200', '<\\u00a00.001'][i] ?? '–');"
        "t.querySelectorAll('th button')[3].click()})()"
    )
    rising = ["300\u00a0µs", "<\u00a00.001", "5\u00a0ms", "2\u00a0s", "1,200"]
    found = column(page, "#verdicts", 3)
    assert found[:5] == rising and set(found[5:]) == {"–"}
    page.ask("document.querySelectorAll('#verdicts th button')[3].click()")
    assert column(page, "#verdicts", 3)[:5] == rising[::-1]


def test_a_long_table_unfolds_and_sorts(page, results):
    assert page.ask(f"document.querySelectorAll('{SWEEP} tbody tr').length") == 0
    page.ask(f"document.querySelector('{SWEEP}').open = true")
    page.wait(f"document.querySelector('{SWEEP} tbody tr') !== null")
    assert page.ask(f"document.querySelectorAll('{SWEEP} tbody tr').length") == len(results["sigma_sweep"])
    page.ask(f"document.querySelectorAll('{SWEEP} th button')[7].click()")
    values = [float(text) for text in column(page, SWEEP, 7)]
    assert values == sorted(values) and len(set(values)) == 5


def test_nothing_overflows_on_a_telephone(page):
    page.call("Emulation.setDeviceMetricsOverride", width=390, height=844, deviceScaleFactor=2, mobile=True)
    assert page.ask("document.documentElement.scrollWidth") <= 390
