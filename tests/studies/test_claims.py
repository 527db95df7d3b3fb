"""Claims of all studies are gathered into one table, and every study that judges some can be gathered."""

import sys
from importlib import import_module
from types import ModuleType

import pandas as pd
import pytest

from palpate.number_text import percent_in_table
from palpate.report import claims as judged
from palpate.report import declared
from palpate.report.claims import Claim, gather, verdict
from palpate.report.tables import columns

JUDGES = [(study, *judge) for study in declared.names() for judge in declared.claims(study).items()]


def test_verdicts():
    assert [verdict(True), verdict(True, within=False)] == [judged.CONFIRMED, judged.CONFIRMED_OUTSIDE]
    assert [verdict(False), verdict(False, within=False)] == [judged.REFUTED, judged.REFUTED_OUTSIDE]
    assert judged.not_testable("no data") == "not testable: no data"
    assert [percent_in_table(share) for share in (0.1234, 1.04, 0.000123)] == ["12 %", "100 %", "0.012 %"]


@pytest.mark.parametrize(("study", "place", "tables"), JUDGES)
def test_claims_follow_from_tables_that_their_study_makes(study, place, tables):
    module, _, function = place.partition(":")
    assert callable(getattr(import_module(module), function))
    assert set(tables) <= set(declared.tables(study))


def test_claims_are_gathered_by_paper_and_see_their_own_tables_only(monkeypatch):
    def judge(paper):
        def claims(tables):
            assert list(tables) == ["lengths"]
            yield Claim(
                paper, "1", "it is long", "a bar", "2 m", f"{tables['lengths']['m'].iloc[0]} m", judged.CONFIRMED
            )

        return claims

    for study, paper in (("late", 3), ("early", 1)):
        module = ModuleType(f"palpate.studies.{study}.claims")
        module.claims = judge(paper)
        monkeypatch.setitem(sys.modules, module.__name__, module)
    tables = {"lengths": pd.DataFrame({"m": [3]}), "widths": pd.DataFrame()}
    found = gather({f"palpate.studies.{study}.claims:claims": ("lengths",) for study in ("late", "early")}, tables)
    assert list(found) == columns("claims")
    assert found["paper"].tolist() == [1, 3] and found["study"].tolist() == ["early", "late"]
    assert found["ours"].tolist() == ["3 m", "3 m"]
