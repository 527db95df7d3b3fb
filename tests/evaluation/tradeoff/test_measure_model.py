"""Every answer and every failure is counted, costs add up, and the truth's own error is one."""

import warnings
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from palpate.errors import InputError, NotConverged
from palpate.evaluation.accuracy import errors
from palpate.evaluation.timing import WARM_UP
from palpate.evaluation.tradeoff.accuracy_vs_time import COLUMNS, accuracy_vs_time
from palpate.evaluation.tradeoff.measure_model import SAMPLE_COLUMNS, SETTING_COLUMNS, ask, measure, warn_unanswered
from palpate.evaluation.tradeoff.provenance import commit
from palpate.evaluation.tradeoff.reference_error import SETTINGS, limit, reference_error, refined
from palpate.models.model import Model


class Scaled:
    """Answers with a known share of the truth, or fails at one contact."""

    memory_mb = 7.0

    def __init__(self, test, share, fails_at=None):
        self.truth = {(int(c), *f): share * u for c, f, u in zip(test.contact, test.force, test.fine, strict=True)}
        self.fails_at, self.asked = fails_at, []

    def respond(self, contact, force):
        self.asked.append(contact)
        if contact == self.fails_at:
            raise NotConverged("no\nanswer", [1.0])
        return self.truth[(contact, *force)]


def test_a_known_error_is_what_is_measured(slab_case):
    case, test, numbers = slab_case

    def prepare(fresh, setting):
        fresh.use_training(), fresh.use_compliance()
        return Scaled(test, 1.0 - setting["miss"])

    made = Model(lambda case: [{"miss": 0.5}, {"miss": 0.1}], prepare)
    samples, settings = measure(case, "scaled", made, test, numbers, 12, 1.0)
    assert samples.columns.tolist() == SAMPLE_COLUMNS and settings.columns.tolist() == SETTING_COLUMNS
    assert settings["setting"].tolist() == ["miss=0.5", "miss=0.1"]
    for miss, row in zip((0.5, 0.1), settings.itertuples(), strict=True):
        nothing = [errors(np.zeros_like(u), u) for u in test.fine]
        assert row.rmse_of_peak == pytest.approx(miss * np.mean([e.rmse_of_peak for e in nothing]))
        assert row.rmse_m == pytest.approx(miss * np.mean([e.rmse_m for e in nothing]))
        assert row.max_of_peak == pytest.approx(miss)
        assert row.samples == 6 and row.failures == 0 and row.threads == 1 and row.memory_mb == 7.0
        assert row.offline_s >= 24.0 + case.response.seconds
        assert 0 < row.online_median_s <= row.online_p95_s
    own = samples[samples["setting"] == "miss=0.5"]
    assert own["sample"].tolist() == numbers.tolist() and own["rmse_m"].mean() == pytest.approx(settings["rmse_m"][0])


def test_failures_are_counted_and_told(slab_case):
    case, test, numbers = slab_case
    bad = int(test.contact[2])
    made = Model(lambda case: [{}], lambda case, setting: Scaled(test, 0.5, bad))
    samples, settings = measure(case, "sometimes", made, test, numbers, 20, 1.0)
    failed = test.contact == bad
    assert settings["failures"].item() == failed.sum() == 2
    assert (samples["failure"] == np.where(failed, "no answer", "")).all()
    assert samples["rmse_m"].isna().tolist() == failed.tolist() == samples["seconds"].isna().tolist()
    assert settings["max_of_peak"].item() == pytest.approx(0.5)


def test_what_cannot_be_prepared_has_failed_everywhere(slab_case):
    case, test, numbers = slab_case

    def prepare(case, setting):
        raise NotConverged("no fit", [1.0])

    samples, settings = measure(case, "never", Model(lambda case: [{}], prepare), test, numbers, 2, 1.0)
    assert (samples["failure"] == "no fit").all() and settings["failures"].item() == 6
    assert settings[["rmse_m", "online_p95_s"]].isna().all(axis=None)


def test_a_model_without_a_setting_for_a_body_leaves_headings_only(slab_case):
    case, test, numbers = slab_case
    samples, settings = measure(case, "none", Model(lambda case: [], None), test, numbers, 2, 1.0)
    assert samples.columns.tolist() == SAMPLE_COLUMNS and len(samples) == len(settings) == 0


@pytest.mark.parametrize(("repeats", "budget", "calls"), [(3, 9.0, 6), (20, 9.0, 20), (20, 0.0, 6)])
def test_every_sample_is_asked_once_and_then_as_often_as_there_is_time(slab_case, repeats, budget, calls):
    test = slab_case[1]
    solver = Scaled(test, 0.5)
    asked = ask(solver, test, repeats, budget)
    assert sum(map(len, asked.seconds)) == calls == len(solver.asked) - WARM_UP
    assert all(asked.seconds) and max(map(len, asked.seconds)) - min(map(len, asked.seconds)) <= 1


def test_what_is_asked_cannot_be_changed_by_who_answers(slab_case):
    test = slab_case[1]
    before = test.force.copy()

    def respond(contact, force):
        force[:] = 0.0
        return np.zeros((test.fine.shape[1], 3))

    ask(SimpleNamespace(respond=respond), test, 6, 0.0)
    assert np.array_equal(test.force, before)


def test_a_wrong_shape_is_refused_and_no_number_has_failed(slab_case):
    test = slab_case[1]
    with pytest.raises(InputError, match=r"^mine\.py: respond gave the shape \(3,\)"):
        ask(SimpleNamespace(respond=lambda contact, force: force), test, 6, 0.0, "mine.py")
    nothing = np.full((test.fine.shape[1], 3), np.nan)
    asked = ask(SimpleNamespace(respond=lambda contact, force: nothing), test, 6, 0.0)
    assert asked.errors == [None] * 6 and all("not finite" in said for said in asked.failures)


def test_queries_that_pay_back():
    row = dict.fromkeys(SETTING_COLUMNS, 1)
    rows = [
        row | {"scene": "a", "model": "fem_fine", "setting": "iterations=1", "online_median_s": 0.5, "offline_s": 0.0},
        row | {"scene": "a", "model": "fem_fine", "setting": "converged", "online_median_s": 1.0, "offline_s": 0.0},
        row | {"scene": "a", "model": "fast", "setting": "", "online_median_s": 0.2, "offline_s": 40.0},
        row | {"scene": "a", "model": "slow", "setting": "", "online_median_s": 1.5, "offline_s": 0.0},
        row | {"scene": "b", "model": "fem_fine", "setting": "converged", "online_median_s": 0.4, "offline_s": 0.0},
        row | {"scene": "b", "model": "fast", "setting": "", "online_median_s": 0.2, "offline_s": 40.0},
    ]
    table = accuracy_vs_time(pd.DataFrame(rows), "abc")
    assert table.columns.tolist() == COLUMNS and (table["commit"] == "abc").all()
    assert table["break_even_queries"].tolist() == pytest.approx([0.0, np.inf, 50.0, np.inf, np.inf, 200.0])


def test_the_commit_is_short_and_never_missing():
    assert 0 < len(commit()) < 20


def test_the_limit_of_a_series_is_found():
    random = np.random.default_rng(0)
    truth, wrong = random.normal(size=(2, 30, 3))
    everywhere = np.ones(30, dtype=bool)
    for ratio in (2.0, 2.8, 4.0):
        levels = [truth + wrong / ratio**k for k in range(3)]
        assert np.allclose(limit(*levels, everywhere), truth)
    still = [truth] * 3
    assert np.array_equal(limit(*still, everywhere), truth)
    diverging = [truth, truth + wrong, truth + 3 * wrong]
    assert np.allclose(limit(*diverging, everywhere), truth + 5 * wrong)  # taken for the order 1, not extrapolated away


def test_a_refined_body_has_one_more_nested_level(slab):
    finer = refined(slab)
    assert [len(m.tetrahedra) for m in finer.levels] == [96, 768, 6144]
    assert np.array_equal(finer.fine.nodes[: len(slab.fine.nodes)], slab.fine.nodes)
    assert set(slab.anchors[-1]) < set(finer.anchors[-1])


def test_the_reference_is_wrong_by_less_than_the_coarse_mesh(slab_case):
    case, test, numbers = slab_case
    samples, settings = reference_error(case, test, numbers, 2, 1e-8)
    assert settings["setting"].tolist() == list(SETTINGS) and (settings["model"] == "reference").all()
    pairs = zip(test.coarse_live, test.fine, strict=True)
    coarse = np.mean([errors(test.prolongation @ u, fine).rmse_of_peak for u, fine in pairs])
    assert (settings["rmse_of_peak"] > 0.001).all() and (settings["rmse_of_peak"] < coarse).all()
    assert settings["samples"].tolist() == [2, 2] and len(samples) == 4


def test_a_model_of_ones_own_that_answers_nothing_is_warned_of():
    settings = pd.DataFrame({"samples": [3, 3], "failures": [3, 3], "failure": ["mine.py: not finite"] * 2})
    with pytest.warns(UserWarning, match="own_models.mine answered no sample: mine.py: not finite"):
        warn_unanswered("mine", settings)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warn_unanswered("mine", settings.assign(failures=[3, 2]))
