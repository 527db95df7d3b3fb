"""The adjoint's derivatives agree with differences, and descent is faster and better than the genetic algorithm."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.models.springs.descent import (
    TARGET_ERROR,
    descend,
    descend_smoothly,
    square_and_gradient,
    value_and_gradient,
)
from palpate.models.springs.fitness import Fitness, Range
from palpate.models.springs.searches import evolve
from palpate.models.springs.spring_motion import simulate

LIMITS = Range(500.0, 3000.0)


@pytest.fixture(scope="module")
def moduli():
    return 1200.0 * np.exp(0.3 * np.random.default_rng(0).normal(size=120))


def slope(value, at, step):
    """Differentiate by differences of the fourth order."""
    near, far = value(at + step) - value(at - step), value(at + 2 * step) - value(at - 2 * step)
    return (8 * near - far) / (12 * step)


@pytest.mark.parametrize(
    ("volume_n_m", "every"),
    [pytest.param(0.0, 1, marks=pytest.mark.slow), (0.2, 1), pytest.param(0.0, 5, marks=pytest.mark.slow)],
)
def test_the_gradient_agrees_with_differences(cube, moduli, volume_n_m, every):
    settings = replace(cube.settings, volume_n_m=volume_n_m, every=every)
    fitness = Fitness(cube.model, cube.press, settings, *(found[every - 1 :: every] for found in cube.motion))
    value, by_young, by_volume = value_and_gradient(fitness, moduli, volume_n_m)
    assert value == pytest.approx(fitness(moduli[None])[0], rel=1e-12)
    units, steps, checked = np.eye(120)[::3], 1e-4 * moduli[::3], by_young[::3]
    found = [
        slope(lambda e, u=u: fitness((moduli + e * u)[None])[0], 0.0, h) for u, h in zip(units, steps, strict=True)
    ]
    assert np.abs(checked - found).max() < 1e-5 * np.abs(checked).max()
    assert np.linalg.norm(checked - found) < 1e-5 * np.linalg.norm(checked)
    if volume_n_m:
        found = slope(lambda k: value_and_gradient(fitness, moduli, k)[0], volume_n_m, 1e-4 * volume_n_m)
        assert by_volume == pytest.approx(found, rel=1e-5)


def test_descent_passes_the_genetic_algorithm(cube):
    evolved = evolve(cube.fitness, 120, 20, LIMITS, 3, 60)
    found, _ = descend([cube.fitness], np.full(120, 900.0), LIMITS, 60)
    passed = found.history[found.history[:, 2] > evolved.fitness]
    assert passed[0, 0] < 0.1 * evolved.history[-1, 0]
    assert found.fitness > evolved.fitness / 3.0  # a third of its error
    assert (np.diff(found.history[:, 2]) >= 0.0).all()
    assert found.fitness == pytest.approx(cube.fitness(found.young[None])[0], rel=1e-12)
    assert LIMITS.low_pa * (1 - 1e-12) <= found.young.min() and found.young.max() <= LIMITS.high_pa * (1 + 1e-12)


def test_the_volume_forces_stiffness_is_found_with_the_moduli(cube):
    """Of motions that springs of 1500 Pa and 0.3 N/m make."""
    settings = replace(cube.settings, volume_n_m=0.3)
    motion = simulate(cube.model, np.full(120, 1500.0), cube.press, settings)
    fitness = Fitness(cube.model, cube.press, replace(settings, volume_n_m=0.1), *motion)
    alone, _ = descend([fitness], np.full(120, 1200.0), LIMITS, 40)
    found, stiffness = descend([fitness], np.full(120, 1200.0), LIMITS, 40, most_n_m=1.0)
    assert found.fitness > alone.fitness
    assert stiffness == pytest.approx(0.3, rel=0.2)


def test_the_gradient_of_squares_agrees_with_differences(cube, moduli):
    square, gradient = square_and_gradient(cube.fitness, moduli)
    off = simulate(cube.model, moduli, cube.press, cube.settings)[0] - cube.motion[0]
    peak = np.linalg.norm(cube.motion[0] - cube.settings.keys.of(cube.model.nodes), axis=2).max()
    assert square == pytest.approx((off**2).sum(axis=2).mean() / peak**2, rel=1e-12)
    way = moduli * np.random.default_rng(1).normal(size=120)
    difference = [square_and_gradient(cube.fitness, moduli + sign * 1e-5 * way)[0] for sign in (-1, 1)]
    assert gradient @ way == pytest.approx(np.diff(difference)[0] / 2e-5, rel=1e-6)


def test_it_is_no_better_than_enough_and_moduli_are_more_alike(cube):
    """Of a motion whose springs are twice as stiff above the middle as below."""
    true = np.where(cube.model.nodes[:, 2] > 0.005, 2000.0, 1000.0)
    motion = simulate(cube.model, true, cube.press, cube.settings)
    fitness = Fitness(cube.model, cube.press, cube.settings, *motion)
    smooth = descend_smoothly(fitness, np.full(120, 900.0), LIMITS, 200)
    best, _ = descend([fitness], np.full(120, 900.0), LIMITS, 200)
    error = np.sqrt(square_and_gradient(fitness, smooth.young)[0])
    assert 0.5 * TARGET_ERROR < error <= TARGET_ERROR
    assert np.log(smooth.young).std() < 0.5 * np.log(best.young).std()
    assert smooth.fitness == fitness(smooth.young[None])[0]
    # it stops when evaluations run out
    assert len(descend_smoothly(cube.fitness, np.full(120, 2900.0), LIMITS, 5).history) <= 25
