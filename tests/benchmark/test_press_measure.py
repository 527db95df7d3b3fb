"""Every answer and every failure is counted, costs add up, and errors are against the truth."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from fixtures.stub import Stub, made_up

from palpate.benchmark.accuracy import truth_errors
from palpate.benchmark.load import Answer, Doubted, Refused
from palpate.benchmark.measuring import WARM_UP, ask
from palpate.benchmark.model import Solver
from palpate.benchmark.press_measure import (
    ACCURACY_VS_TIME,
    COARSER,
    ERRORS,
    ESTIMATED,
    OPERATOR,
    Presses,
    bounds,
    measure,
)
from palpate.benchmark.ranking import TRAINING, averaged
from palpate.errors import InputError, NotConverged
from palpate.models.model_registry import SAVED_AGAINST
from palpate.studies.tradeoff.jobs import accuracy_vs_time, commit

OF_QUESTIONS = Presses.columns_of_questions(("scene", "body", "regime", "split"))


class Scaled(Solver):
    """Answers with a known share of the truth, or fails at one contact."""

    memory_mb = 7.0

    def __init__(self, judge, share, fails_at=None):
        asked = zip(judge.samples.contact, judge.samples.force, judge.truth, strict=True)
        self.truth = {(int(c), *f): share * u for c, f, u in asked}
        self.fails_at, self.asked = fails_at, []

    def respond(self, load):
        contact, force = load.single()
        self.asked.append(contact)
        if contact == self.fails_at:
            raise NotConverged("no\nanswer", [1.0])
        return self.truth[(contact, *force)]


def found(judge, miss, side):
    """The errors of answers that are short by ``miss``, of one side's samples."""
    table = pd.DataFrame([truth_errors((1 - miss) * u, u, p) for u, p in zip(judge.truth, judge.patch, strict=True)])
    return table[judge.side == side]


def asked_of(solver, judge, place="a model"):
    return ask(Presses({}, judge, place), solver, 6, 0.0)


def measured(slab_case, judge, solver, **about):
    """Both tables of a model that has one setting."""
    made = made_up([{}], lambda case, setting: solver, **about)
    return measure(slab_case[0], "made", made, judge, 6, 0.0)


def test_what_a_model_says_of_its_own_error_stands_with_its_samples(slab_case, slab_judge):
    class Sure(Scaled):
        def respond(self, load):
            moved = super().respond(load)
            return Answer(moved, error=0.01) if load.single()[0] != slab_judge.samples.contact[0] else Answer(moved)

    samples, _ = measured(slab_case, slab_judge, Sure(slab_judge, 0.9))
    first = samples["contact"] == slab_judge.samples.contact[0]
    assert samples.loc[first, ESTIMATED].isna().all() and (samples.loc[~first, ESTIMATED] == 0.01).all()


def test_what_learns_nothing_is_asked_at_training_contacts_too(slab_case, slab_judge):
    """Such answers are rows of the samples, and no part of means, times and costs; who learns is not asked."""
    more = replace(slab_judge, side=np.full(6, TRAINING))
    judge = replace(slab_judge, training=more)

    def prepare(fresh, setting):
        if setting["learns"]:
            fresh.use_training()
        return Scaled(slab_judge, 0.9)

    made = made_up([{"learns": True, "size": 1}, {"learns": False, "size": 1}, {"size": 2, "learns": False}], prepare)
    samples, settings = measure(slab_case[0], "scaled", made, judge, 6, 1.0, more_of="size=1")
    asked = samples[samples["side"] == TRAINING]
    assert len(asked) == 6 and set(asked["setting"]) == {"learns=false, size=1"}
    assert asked["rmse_of_peak"].to_numpy() == pytest.approx(found(more, 0.1, TRAINING)["rmse_of_peak"])
    alone, without = measure(slab_case[0], "scaled", made, slab_judge, 6, 1.0, more_of="size=1")
    assert len(samples) == len(alone) + 6
    errors = ["samples", "failures", *ERRORS, "validation_rmse_of_peak"]
    pd.testing.assert_frame_equal(settings[errors], without[errors])


def test_presses_without_a_truth_are_given_to_every_setting_and_are_no_part_of_means(slab_case, slab_judge):
    """Of three one is doubted, one refused and one answered, however much the model has learnt; costs are the same."""
    lost = slab_case[0].database.take(np.array([0, 3, 5]))
    answer = Answer(lost.fine[0])
    says = {
        tuple(lost.force[1]): Doubted("too far", [1.0], answer),
        tuple(lost.force[2]): Refused("more than it knows"),
    }

    def prepare(fresh, setting):
        fresh.use_training()
        if setting["kind"] == "lost":
            raise NotConverged("no fit", [1.0])
        known = Scaled(slab_judge, 0.9)

        def respond(load):
            contact, force = load.single()
            if (contact, *force) in known.truth:
                return known.respond(load)
            if setting["kind"] == "careful" and tuple(force) in says:
                raise says[tuple(force)]
            return lost.fine[0] * (np.nan if setting["kind"] == "nan" else 1.0)

        return Stub(respond=respond)

    made = made_up([{"kind": kind} for kind in ("careful", "sure", "nan", "lost")], prepare)
    judge = replace(slab_judge, rejected=lost)
    samples, settings = measure(slab_case[0], "made", made, judge, 6, 0.0)
    assert settings["rejected"].tolist() == [3] * 4
    assert settings["rejected_answered"].tolist() == [1, 3, 0, 0]
    alone, without = measure(slab_case[0], "made", made, slab_judge, 6, 0.0)
    assert len(samples) == len(alone) and (without[["rejected", "rejected_answered"]] == 0).all(axis=None)
    same = ["samples", "failures", *ERRORS, "validation_rmse_of_peak"]
    pd.testing.assert_frame_equal(settings[same], without[same])
    _, several = measure(slab_case[0], "made", made, replace(judge, split=2), 6, 0.0)
    paid = pd.concat([settings, several]).assign(break_even_queries=1.0)
    assert averaged(paid)[["rejected", "rejected_answered"]].to_numpy().tolist() == [[6, 2], [6, 6], [6, 0], [6, 0]]


def test_presses_that_the_finest_elements_stand_for_have_no_truth_either(slab_case, slab_judge):
    """They are judged, and counted among those without a truth; one of them fails."""
    own = np.where((slab_judge.side == "validation")[:, None], slab_judge.own, np.nan)
    bad = int(slab_judge.samples.contact[-1])
    settings = measured(slab_case, replace(slab_judge, own=own), Scaled(slab_judge, 0.5, bad))[1].iloc[0]
    failed = int((slab_judge.samples.contact[slab_judge.side == "test"] == bad).sum())
    assert (settings["rejected"], settings["rejected_answered"]) == (4, 4 - failed) and failed > 0


def test_a_known_error_is_what_is_measured(slab_case, slab_judge):
    case, judge = slab_case[0], slab_judge

    def prepare(fresh, setting):
        fresh.use_training(), fresh.use_compliance()
        return Scaled(judge, 1.0 - setting["miss"])

    made = made_up([{"miss": 0.5}, {"miss": 0.1}], prepare)
    samples, settings = measure(case, "scaled", made, judge, 12, 1.0)
    assert samples.columns.tolist() == OF_QUESTIONS and settings.columns.tolist() == ACCURACY_VS_TIME.columns
    assert settings["setting"].tolist() == ["miss=0.5", "miss=0.1"] and (settings["split"] == 1).all()
    for miss, row in zip((0.5, 0.1), settings.itertuples(), strict=True):
        tested, chosen = found(judge, miss, "test"), found(judge, miss, "validation")
        for name in ERRORS:
            if name != "max_of_peak":
                assert getattr(row, name) == pytest.approx(tested[name].mean())
        assert row.max_of_peak == pytest.approx(miss) and row.relative_l2 == pytest.approx(miss)
        assert row.patch_rms_of_peak_median == pytest.approx(tested["patch_rms_of_peak"].median())
        assert row.patch_max_of_peak_p95 == pytest.approx(np.percentile(tested["patch_max_of_peak"], 95))
        assert row.rmse_of_peak_p95 == pytest.approx(np.percentile(tested["rmse_of_peak"], 95))
        assert row.validation_rmse_of_peak == pytest.approx(chosen["rmse_of_peak"].mean())
        assert row.validation_patch_rms_of_peak == pytest.approx(chosen["patch_rms_of_peak"].mean())
        assert row.samples == 4 and row.failures == 0 and row.threads == 1 and row.memory_mb == 7.0
        assert row.offline_s >= 24.0 + case.response.seconds
        assert 0 < row.online_median_s <= row.online_p95_s
    own = samples[samples["setting"] == "miss=0.5"]
    assert own["sample"].tolist() == judge.numbers.tolist() and own["side"].tolist() == judge.side.tolist()
    assert own["contact"].tolist() == judge.samples.contact.tolist()


def test_answers_are_compared_with_those_of_coarser_elements(slab_case, slab_judge):
    """Where there are any: half of the true answer is one whole answer away from coarser elements that say that."""
    half = Scaled(slab_judge, 0.5)
    assert measured(slab_case, slab_judge, half)[0][list(COARSER.values())].isna().all(axis=None)
    compared = measured(slab_case, replace(slab_judge, coarser=slab_judge.truth), half)[0]
    for kind, name in (("rms", "rmse_of_peak"), ("patch", "patch_rms_of_peak")):
        assert compared[COARSER[kind]].to_numpy() == pytest.approx(compared[name].to_numpy())


def test_errors_are_against_the_truth_and_not_the_fine_mesh(slab_case, slab_judge):
    """The fine operator's own answer has the operator's error against the truth, and none against the operator."""
    judge = replace(slab_judge, truth=1.1 * slab_judge.truth)
    exact, far = Scaled(slab_judge, 1.0), Scaled(slab_judge, 1.2)
    settings = measured(slab_case, judge, exact, reduces="p2")[1].iloc[0]
    assert settings["relative_l2"] == pytest.approx(0.1 / 1.1) and settings[OPERATOR] == 0.0
    wrong = found(slab_judge, -0.2, "test")["rmse_of_peak"].mean() / 1.1  # of the true peak, like all errors
    assert measured(slab_case, judge, far, reduces="p2")[1][OPERATOR].item() == pytest.approx(wrong)
    assert measured(slab_case, judge, exact)[1][OPERATOR].isna().all()


def test_a_solver_sees_the_frame_before(slab_judge):
    """It is shown every load just before it is asked for, once for each query; a failure there is one of the query."""
    seen, solver = [], Scaled(slab_judge, 1.0)

    def respond(load):
        assert seen[-1] == load.key
        return solver.respond(load)

    asked = asked_of(Stub(precede=lambda load: seen.append(load.key), respond=respond), slab_judge)
    assert not any(each["failure"] for each in asked) and len(seen) == 6 + WARM_UP

    def refuse(load):
        raise NotConverged("not even before", [1.0])

    failed = asked_of(Stub(precede=refuse, respond=solver.respond), slab_judge)
    assert [each["failure"] for each in failed] == ["not even before"] * 6


def test_failures_are_counted_and_told(slab_case, slab_judge):
    judge = slab_judge
    bad = int(judge.samples.contact[judge.side == "test"][-1])
    samples, settings = measured(slab_case, judge, Scaled(judge, 0.5, bad))
    failed = judge.samples.contact == bad
    assert settings["failures"].item() == failed.sum() == 2
    assert (samples["failure"] == np.where(failed, "no answer", "")).all()
    assert samples["rmse_m"].isna().tolist() == failed.tolist() == samples["seconds"].isna().tolist()
    assert settings["max_of_peak"].item() == pytest.approx(0.5)
    chooses = int(judge.samples.contact[judge.side == "validation"][0])
    settings = measured(slab_case, judge, Scaled(judge, 0.5, chooses))[1]
    assert settings["failures"].item() == 0 and np.isnan(settings["validation_rmse_of_peak"].item())


def test_what_is_asked_cannot_be_changed_by_who_answers(slab_judge):
    before = slab_judge.samples.force.copy()

    def respond(load):
        load.single()[1][:] = 0.0
        return np.zeros((slab_judge.truth.shape[1], 3))

    asked_of(Stub(respond=respond, precede=respond), slab_judge)
    assert np.array_equal(slab_judge.samples.force, before)


def test_a_wrong_shape_is_refused_and_no_number_has_failed(slab_judge):
    with pytest.raises(InputError, match=r"^mine\.py: the answer has the shape \(3,\)"):
        asked_of(Stub(respond=lambda load: load.single()[1]), slab_judge, place="mine.py")
    nothing = np.full((slab_judge.truth.shape[1], 3), np.nan)
    asked = asked_of(Stub(respond=lambda load: nothing), slab_judge)
    assert len(asked) == 6 and all("rmse_m" not in each and "not finite" in each["failure"] for each in asked)


def test_the_truth_and_zero_have_rows_of_their_own(slab_case, slab_judge):
    samples, settings = bounds(slab_case[0], slab_judge)
    assert samples.columns.tolist() == OF_QUESTIONS and settings.columns.tolist() == ACCURACY_VS_TIME.columns
    truth, zero = (row for _, row in settings.iterrows())
    assert (truth["model"], truth["setting"], zero["model"]) == ("truth", "own error", "zero")
    assert truth["rmse_of_peak"] == pytest.approx(0.002) == truth["validation_rmse_of_peak"]
    assert truth["patch_rms_of_peak"] == pytest.approx(0.015) and truth["online_median_s"] == 3.0
    assert zero["relative_l2"] == pytest.approx(1) and zero["max_of_peak"] == pytest.approx(1)
    assert zero["rmse_of_peak"] == pytest.approx(found(slab_judge, 1.0, "test")["rmse_of_peak"].mean())
    assert np.isnan(zero["online_median_s"]) and len(samples) == 12
    # bounds that know training contacts add the truth's own error there, and means are those of the others
    more = replace(slab_judge, side=np.full(6, TRAINING), own=10 * slab_judge.own)
    samples, settings = bounds(slab_case[0], replace(slab_judge, training=more))
    own = samples[(samples["side"] == TRAINING) & (samples["model"] == "truth")]
    assert own["rmse_of_peak"].to_numpy() == pytest.approx(10 * slab_judge.own[:, ERRORS.index("rmse_of_peak")])
    assert settings["rmse_of_peak"].iloc[0] == pytest.approx(0.002)


def test_queries_that_pay_back():
    row = dict.fromkeys(ACCURACY_VS_TIME.columns, 1)
    fine = row | {"model": SAVED_AGAINST, "offline_s": 0.0}
    rows = [
        fine | {"scene": "a", "setting": "iterations=1", "online_median_s": 0.5},
        fine | {"scene": "a", "setting": "converged", "online_median_s": 1.0},
        row | {"scene": "a", "model": "fast", "setting": "", "online_median_s": 0.2, "offline_s": 40.0},
        row | {"scene": "a", "model": "slow", "setting": "", "online_median_s": 1.5, "offline_s": 0.0},
        fine | {"scene": "b", "setting": "converged", "online_median_s": 0.4},
        row | {"scene": "b", "model": "fast", "setting": "", "online_median_s": 0.2, "offline_s": 40.0},
        fine | {"scene": "b", "split": 2, "setting": "converged", "online_median_s": 0.6},
        row | {"scene": "b", "split": 2, "model": "fast", "online_median_s": 0.2, "offline_s": 40.0},
    ]
    table = accuracy_vs_time(pd.DataFrame(rows), "abc")
    assert table.columns.tolist() == ACCURACY_VS_TIME.columns and (table["commit"] == "abc").all()
    paid = [0.0, np.inf, 50.0, np.inf, np.inf, 200.0, np.inf, 100.0]
    assert table["break_even_queries"].tolist() == pytest.approx(paid)
    assert 0 < len(commit()) < 20
