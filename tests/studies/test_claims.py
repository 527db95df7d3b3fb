"""Claims of all studies are gathered into one table, and every study that judges some can be gathered."""

import ast
import sys
from importlib import import_module
from pkgutil import iter_modules
from types import ModuleType

import pandas as pd
import pytest

from palpate import studies as evaluation
from palpate.report.claims import CONFIRMED, OUTSIDE, REFUTED, Claim, gather, not_testable, percent, verdict
from palpate.report.table import columns, declared
from palpate.run.dependencies import files_of

MODULES = [
    f"palpate.studies.{study.name}.{file.stem}"
    for study in iter_modules(evaluation.__path__)
    if study.ispkg
    for file in files_of(f"palpate.studies.{study.name}")
    if file.stem.startswith("claims")
]


def test_verdicts():
    assert [verdict(True), verdict(True, within=False)] == [CONFIRMED] * 2
    assert [verdict(False), verdict(False, within=False)] == [REFUTED, OUTSIDE]
    assert not_testable("no data") == "not testable: no data"
    assert (percent(0.1234), percent(1.04), percent(0.000123)) == ("12 %", "100 %", "0.012 %")


@pytest.mark.parametrize("name", MODULES)
def test_a_module_names_tables_that_its_study_makes(name):
    module, study = import_module(name), name.split(".")[2]
    assert isinstance(module.TABLES, tuple)
    assert set(module.TABLES) <= set(declared(study))
    # the workflow reads them without importing the module
    lines = ast.parse(files_of(name)[0].read_text(encoding="utf-8")).body
    assigned = [line for line in lines if isinstance(line, ast.Assign)]
    (tables,) = [line.value for line in assigned if getattr(line.targets[0], "id", "") == "TABLES"]
    assert ast.literal_eval(tables) == module.TABLES


def test_claims_are_gathered_by_paper_and_see_their_own_tables_only(monkeypatch):
    def judge(paper):
        def claims(tables):
            assert list(tables) == ["lengths"]
            yield Claim(paper, "1", "it is long", "a bar", "2 m", f"{tables['lengths']['m'].iloc[0]} m", CONFIRMED)

        return claims

    for study, paper in (("late", 3), ("early", 1)):
        module = ModuleType(f"palpate.studies.{study}.claims")
        module.TABLES, module.claims = ("lengths",), judge(paper)
        monkeypatch.setitem(sys.modules, module.__name__, module)
    tables = {"lengths": pd.DataFrame({"m": [3]}), "widths": pd.DataFrame()}
    found = gather(["palpate.studies.late.claims", "palpate.studies.early.claims"], tables)
    assert list(found) == columns("claims")
    assert found["paper"].tolist() == [1, 3] and found["study"].tolist() == ["early", "late"]
    assert found["ours"].tolist() == ["3 m", "3 m"]
