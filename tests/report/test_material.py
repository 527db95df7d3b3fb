"""A part of the report is found by its study's name, and offers what it has to."""

import sys
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules

import pytest
from fixtures.material import STUDIES as FOLDER

from palpate import studies
from palpate.errors import InputError
from palpate.report import page
from palpate.report.table import declared

STUDIES = sorted(module.name for module in iter_modules(studies.__path__) if module.ispkg and declared(module.name))
TOY = {
    "palpate/studies/toy/__init__.py": "",
    "palpate/studies/toy/tables.py": (
        'from palpate.report.table import Table\nTABLES = {"toys": Table("toy price", "The price of each toy.")}\n'
    ),
    "palpate/studies/toy/report.py": (
        "from palpate.studies.toy.tables import TABLES\n"
        'TITLE = "Toys"\n'
        "def numbers(report):\n"
        '    return {"headline": "Toys are cheap.", "count": str(len(report.tables["toys"]))}\n'
        "def sections(report):\n"
        '    return [("toy_section", "All toys", report.note("toys") + report.folded("toys"))]\n'
    ),
}


@pytest.mark.parametrize("study", STUDIES)
def test_a_part_offers_what_the_page_needs_and_little_else(study):
    part = import_module(f"palpate.studies.{study}.report")
    assert {"TITLE", "TABLES", "numbers", "sections"} <= set(part.__all__)
    assert set(part.__all__) <= {"TITLE", "TABLES", "numbers", "sections", "failures"}
    assert part.TABLES is declared(study)
    assert (FOLDER / study / "captions/introduction.rst").is_file()


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
    monkeypatch.setattr(studies, "__path__", [*studies.__path__, str(tmp_path / "palpate/studies")])
    captions = tmp_path / "palpate/studies/toy/captions"
    captions.mkdir()
    (captions / "introduction.rst").write_text("{count} toys are sold.")
    (captions / "toys.rst").write_text("See the *table*.")
    (tmp_path / "tables").mkdir()
    (tmp_path / "tables/toys.csv").write_text("toy,price\nball,3\n")
    yield tmp_path
    for name in [name for name in sys.modules if name.startswith("palpate.studies.toy")]:
        del sys.modules[name]


def test_a_study_that_the_report_never_heard_of_has_its_part(toy):
    page.write(toy, toy / "report.html", ["toy"])
    text = (toy / "report.html").read_text(encoding="utf-8")
    assert '<section id="toy">\n<h2>Toys</h2>\n<p>1 toys are sold.</p>' in text
    assert "<b>Table toys</b>, 1 rows. The price of each toy." in text
    assert '<span class="finding">Toys are cheap.</span>' in text


def test_a_study_without_a_part_is_named(results_folder):
    with pytest.raises(
        InputError, match=r"no part about the study alchemy; write src/palpate/studies/alchemy/report\.py"
    ):
        page.write(results_folder.path, results_folder.path / "report.html", ["alchemy"])
