"""Spring parameters without a search, and CMA-ES, against what is known."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from skfem import Basis, ElementTetP1, ElementVector, MeshTet
from skfem.models.elasticity import lame_parameters, linear_elasticity

from palpate.bodies.material import Material
from palpate.bodies.mesh import TetMesh
from palpate.bodies.particles import solid_particles
from palpate.effects.volume_force import Volume
from palpate.models.springs import fitness
from palpate.models.springs.evolution import cma_es
from palpate.models.springs.fitness import Range
from palpate.models.springs.spring_motion import spring_model, stiffnesses

LIMITS = Range(300.0, 5000.0)


def test_regular_tetrahedron():
    """Van Gelder: E l/(6√2); Lloyd: (2√2/25) l E, that is 24/25 of it."""
    nodes = 0.02 / np.sqrt(8.0) * np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    mesh = TetMesh(nodes, np.array([[0, 1, 2, 3]]))
    mesh = mesh if mesh.volumes[0] > 0 else TetMesh(nodes, np.array([[0, 2, 1, 3]]))
    material = Material(3000.0, 0.25, 1000.0)
    model = spring_model(solid_particles(mesh, np.array([0]), material, "one"))
    gelder = stiffnesses(*fitness.van_gelder(model, material))
    assert gelder == pytest.approx(np.full(6, 3000.0 * 0.02 / (6.0 * np.sqrt(2.0))))
    assert stiffnesses(*fitness.lloyd(model, material)) == pytest.approx(24.0 / 25.0 * gelder)


def test_lloyds_constant_is_the_nearest_to_linear_finite_elements():
    """2√2/25: the k of six springs with the least difference to scikit-fem's matrix at ν = 1/4, not at 0.3."""
    nodes = 0.02 / np.sqrt(8.0) * np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    basis = Basis(MeshTet(nodes.T.copy(), np.array([[0], [1], [2], [3]])), ElementVector(ElementTetP1()))
    springs = np.zeros((12, 12))
    for i, j in itertools.combinations(range(4), 2):
        along = np.zeros((4, 3))
        along[i], along[j] = nodes[i] - nodes[j], nodes[j] - nodes[i]
        springs += np.outer(along, along) / 0.02**2
    constants = []
    for poisson in (0.25, 0.3):
        matrix = linear_elasticity(*lame_parameters(3000.0, poisson)).assemble(basis).toarray()
        constants.append(float((matrix * springs).sum() / (springs**2).sum()) / (3000.0 * 0.02))
    assert constants[0] == pytest.approx(2.0 * np.sqrt(2.0) / 25.0, rel=1e-12)
    assert constants[1] > 1.1 * constants[0]


def test_uniform_finds_the_modulus_that_made_the_motion(cube):
    fit = fitness.uniform(cube.fitness, 120, LIMITS)
    assert fit.young == pytest.approx(np.full(120, 1500.0), rel=1e-3)
    assert fit.history[-1, 0] < 50
    assert (np.diff(fit.history[:, 2]) >= 0.0).all()


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

    fits = [cma_es(hill, np.full(12, 4000.0), LIMITS, 3000, 0) for _ in range(2)]
    assert np.array_equal(fits[0].young, fits[1].young)
    assert fits[0].young == pytest.approx(np.full(12, 1000.0), rel=1e-3)
    assert fits[0].fitness == hill(fits[0].young[None])[0]
    assert not np.array_equal(cma_es(hill, np.full(12, 4000.0), LIMITS, 200, 1).young, fits[0].young)


def test_cma_es_on_the_cube_stays_in_range(cube):
    """Where the best is beyond the range, it goes to the range's end and no farther."""
    fit = cma_es(cube.fitness, np.full(120, 1000.0), Range(500.0, 1200.0), 400, 1)
    assert fit.young.min() >= 500.0
    assert fit.young.max() <= 1200.0
    assert fit.fitness > cube.fitness(np.full((1, 120), 1000.0))[0]
