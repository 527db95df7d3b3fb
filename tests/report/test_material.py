"""A part of the report is found by its study's name, and offers what it has to."""

import sys
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules

import pytest
from fixtures.material import CAPTIONS

from palpate import evaluation
from palpate.errors import InputError
from palpate.evaluation.table import declared
from palpate.report import page, parts

STUDIES = sorted(module.name for module in iter_modules(evaluation.__path__) if module.ispkg and declared(module.name))
TOY = {
    "palpate/evaluation/toy/__init__.py": "",
    "palpate/evaluation/toy/tables.py": (
        'from palpate.evaluation.table import Table\nTABLES = {"toys": Table("toy price", "The price of each toy.")}\n'
    ),
    "palpate/report/parts/toy.py": (
        "from palpate.evaluation.toy.tables import TABLES\n"
        'TITLE = "Toys"\n'
        "def numbers(report):\n"
        '    return {"headline": "Toys are cheap.", "count": str(len(report.tables["toys"]))}\n'
        "def sections(report):\n"
        '    return [("toy_section", "All toys", report.note("toys") + report.folded("toys"))]\n'
    ),
}


@pytest.mark.parametrize("study", STUDIES)
def test_a_part_offers_what_the_page_needs_and_little_else(study):
    part = import_module(f"palpate.report.parts.{study}")
    assert {"TITLE", "TABLES", "numbers", "sections"} <= set(part.__all__)
    assert set(part.__all__) <= {"TITLE", "TABLES", "numbers", "sections", "failures"}
    assert part.TABLES is declared(study)
    assert (CAPTIONS / study / "introduction.rst").is_file()


def test_no_list_of_studies_is_kept():
    places = [path for path in Path(page.__file__).parent.glob("*.py") if not path.stem.startswith("results_")]
    named = {
        (path.stem, study) for path in places for study in STUDIES if f'"{study}"' in path.read_text(encoding="utf-8")
    }
    assert named == set()


@pytest.fixture
def toy(tmp_path, monkeypatch):
    """A study that the package does not know, with its table and its captions."""
    for name, text in TOY.items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    monkeypatch.setattr(parts, "__path__", [*parts.__path__, str(tmp_path / "palpate/report/parts")])
    monkeypatch.setattr(evaluation, "__path__", [*evaluation.__path__, str(tmp_path / "palpate/evaluation")])
    captions = tmp_path / "captions"
    (captions / "toy").mkdir(parents=True)
    for path in CAPTIONS.glob("*.rst"):
        (captions / path.name).write_text(path.read_text())
    (captions / "toy/introduction.rst").write_text("{count} toys are sold.")
    (captions / "toy/toys.rst").write_text("See the *table*.")
    (tmp_path / "tables").mkdir()
    (tmp_path / "tables/toys.csv").write_text("toy,price\nball,3\n")
    yield tmp_path
    for name in [
        name for name in sys.modules if name.startswith(("palpate.evaluation.toy", "palpate.report.parts.toy"))
    ]:
        del sys.modules[name]


def test_a_study_that_the_report_never_heard_of_has_its_part(toy):
    page.write(toy, toy / "captions", toy / "report.html", ["toy"])
    text = (toy / "report.html").read_text(encoding="utf-8")
    assert '<section id="toy">\n<h2>Toys</h2>\n<p>1 toys are sold.</p>' in text
    assert "<b>Table toys</b>, 1 rows. The price of each toy." in text
    assert '<span class="finding">Toys are cheap.</span>' in text


def test_a_study_without_a_part_is_named(results_folder):
    with pytest.raises(
        InputError, match=r"no part about the study alchemy; write src/palpate/report/parts/alchemy\.py"
    ):
        page.write(results_folder.path, CAPTIONS, results_folder.path / "report.html", ["alchemy"])
