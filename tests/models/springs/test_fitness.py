"""Eq. 9 for a population."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from skfem import Basis, ElementTetP1, ElementVector, MeshTet
from skfem.models.elasticity import lame_parameters, linear_elasticity

from palpate.bodies.material import Material
from palpate.bodies.mesh import TetMesh
from palpate.bodies.particles import solid_particles
from palpate.effects.volume_preservation import Volume
from palpate.errors import NotConverged
from palpate.models.springs import fitness
from palpate.models.springs.fitness import ALPHA_S, LANES, Fitness, Range, step_limit
from palpate.models.springs.searches import cma_es
from palpate.models.springs.spring_motion import simulate, spring_model, stiffnesses


@pytest.fixture(scope="module")
def population():
    return np.random.default_rng(1).uniform(500.0, 4000.0, (6, 120))


@pytest.mark.parametrize(("volume", "every"), [(0.5, 1), (0.0, 5)])
def test_it_is_equation_nine_over_the_steps_that_are_compared(cube, population, volume, every):
    settings = replace(cube.settings, volume_n_m=volume, every=every)
    wanted = [found[every - 1 :: every] for found in cube.motion]
    fitness = Fitness(cube.model, cube.press, settings, *wanted)
    for young, found in zip(population, fitness(population), strict=True):
        x, v = simulate(cube.model, young, cube.press, replace(settings, every=1))
        assert np.array_equal(x[every - 1 :: every], simulate(cube.model, young, cube.press, settings)[0])
        away = [np.linalg.norm(a[every - 1 :: every] - b, axis=2) for a, b in zip((x, v), wanted, strict=True)]
        assert found == pytest.approx(-(away[0] + ALPHA_S * away[1]).sum(), rel=1e-10)


def test_an_individual_has_the_same_bits_in_every_lane(cube, population):
    """More individuals than lanes, so that the last block is not full."""
    many = np.repeat(population, 4, axis=0)[: len(LANES) + 5]
    for volume in (0.0, 0.5):
        fitness = Fitness(cube.model, cube.press, replace(cube.settings, volume_n_m=volume), *cube.motion)
        assert np.array_equal(fitness(many), np.repeat(fitness(population), 4)[: len(many)])


def test_the_motion_itself_is_fittest_and_one_that_diverges_least(cube, population):
    lost, own = cube.fitness(np.stack([np.full(120, 1e7), np.full(120, 1500.0)]))
    assert lost == -np.inf and -1e-12 < own <= 0.0
    assert (cube.fitness(population) < -1e-3).all()


LIMITS = Range(300.0, 5000.0)
REGULAR = 0.02 / np.sqrt(8.0) * np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])


def test_uniform_finds_the_modulus_that_made_the_motion(cube):
    fit = fitness.uniform(cube.fitness, 120, LIMITS)
    assert fit.young == pytest.approx(np.full(120, 1500.0), rel=1e-3)
    assert fit.history[-1, 0] < 50
    assert (np.diff(fit.history[:, 2]) >= 0.0).all()


"""The nodes of a tetrahedron with edges of 20 mm."""


def test_lloyds_springs_of_a_regular_tetrahedron_are_the_nearest_to_linear_finite_elements():
    """Of six springs, by the least difference to scikit-fem's matrix at ν = 1/4; Van Gelder: k = E l/(6√2)."""
    material, corners = Material(3000.0, 0.25, 1000.0), np.array([[0, 2, 1, 3]])
    model = spring_model(solid_particles(TetMesh(REGULAR, corners), np.array([0]), material, "one"))
    assert stiffnesses(*fitness.van_gelder(model, material)) == pytest.approx(10.0 / np.sqrt(2.0))
    basis = Basis(MeshTet(REGULAR.T.copy(), corners.T), ElementVector(ElementTetP1()))
    springs = np.zeros((12, 12))
    for i, j in itertools.combinations(range(4), 2):
        along = np.zeros((4, 3))
        along[i], along[j] = REGULAR[i] - REGULAR[j], REGULAR[j] - REGULAR[i]
        springs += np.outer(along, along) / 0.02**2
    matrix = linear_elasticity(*lame_parameters(3000.0, 0.25)).assemble(basis).toarray()
    nearest = float((matrix * springs).sum() / (springs**2).sum())
    assert stiffnesses(*fitness.lloyd(model, material)) == pytest.approx(nearest, rel=1e-12)


def test_volume_force_gives_the_bulk_modulus(cube):
    """The energy of a small swelling ε is ½ · 9 K V ε² of the material."""
    material = Material(1000.0, 0.45, 1000.0)
    kappa = fitness.volume_stiffness(cube.model, material)
    x = (1.0 + 1e-5) * cube.model.nodes
    springs = 0.5 * (1000.0 * cube.model.weights * (1e-5 * cube.model.rest_m) ** 2).sum()
    swelling = springs + Volume(cube.particles, kappa).energy(x)
    assert swelling == pytest.approx(4.5 * 1e-10 * 1e-6 * 1000.0 / (3 * (1 - 0.9)), rel=1e-6)
    assert fitness.volume_stiffness(cube.model, replace(material, poisson=0.2)) == 0.0


def test_cma_es_climbs_repeats_and_stays_in_range():
    def hill(young):
        return -((np.log(young) - np.log(1000.0)) ** 2 * np.arange(1, 13)).sum(axis=1)

    fit, again = (cma_es(hill, np.full(12, 4000.0), LIMITS, 3000, 0) for _ in range(2))
    assert np.array_equal(fit.young, again.young)
    assert fit.young == pytest.approx(np.full(12, 1000.0), rel=1e-3) and fit.fitness == hill(fit.young[None])[0]
    assert not np.array_equal(cma_es(hill, np.full(12, 4000.0), LIMITS, 200, 1).young, fit.young)


@pytest.mark.parametrize("volume", [0.0, 2.0])
def test_the_limit_is_the_edge(cube, volume):
    settings = replace(cube.settings, volume_n_m=volume, steps=400)
    limit = step_limit(cube.particles, cube.model, settings, 5000.0)
    young = np.full(120, 5000.0)
    below = simulate(cube.model, young, cube.press, replace(settings, step_s=0.97 * limit))[0]
    assert np.abs(below - settings.keys.of(cube.model.nodes)).max() < 1e-3
    with pytest.raises(NotConverged):
        simulate(cube.model, young, cube.press, replace(settings, step_s=2.0 * limit))
