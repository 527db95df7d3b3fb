"""The truth of a motion, against a better one, and when it is not believed."""

import numpy as np
import pytest
from fixtures.poked_bar import poked

from palpate.benchmark.motion_truth import MotionTruth, motion_truth
from palpate.benchmark.truth import INVERTED
from palpate.errors import InputError, NotConverged
from palpate.solvers.quadratic_motion import QuadraticMotion


@pytest.fixture(scope="module")
def scene(box):
    return poked(box)


def found(scene, steps: int, count: int = 3, like: MotionTruth | None = None) -> MotionTruth:
    return motion_truth(
        scene.body, scene.placed_loads(), scene.rayleigh, scene.duration_s, scene.frames, steps, count, like=like
    )


@pytest.fixture(scope="module")
def truth(scene):
    return found(scene, 8)


def rms(moved: np.ndarray, truth: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.sum((moved - truth) ** 2, axis=2))) / np.linalg.norm(truth, axis=2).max())


@pytest.mark.slow
def test_a_better_truth_is_as_near_as_the_own_error_says(scene, truth):
    """With one more level and steps of half the length, own errors of both added."""
    better = found(scene, 16, 4)
    assert better.own_error < 0.7 * truth.own_error < 0.005
    off = rms(truth.displacement, better.displacement)
    assert 0.1 * truth.own_error < off < truth.own_error + better.own_error
    assert off < 0.5 * rms(truth.finest.surface, better.displacement), "the limit is better than what it is made of"
    linear = scene.move(scene.fem(8 * scene.frames), -1 % len(scene.body.levels))[0]
    assert rms(linear, better.displacement) > 10.0 * truth.own_error


@pytest.mark.slow
def test_two_levels_find_what_three_do_by_the_ratio_of_another_motion(box, scene, truth):
    pushed = poked(box, {"at_m": [0.08, 0.02, 0.04], "force_n": [0.03, 0.05, -0.15]})
    whole, quick = found(pushed, 8), found(pushed, 8, like=truth)
    assert quick.ratio == truth.ratio and quick.finest.level == 1
    off = rms(quick.displacement, whole.displacement)
    assert off < quick.own_error + whole.own_error and whole.own_error < quick.own_error < 0.02
    assert off < 0.5 * rms(quick.tried[-1].surface, whole.displacement)


def test_the_motions_it_is_made_of_are_told(scene, truth):
    assert [(each.level, each.steps) for each in truth.tried] == [
        (0, 8), (0, 16), (0, 32), (1, 8), (1, 16), (2, 8),
    ]  # fmt: skip
    assert truth.displacement.shape == (scene.frames, len(scene.body.fine.surface), 3)
    assert all(each.seconds >= each.own_s > each.step_p95_s > 0.0 for each in truth.tried) and not truth.rejected
    assert 2.0 < truth.ratio < 8.0 and truth.finest.least_det > 0.2 and truth.finest.balance < 0.01
    space, time, mixed, whole = truth.own[:, 1]
    assert whole == pytest.approx(np.sqrt(space**2 + time**2 + mixed**2)) and whole == truth.own_error
    told = {(each.level, each.steps): each.surface for each in truth.tried}
    in_space = (told[2, 8] - told[1, 8]) / (truth.ratio - 1.0)
    in_time = 4.0 / 3.0 * (told[1, 16] - told[1, 8])  # of second order
    assert truth.displacement == pytest.approx(told[2, 8] + in_space + in_time, abs=1e-12)
    again = found(scene, 8)
    assert np.array_equal(again.displacement, truth.displacement), "bit for bit"


def test_a_motion_that_inverts_an_element_is_not_believed(scene, monkeypatch):
    monkeypatch.setattr(QuadraticMotion, "least_det", lambda self, x: -0.5)
    assert INVERTED in found(scene, 8).rejected


BALL = {"kind": "sphere", "center_m": [0.07, 0.02, 0.062], "radius_m": 0.02, "times_s": [0.0, 0.16, 0.32]}
BALL |= {"shifts_m": [[0, 0, 0], [0, 0, -0.01], [0.006, 0, 0.004]]}
TOUCHED = {"push": None, "contact": {"friction": 0.3, "instruments": [BALL]}}


@pytest.fixture(scope="module")
def touched(box):
    return poked(box, **TOUCHED)


@pytest.mark.slow
def test_what_a_ball_does_to_a_bar_and_feels_is_known_as_well_as_the_own_error_says(touched):
    rough, better = found(touched, 8), found(touched, 16)
    peak = np.linalg.norm(better.force, axis=2).max()
    assert (
        better.force.shape == (8, 1, 3)
        and {each.force.shape for each in better.tried} == {(8, 1, 3)}
        and not better.rejected
    )
    assert rms(rough.displacement, better.displacement) < rough.own_error + better.own_error < 0.03
    assert rms(rough.force, better.force) < rough.own_force + better.own_force < 0.2
    # the ball touches after 2 of 10 mm, and has left the bar at the end; linear elements are nearly as good
    assert np.linalg.norm(better.force[[0, -1]], axis=2).max() < 0.25 * peak
    linear = touched.move(touched.fem(16 * touched.frames), 1)[1].motion.instrument_forces()
    assert 0.02 < rms(linear, better.force) < 0.3 and linear.shape == better.force.shape
    assert better.force[3, 0, 2] < 0.0 < linear[3, 0, 2] / better.force[3, 0, 2] < 1.5


def test_what_instruments_cannot_be_is_told(box):
    floor = {"contact": {"instruments": [{"kind": "floor", "height_m": -0.1, "name": "ground"}]}}
    with pytest.raises(InputError, match="ground is a floor"):
        found(poked(box, **(TOUCHED | floor)), 8)
    high = {"contact": {"instruments": [BALL | {"center_m": [0.07, 0.02, 0.2]}]}}
    with pytest.raises(NotConverged, match="no instrument touches it"):
        found(poked(box, **(TOUCHED | high)), 8)
