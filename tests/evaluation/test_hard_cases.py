"""Every declared hard case ends as it was declared to; and outcomes are judged as they are."""

import numpy as np
import pytest

from palpate.errors import InputError, NotConverged
from palpate.evaluation.hard_cases.declared import FAMILIES, declared, measure
from palpate.evaluation.hard_cases.hard_case import OUTCOMES, Case, finite, judge

CASES = declared(list(FAMILIES))


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_hard_case(case):
    rows = [judge(case, model) for model in case.models]
    assert [row for row in rows if not row["passed"]] == []
    assert not {"wrong", "nan"} & {outcome for model in case.models for outcome in case.acceptable(model)}


def test_the_list_is_long_and_says_all_of_each_case():
    names = [case.name for case in CASES]
    assert len(names) >= 40 and len(set(names)) == len(names)
    for case in CASES:
        assert case.family in FAMILIES and case.models
        assert all((case.source, case.scene, case.expected, case.measure)) and np.isfinite(case.bound)
        assert set(case.declared) <= set(case.models)
        assert {outcome for model in case.models for outcome in case.acceptable(model)} <= set(OUTCOMES)


def said(error):
    def run(model):
        raise error

    return run


@pytest.mark.parametrize(
    ("run", "outcome"),
    [
        (lambda model: 1.0, "stable"),
        (lambda model: 1.1, "wrong"),
        (lambda model: np.nan, "nan"),
        (lambda model: np.inf, "nan"),
        (lambda model: finite(np.array([1.0, np.nan])), "nan"),
        (said(InputError("no such thing")), "refused"),
        (said(NotConverged("too many steps", [1.0])), "not_converged"),
        (said(ValueError("array of a wrong shape")), "wrong"),
        (said(ZeroDivisionError()), "wrong"),
    ],
)
def test_what_comes_out_is_judged(run, outcome):
    words = ("name", "fem", "source", "scene", "expected", "measure", 1.0)
    strict = judge(Case.of(*words, run=run, models=["model"]), "model")
    assert strict["outcome"] == outcome and strict["passed"] == (outcome == "stable")
    assert np.isfinite(strict["value"]) == (outcome == "stable" or strict["value"] == 1.1)
    assert bool(strict["message"]) >= (outcome in ("refused", "not_converged"))
    refused = Case.of(*words, run=run, models=["model"], declared={"model": ("refused",)})
    assert judge(refused, "model")["passed"] == (outcome == "refused")


def test_the_table_has_a_row_for_each_model_of_each_case(monkeypatch):
    words = ("enrichment", "source", "scene", "expected", "measure", 1.0)
    few = [Case.of(name, *words, run=lambda model: len(model), models=["a", "bc"]) for name in ("one", "two")]
    monkeypatch.setitem(FAMILIES, "enrichment", [lambda: few[:1], lambda: few[1:]])
    table = measure("enrichment")
    assert list(zip(table["case"], table["model"], strict=True)) == [
        ("one", "a"), ("one", "bc"), ("two", "a"), ("two", "bc"),
    ]  # fmt: skip
    assert table["outcome"].tolist() == ["stable", "wrong"] * 2 and table["passed"].tolist() == [True, False] * 2
