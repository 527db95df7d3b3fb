"""A fit that keeps moduli alike: its derivatives agree with differences, and it stops at the target error."""

import numpy as np
import pytest

from palpate.models.springs.descent import TARGET_ERROR, descend, descend_smoothly, square_and_gradient
from palpate.models.springs.fitness import Fitness, Range
from palpate.models.springs.spring_motion import simulate

LIMITS = Range(500.0, 3000.0)


def test_the_gradient_agrees_with_differences(cube):
    young = 1200.0 * np.exp(0.3 * np.random.default_rng(0).normal(size=120))
    square, gradient = square_and_gradient(cube.fitness, young)
    off = simulate(cube.model, young, cube.press, cube.settings)[0] - cube.motion[0]
    peak = np.linalg.norm(cube.motion[0] - cube.settings.keys.of(cube.model.nodes), axis=2).max()
    assert square == pytest.approx((off**2).sum(axis=2).mean() / peak**2, rel=1e-12)
    way = young * np.random.default_rng(1).normal(size=120)
    difference = [square_and_gradient(cube.fitness, young + sign * 1e-5 * way)[0] for sign in (-1, 1)]
    assert gradient @ way == pytest.approx(np.diff(difference)[0] / 2e-5, rel=1e-6)


def test_it_is_no_better_than_enough_and_moduli_are_more_alike(cube):
    """Of a motion whose springs are twice as stiff above the middle as below."""
    true = np.where(cube.model.nodes[:, 2] > 0.005, 2000.0, 1000.0)
    motion = simulate(cube.model, true, cube.press, cube.settings)
    fitness = Fitness(cube.model, cube.press, cube.settings, *motion)
    smooth = descend_smoothly(fitness, np.full(120, 900.0), LIMITS, 200)
    best = descend([fitness], np.full(120, 900.0), LIMITS, 200)
    error = np.sqrt(square_and_gradient(fitness, smooth.young)[0])
    assert 0.5 * TARGET_ERROR < error <= TARGET_ERROR
    assert np.log(smooth.young).std() < 0.5 * np.log(best.young).std()
    assert smooth.fitness == fitness(smooth.young[None])[0]


def test_it_stops_when_evaluations_run_out(cube):
    assert len(descend_smoothly(cube.fitness, np.full(120, 2900.0), LIMITS, 5).history) <= 25
