"""The list of hard cases is whole, and outcomes and bounds are judged as they should be."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.errors import InputError, NotConverged
from palpate.studies.hard_cases import cut_cases, enrichment_cases, fem_cases, stage
from palpate.studies.hard_cases.declared import FAMILIES, declared
from palpate.studies.hard_cases.stage import OUTCOMES, Answer, Case, check_finite, judge

CASES = declared(list(FAMILIES))


def test_wrong_is_declared_for_known_faults_alone():
    known = {(case.name, model) for case in CASES for model in case.models if "wrong" in case.acceptable(model)}
    locked = {("locking", model) for model in fem_cases.LOCKED}
    ambiguous = {("near_singular", model) for model in enrichment_cases.AMBIGUOUS}
    removed = {(f"cut_{name}", cut_cases.REMOVED) for name in ("along_held", "slivers")}
    cut = {("cut_two_that_cross", "springs_deleted"), ("cut_incompressible", "elements_virtual_nodes")}
    cut |= {("cut_pulled_far", "updated_responses")} | removed
    assert known == locked | ambiguous | cut | {("finger_friction_of_2", "path_modes")}


def test_the_list_is_long_and_says_all_of_each_case():
    names = [case.name for case in CASES]
    assert len(names) >= 40 and len(set(names)) == len(names)
    for case in CASES:
        assert all((case.models, case.source, case.scene, case.expected, case.measure)) and np.isfinite(case.bound)
        assert isinstance(case.declared, tuple) or set(case.declared) <= set(case.models)
        acceptable = [case.acceptable(model) for model in case.models]
        assert {outcome for outcomes in acceptable for outcome in outcomes} <= set(OUTCOMES) - {"nan"}
        assert acceptable.count(("refused",)) <= 1  # what refuses all models alike is tried once


def case_of(run, models=("model",), bound=1.0, **more):
    return Case("name", "scene", "expected", "measure", bound, run, models, **more)


def said(error):
    def run(model):
        raise error

    return run


def number(value):
    """Return an answer of one number, whose error is the number itself."""
    return Answer(np.array([value]), np.array([9.0]), lambda a: float(a[0]), origin=np.array([-99.0]))


@pytest.mark.parametrize(
    ("run", "outcome"),
    [
        (lambda model: number(1.0), "stable"),
        (lambda model: number(1.1), "wrong"),
        (lambda model: number(np.nan), "nan"),
        (lambda model: number(np.inf), "nan"),
        (lambda model: Answer(np.ones(1), np.ones(1), lambda a: np.nan), "nan"),
        (lambda model: check_finite(np.array([1.0, np.nan])), "nan"),
        (said(InputError("no such thing")), "refused"),
        (said(NotConverged("too many steps", [1.0])), "not_converged"),
        (said(ValueError("array of a wrong shape")), "wrong"),
        (said(ZeroDivisionError()), "wrong"),
    ],
)
def test_what_comes_out_is_judged(run, outcome):
    case = case_of(run)
    strict = judge(case, "model")
    assert strict["outcome"] == outcome
    assert np.isfinite(strict["value"]) == (outcome == "stable" or strict["value"] == 1.1)
    assert bool(strict["message"]) >= (outcome in ("refused", "not_converged"))
    refused = judge(replace(case, declared={"model": ("refused",)}), "model")
    assert refused["passed"] == (outcome == "refused")


@pytest.mark.parametrize(
    ("found", "bound", "sharp"),
    [([2.0, 3.0], 0.05, True), ([2.0, 3.0], 0.25, False), ([0.0, 0.0], 0.05, False), ([1.0, 1.0], 0.05, False)],
)
def test_a_bound_that_a_wrong_answer_meets_does_not_pass(found, bound, sharp):
    """The body starts at (1, 1), and its rest is at (0, 0): an answer there, or one that is loose, tests nothing."""
    expected = np.array(found)
    answer = Answer(expected, np.ones(2), lambda a: float(np.abs(a - expected).max()), zero=np.zeros(2))
    row = judge(case_of(lambda model: answer, bound=bound), "model")
    assert row["outcome"] == "stable" and row["sharp"] == row["passed"] == sharp
    way = np.abs(expected - 1.0).max()
    assert row["frozen"] == way and row["zero"] == np.abs(expected).max()
    assert [row["tenth"], row["twentieth"]] == pytest.approx([0.1 * way, 0.05 * way])


def test_a_bound_may_be_tighter_for_one_model():
    answer = Answer(np.ones(2), np.zeros(2), lambda a: 0.02 + float(np.abs(a - 1.0).max()))
    case = case_of(lambda model: answer, ["a", "b"], 0.1, bounds={"b": 0.01})
    assert [judge(case, model)["outcome"] for model in "ab"] == ["stable", "wrong"]
    assert judge(case, "b")["bound"] == 0.01


def test_a_wrong_answer_that_cannot_be_measured_is_as_wrong_as_can_be():
    broken = Answer(np.ones(1), np.zeros(1), lambda a: 0.0 if a[0] == 1.0 else np.nan)
    assert broken.wrong_errors() == dict.fromkeys((*stage.WRONG, stage.NEARLY), stage.UNMEASURABLE)
