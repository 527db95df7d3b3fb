"""Eq. 9 for a population."""

from dataclasses import replace

import numba
import numpy as np
import pytest

from palpate.errors import InputError
from palpate.models.springs.fitness import ALPHA_S, LANES, Fitness, Range
from palpate.models.springs.spring_motion import simulate


@pytest.fixture(scope="module")
def population():
    return np.random.default_rng(1).uniform(500.0, 4000.0, (6, 120))


def test_it_is_equation_nine(cube, population):
    settings = replace(cube.settings, volume_n_m=0.5)
    fitness = Fitness(cube.model, cube.press, settings, *cube.motion)
    for young, found in zip(population, fitness(population), strict=True):
        x, v = simulate(cube.model, young, cube.press, settings)
        away = np.linalg.norm(x - cube.motion[0], axis=2) + ALPHA_S * np.linalg.norm(v - cube.motion[1], axis=2)
        assert found == pytest.approx(-away.sum(), rel=1e-10)


def test_compared_less_often_it_is_the_sum_over_those_steps(cube, population):
    settings = replace(cube.settings, every=5)
    wanted = [found[4::5] for found in cube.motion]
    x, v = simulate(cube.model, population[0], cube.press, settings)
    assert np.array_equal(x, simulate(cube.model, population[0], cube.press, cube.settings)[0][4::5])
    away = np.linalg.norm(x - wanted[0], axis=2) + ALPHA_S * np.linalg.norm(v - wanted[1], axis=2)
    found = Fitness(cube.model, cube.press, settings, *wanted)(population)
    assert found[0] == pytest.approx(-away.sum(), rel=1e-10)


def test_an_individual_has_the_same_bits_in_every_lane(cube, population):
    """More individuals than lanes, so that the last block is not full."""
    many = np.repeat(population, 4, axis=0)[: len(LANES) + 5]
    for volume in (0.0, 0.5):
        fitness = Fitness(cube.model, cube.press, replace(cube.settings, volume_n_m=volume), *cube.motion)
        assert np.array_equal(fitness(many), np.repeat(fitness(population), 4)[: len(many)])


def test_the_motion_itself_is_fittest(cube, population):
    own = cube.fitness(np.full((1, 120), 1500.0))[0]
    assert -1e-12 < own <= 0.0
    assert (cube.fitness(population) < -1e-3).all()


def test_any_number_of_threads_gives_the_same_bits(cube, population):
    together, threads = cube.fitness(population), numba.get_num_threads()
    numba.set_num_threads(1)
    try:
        assert np.array_equal(cube.fitness(population), together)
    finally:
        numba.set_num_threads(threads)
    assert np.array_equal([cube.fitness(young[None])[0] for young in population], together)


def test_it_counts_and_survives_a_diverging_motion(cube):
    fitness = Fitness(cube.model, cube.press, cube.settings, *cube.motion)
    found = fitness(np.stack([np.full(120, 1e7), np.full(120, 1500.0)]))
    assert found[0] == -np.inf
    assert found[1] > -1e-12
    assert fitness.evaluations == 2


@pytest.mark.parametrize(("low", "high"), [(5000.0, 300.0), (300.0, 300.0), (-1.0, 5.0), (1.0, np.inf), (np.nan, 1.0)])
def test_an_empty_range_gets_one_sentence(low, high):
    with pytest.raises(InputError, match=r"^springs.young_pa is from .* Pa; give two positive numbers, .*\.$"):
        Range(low, high)


def test_a_reference_of_another_shape_gets_one_sentence(cube):
    with pytest.raises(InputError, match="reference of press top: velocities must be finite and of shape"):
        Fitness(cube.model, cube.press, cube.settings, cube.motion[0], cube.motion[1][1:])
