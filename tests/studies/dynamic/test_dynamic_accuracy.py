"""Motions against a reference whose step suffices: what is compared, what is fitted, and what counts as failure."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.poked_bar import poked

from palpate.benchmark.measuring import measure
from palpate.benchmark.motion_truth import motion_truth
from palpate.effects.settings import Springs
from palpate.errors import InputError, NotConverged
from palpate.run.settings import defaults
from palpate.setting_types import plain
from palpate.studies.dynamic import accuracy
from palpate.studies.dynamic.compared_scene import ComparedScene, training_of
from palpate.studies.dynamic.reference import Reference, reference, resolved_frames, tabulate_truth
from palpate.studies.dynamic.settings import tried

SHARE = 0.5
"""Of the loads, under which the motion is that models are fitted to."""

TIMES = ["ms_per_step", "step_p95_ms", "step_max_ms", "real_time_factor", "estimate_s", "offline_s"]


@pytest.fixture(scope="module")
def pressed(box) -> ComparedScene:
    return poked(box, {"hold_s": 1.0}, duration_s=0.2, frames=5)


@pytest.fixture(scope="module")
def truth(pressed) -> Reference:
    return reference(pressed, training_of(pressed, None, SHARE), 0.02, 6)


def test_halving_ends_when_it_changes_little(pressed, truth):
    assert [len(level.tetrahedra) for level in pressed.body.levels] == [96, 768]  # of one level, refined once
    assert truth.change <= 0.02
    assert truth.tried_s == pytest.approx(0.04 / 2.0 ** np.arange(len(truth.tried)))
    assert truth.truth.shape == (5, len(pressed.body.fine.surface), 3)
    off = [np.linalg.norm(tried - truth.truth) for tried in truth.tried]
    assert (np.diff(off) < 0.0).all()
    finer = pressed.move(pressed.fem(5 * 2 ** (len(truth.tried) + 1)), 1)[0]
    better = (4.0 * finer - pressed.move(pressed.fem(5 * 2 ** len(truth.tried)), 1)[0]) / 3.0
    assert np.linalg.norm(better - truth.truth, axis=2).max() < 2 * truth.change * truth.peak


def test_half_the_load_moves_about_half_as_far(pressed, truth):
    ratio = np.linalg.norm(truth.training[-1]) / np.linalg.norm(truth.truth[-1])
    assert 0.9 * SHARE < ratio < 1.2 * SHARE
    assert pressed.scale_loads(2.0).loads.pushes[0].force_n == [0.0, 0.0, -0.4]


def test_what_cannot_be_converged_or_compared_is_told(pressed):
    with pytest.raises(NotConverged, match="poke"):
        reference(pressed, pressed, 1e-12, 2)
    with pytest.raises(InputError, match="no multiple"):
        pressed.fem(7)  # steps do not end where frames do


def test_frames_count_until_halving_changes_one_of_them_too_much():
    for off, frames in (([0.1, 0.1, 0.1, 0.1], 4), ([0.01, 0.03, 0.2, 0.1], 2), ([0.2, 0.0, 0.0, 0.0], 0)):
        assert resolved_frames(np.array(off), np.array([1.0, 2.0, 4.0, 4.0]), 0.03) == frames


@pytest.mark.slow
def test_every_model_is_measured_at_the_settings_given_and_fits_are_of_use(pressed, truth):
    grid = tried(plain(defaults("dynamic").settings), {})
    grid["shape_matching"] |= {"steps_per_frame": [8]}
    grid["fem_fine"] |= {"steps_per_frame": [2]}
    grid["springs"] |= {"shares_of_stable_step": [0.8, 0.4]}
    grid["relaxed"] = {
        "xpbd": [{"level": 1, "steps_per_frame": 80, "iterations": 1}],
        "projective_dynamics": [
            {"level": level, "steps_per_frame": 4, "iterations": 10, "memory": 5} for level in (0, 1, 2)
        ],
        "vertex_block_descent": [{"level": 1, "steps_per_frame": 4, "sweeps": 30, "radius": 0.95}],
    }
    table = accuracy.measure(pressed, training_of(pressed, None, SHARE), truth, grid)[0]
    assert table.groupby("model").size().drop("fem_fine").to_dict() == {
        "fem_coarse": 5, "detail_correction": 3, "moving_modes": 4, "shape_matching": 1, "springs": 2,
        "springs_volume": 2, "xpbd": 1, "projective_dynamics": 2, "vertex_block_descent": 1,  # level 2 there is none
    }  # fmt: skip
    wrong = table.groupby("model")["rmse_of_peak"].min()
    assert not table["failures"].any() and np.isfinite(table["rmse_of_peak"]).all()
    assert wrong["fem_fine"] < 0.02 < wrong["fem_coarse"]
    assert wrong["detail_correction"] < 0.5 * wrong["fem_coarse"] and wrong["moving_modes"] < 0.06
    alike = table[table["step_s"] == 0.02].set_index(["model", "varied"])["rmse_of_peak"]
    assert alike["fem_fine", "order"] > 2.0 * alike["fem_fine", "tolerance"] > 0.0
    assert wrong["projective_dynamics"] < 0.5 * wrong["fem_coarse"]
    assert wrong["xpbd"] < 0.2 and wrong["vertex_block_descent"] < 0.15  # too few iterations for that step
    assert table[table["model"].isin(grid["relaxed"])]["estimate_of_peak"].isna().all()
    modes = table[table["model"] == "moving_modes"]
    assert (modes["offline_s"] > 0.0).all() and (modes["level"] == 1).all()
    assert wrong["springs"] < 0.1 and wrong["springs_volume"] < 0.1 and wrong["shape_matching"] < 0.2
    assert (table["ms_per_step"] > 0.0).all()
    assert (table["step_max_ms"] >= table["step_p95_ms"]).all() and (table["step_max_ms"] > table["ms_per_step"]).all()


def test_models_are_judged_by_the_truth_if_there_is_one_that_is_believed(pressed, truth):
    loads, frames = pressed.placed_loads(), pressed.frames
    limit = motion_truth(pressed.body, loads, pressed.rayleigh, pressed.duration_s, frames, 4 * frames)
    grid = {"fem_coarse": {"steps_per_frame": [4], "tolerances": [], "gaps": []}}
    grid |= {"fem_fine": {"steps_per_frame": [4], "tolerances": []}, "moving_modes": {}}
    true, rejected, none = (
        accuracy.measure(pressed, None, truth, grid, ("fem_coarse",), limit=each)[0]
        for each in (limit, replace(limit, rejected="for a test"), None)
    )
    assert rejected.drop(columns=TIMES).equals(none.drop(columns=TIMES))
    assert set(none["reference"]) == {"fem_fine"} and none["reference_error"].isna().all()
    assert set(true["reference"]) == {"fem_p2"} and (true["reference_error"] == limit.own_error).all()
    wrong = true.groupby("model")["rmse_of_peak"].min()
    assert limit.own_error < wrong["fem_p2"] < 0.2 * wrong["fem_fine"] and wrong["fem_fine"] < wrong["fem_coarse"]
    assert none.groupby("model")["rmse_of_peak"].min()["fem_fine"] < 0.1 * wrong["fem_fine"]
    assert true[true["model"] == "fem_p2"]["level"].tolist() == [0, 0, 0, 1, 1, 2]
    row = tabulate_truth(pressed, limit).iloc[0]
    assert (row["elements"], row["levels"], row["steps"]) == ("quadratic", 3, 20) and row[
        "rmse_of_peak"
    ] == limit.own_error


def test_a_motion_that_blows_up_is_a_failure(pressed, truth):
    fitted = accuracy.Fitted(lambda *at: ComparedScene.springs(*at, Springs(), 0.1).but(allow_unstable=True), 1e12, 0.0)
    one = accuracy.prepared_setting(pressed, "springs", pressed.frames * 20, fitted, "")
    [row] = measure(accuracy.Motions(pressed, truth.truth, truth.force), [one], 0, 0.0)[1]
    assert row["failures"] == 1 and "rmse_m" not in row
