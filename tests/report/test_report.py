"""A part of the report is found by its study's name, and offers what it has to."""

import sys

import pytest

from palpate import studies
from palpate.errors import InputError
from palpate.report import declared, page

TOY = {
    "__init__.py": "",
    "measure.py": (
        "from palpate.table_declaration import Table\n"
        'TOYS = Table("toys", "The price of each toy.", """\n    toy: its name\n    price: in cents [0.01 €]\n""")\n'
    ),
    "report.py": 'def numbers(report):\n    return {"name": "a_b"}\n',
    "report.md": (
        "# Toys\n\n{% call finding() %}\nToys are cheap.\n{% endcall %}\n\n"
        "{{ toys | length }} toys of {{ name }} are *sold*.\n\n"
        '## All toys\n\n{% call fold("How to read it") %}\nSee the table.\n{% endcall %}\n\n{{ folded("toys") }}\n'
    ),
}


@pytest.fixture
def toy(tmp_path, monkeypatch):
    """A study that the package does not know, with its table and its captions."""
    folder = tmp_path / "palpate/studies/toy"
    folder.mkdir(parents=True)
    for name, text in TOY.items():
        (folder / name).write_text(text)
    monkeypatch.setattr(studies, "__path__", [*studies.__path__, str(folder.parent)])
    (tmp_path / "tables").mkdir()
    (tmp_path / "tables/toys.csv").write_text("toy,price\nball,3\n")
    yield tmp_path
    declared.folder.cache_clear()
    declared.tables.cache_clear()
    for name in [name for name in sys.modules if name.startswith("palpate.studies.toy")]:
        del sys.modules[name]


def test_a_study_that_the_report_never_heard_of_has_its_part(toy):
    page.write(toy, toy / "report.html", ["toy"])
    text = (toy / "report.html").read_text(encoding="utf-8")
    assert "<p>1 toys of a_b are <em>sold</em>.</p>" in text
    assert "<b>Table toys</b>, 1 rows. The price of each toy." in text and "in cents [0.01 €]" in text
    assert '<span class="finding">Toys are cheap.</span>' in text
    assert "<details><summary>How to read it</summary>\n<p>See the table.</p>" in text
    short = (toy / "report.md").read_text(encoding="utf-8")
    assert short.startswith("## Toys\n\n**Toys are cheap.**\n\n1 toys of a\\_b are *sold*.")
    assert "How to read it" not in short


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("# One\n\n{{ colour_of_the_sky }}", r"report\.md, line 3: there is no table or number .*'colour_of_the_sky'"),
        ("one\n", r"report\.md has no title"),
        ("{% call fold() %}", r"report\.md, line 1: "),
        ("{{ count }", r"report\.md, line 1: "),
    ],
)
def test_a_fault_of_a_template_is_named(toy, text, fault):
    (toy / "palpate/studies/toy/report.md").write_text(text)
    with pytest.raises(InputError, match=fault):
        page.write(toy, toy / "report.html", ["toy"])


def test_a_study_without_a_part_is_named(results_folder):
    said = r"no part about the study alchemy; write src/palpate/studies/alchemy/report\.md"
    with pytest.raises(InputError, match=said):
        page.write(results_folder.path, results_folder.path / "report.html", ["alchemy"])
