"""The page holds everything, and needs nothing from outside."""

import base64
import re
from pathlib import Path

import pytest

from palpate.errors import InputError
from palpate.figures import report, tables

CAPTIONS = Path(__file__).parents[2] / "workflow" / "report"


@pytest.fixture
def page(results_folder):
    report.write(results_folder.path, CAPTIONS, results_folder.path / "report.html")
    return (results_folder.path / "report.html").read_text(encoding="utf-8")


def test_holds_every_figure(page, results_folder):
    embedded = [base64.b64decode(d).decode() for d in re.findall(r'src="data:[^,]+,([^"]+)"', page)]
    for name in results_folder.figures:
        assert f'<figure id="{name}">' in page
        assert any(f"<!-- {name} -->" in picture for picture in embedded)


def test_shows_the_papers_numbers_beside_ours(page):
    text = page.replace("\u00a0", " ")
    for title in ("table 4 of the paper", "Table 3 of the paper", "Nodes, triangles", "Samples to train"):
        assert title in text
    assert "49.3 s" in text and "500 ms" in text  # fine FEM, the paper's mean and ours
    assert "0.90 [0.80, 1.00]" in text
    assert "building w costs O(r k)" in text
    for name in ("sigma_sweep", "enrichment_accuracy", "online_cost", "fem_cost", "complexity"):
        assert f'href="tables/{name}.csv"' in page


def test_asks_nothing_of_the_network(page):
    targets = re.findall(r'(?:src|href)\s*=\s*["\']?([^"\'\s>]+)', page)
    assert targets
    assert not [t for t in targets if re.match(r"(https?:)?//", t)]
    assert not re.search(r"@import|url\(|<script|<link", page)


def test_headline_comes_from_the_tables(page):
    # conftest: ours is the last of 20 methods, interpolation the 13th, the paper's the sixth
    for share in (0.4 / 20, 0.4 / 13, 0.4 / 6):
        assert f"{100 * share:.2g}\u00a0%" in page.split("</header>")[0]


def test_every_placeholder_is_filled_and_every_caption_used(page):
    assert not re.search(r"\{[a-z_]+\}", page.split("</style>")[1])
    source = Path(report.__file__).read_text()
    for caption in CAPTIONS.glob("*.rst"):
        assert re.search(rf"""["']{caption.stem}["']""", source)


def test_two_runs_are_the_same_bytes(page, results_folder):
    report.write(results_folder.path, CAPTIONS, results_folder.path / "again.html")
    assert (results_folder.path / "again.html").read_text(encoding="utf-8") == page


@pytest.mark.parametrize("name", tables.COLUMNS)
def test_a_missing_table_is_named(results_folder, name):
    (results_folder.path / "tables" / f"{name}.csv").unlink()
    with pytest.raises(InputError, match=rf"{name}\.csv is missing"):
        report.write(results_folder.path, CAPTIONS, results_folder.path / "report.html")
    assert not (results_folder.path / "report.html").exists()


def test_a_missing_figure_is_named(results_folder):
    (results_folder.path / "figures" / "sigma_sweep.svg").unlink()
    with pytest.raises(InputError, match=r"sigma_sweep\.svg is missing"):
        report.write(results_folder.path, CAPTIONS, results_folder.path / "report.html")


def test_a_caption_that_asks_for_an_unknown_number_is_named(results_folder, tmp_path):
    captions = tmp_path / "captions"
    captions.mkdir()
    for path in CAPTIONS.iterdir():
        (captions / path.name).write_text(path.read_text(encoding="utf-8"), encoding="utf-8")
    (captions / "claims.rst").write_text("{colour_of_the_sky}")
    with pytest.raises(InputError, match=r"claims\.rst: there is no number called 'colour_of_the_sky'"):
        report.write(results_folder.path, captions, results_folder.path / "report.html")
