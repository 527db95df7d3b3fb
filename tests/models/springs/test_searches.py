"""The genetic algorithm: its rules, monotonic fitness, and repeatability."""

import numpy as np
import pytest

from palpate.models.springs.fitness import Range
from palpate.models.springs.searches import Genetic, evolve

LIMITS = Range(300.0, 5000.0)


def hill(young):
    """Return a fitness that is highest at 1000 Pa."""
    return -np.abs(young - 1000.0).sum(axis=1)


def test_the_best_never_falls_and_half_is_new(cube):
    population = Genetic(cube.fitness, 120, 20, LIMITS, 1)
    for _ in range(30):
        before = population.individuals.copy()
        population.advance()
        assert (population.individuals[:, None] == before[None, :10]).all(axis=2).any(axis=0).all()
    history = population.fit().history
    assert (np.diff(history[:, 2]) >= 0.0).all()
    assert history[-1, 2] > 0.5 * history[0, 2]
    assert history[:, 0].tolist() == list(range(20, 321, 10))
    assert cube.fitness(population.individuals[:1])[0] == history[-1, 2]
    assert population.individuals.min() >= 300.0 and population.individuals.max() <= 5000.0


@pytest.mark.parametrize("generation", [0, 3, 40])
def test_mutation_is_that_of_equations_seven_and_eight(generation):
    """Among equals recombination changes nothing: what differs has mutated."""
    population = Genetic(hill, 60, 4, LIMITS, 1)
    population.individuals[:] = 2650.0
    population.generation = generation
    children = np.array([population._child() for _ in range(4000)])
    changed = children != 2650.0
    mutants = changed.any(axis=1)
    chance = 1.0 / (generation + 2) + 0.002
    assert mutants.mean() == pytest.approx(chance, abs=4.0 * np.sqrt(chance * (1 - chance) / 4000))
    assert changed[mutants].mean() == pytest.approx(0.5, abs=0.03)
    spread = 4700.0 * (1.0 / (generation + 1) + 0.002)
    # the quartiles of a normal distribution are 0.6745 standard deviations away, and not clipped
    quartile = np.median(np.abs(children[changed] - 2650.0))
    assert quartile == pytest.approx(min(0.6745 * spread, 2350.0), rel=0.1)


def test_recombination_is_between_and_a_little_beyond():
    population = Genetic(hill, 50, 4, LIMITS, 1)
    population.individuals[:2], population.individuals[2:] = 1000.0, 2000.0
    population.generation = 10**9
    children = np.array([population._child() for _ in range(4000)])
    assert [children.min(), children.max()] == pytest.approx([500.0, 2500.0], abs=5.0)
    whole = ((children == 1000.0) | (children == 2000.0)).all(axis=1)
    assert whole.mean() == pytest.approx(1.0 - 0.9 / 2, abs=0.03)  # half of the pairs are alike


def test_same_seed_same_result_another_seed_another():
    one, again, other = (evolve(hill, 20, 10, LIMITS, seed, 40).young for seed in (1, 1, 2))
    assert np.array_equal(one, again) and not np.array_equal(one, other)
