"""Quadratic elements against their definition, finite differences and scikit-fem."""

import numpy as np
import pytest
from scipy.spatial import cKDTree
from skfem import Basis, ElementTetP2, ElementVector, MeshTet
from skfem.models.elasticity import linear_elasticity

from palpate.bodies.material import LAWS, Material
from palpate.bodies.mesh import TetMesh
from palpate.bodies.refinement import refine
from palpate.effects.quadratic_elements import MeanDilatation, QuadraticElements

SKEW = np.array([[1.0, 0.1, 0.2], [0.0, 1.0, 0.1], [-0.1, 0.0, 1.0]])


@pytest.fixture(scope="module", params=[0.0, 0.3, 0.49])
def block(request, box):
    """0.1 m of a skew box: its mesh, the mesh whose nodes are the unknowns, and its elasticity."""
    mesh = box([1, 1, 1], [0.1, 0.1, 0.1])
    mesh = TetMesh(mesh.nodes @ SKEW, mesh.tetrahedra)
    return mesh, refine(mesh)[0], QuadraticElements(mesh, Material(3000.0, request.param, 1000.0))


def crumpled(mesh, rotation, amount=0.15):
    """Turned far, and every node moved."""
    return mesh.nodes @ rotation(2.0).T + amount * 0.05 * np.random.default_rng(3).normal(size=mesh.nodes.shape)


def test_rest_stiffness_is_that_of_scikit_fem(block):
    mesh, finer, elasticity = block
    mu, lam = (modulus[0] for modulus in elasticity.moduli)
    reference = MeshTet(mesh.nodes.T.copy(), mesh.tetrahedra.T.copy(), sort_t=False)
    basis = Basis(reference, ElementVector(ElementTetP2()), intorder=2)
    distance, theirs = cKDTree(basis.doflocs[:, ::3].T).query(finer.nodes)
    assert distance.max() < 1e-15
    order = (3 * theirs[:, None] + np.arange(3)).ravel()
    expected = linear_elasticity(lam, mu).assemble(basis).toarray()[np.ix_(order, order)]
    found = elasticity.stiffness(finer.nodes).toarray()
    assert np.abs(found - expected).max() < 1e-12 * np.abs(expected).max()


def test_least_det_is_that_of_the_most_flattened_point(block):
    _, finer, elasticity = block
    f = np.diag([1.1, 0.9, 0.7])
    assert elasticity.least_det(finer.nodes @ f) == pytest.approx(np.linalg.det(f), rel=1e-12)
    assert elasticity.least_det(finer.nodes * [1, 1, -1]) == pytest.approx(-1.0, rel=1e-12)
    # one coordinate shrinks like 1 − 8 x: the points lie inside, so that det F stays above its value at the far corner
    x = finer.nodes.copy()
    x[:, 0] -= 4.0 * x[:, 0] ** 2
    assert 1 - 8 * finer.nodes[:, 0].max() < elasticity.least_det(x) < 1 - 8 * 0.8 * finer.nodes[:, 0].max() + 0.2


def test_more_than_one_batch_of_elements(box, rotation, soft):
    """Elements are worked on in batches of 64: 96 and 60 of them, and each alone."""
    for counts in ([4, 2, 2], [5, 2, 1]):
        mesh = box(counts, [0.2, 0.1, 0.1], jitter=0.2)
        finer, elasticity = refine(mesh)[0], QuadraticElements(mesh, soft)
        x = crumpled(finer, rotation)
        force, energy = np.zeros_like(x), 0.0
        for element, nodes in zip(mesh.tetrahedra, elasticity.couples, strict=True):
            alone = QuadraticElements(TetMesh(mesh.nodes[element], np.array([[0, 1, 2, 3]])), soft)
            assert np.array_equal(alone.couples, [np.arange(10)])
            energy += alone.energy(x[nodes])
            force[nodes] += alone.force(x[nodes])
        assert elasticity.energy(x) == pytest.approx(energy, rel=1e-12)
        assert np.abs(elasticity.force(x) - force).max() < 1e-12 * np.abs(force).max()


@pytest.mark.parametrize(
    ("kind", "law"), [(QuadraticElements, LAWS[0]), (QuadraticElements, LAWS[1]), (MeanDilatation, LAWS[1])]
)
@pytest.mark.parametrize("definite", [True, False])
def test_a_product_without_a_matrix_is_that_of_the_stiffness(box, rotation, kind, law, definite):
    mesh = box([4, 3, 2], [0.1, 0.1, 0.1])
    finer = refine(mesh)[0]
    elements = kind(mesh, Material(3000.0, 0.4, 1000.0, law))
    x, u = crumpled(finer, rotation, 0.05), np.random.default_rng(1).normal(size=finer.nodes.shape)
    expected = (elements.stiffness(x, definite) @ u.ravel()).reshape(-1, 3)
    assert np.abs(elements.tangent(x, definite)(u) - expected).max() < 1e-12 * np.abs(expected).max()
    if definite:
        assert np.abs(elements.tangent(x, False)(u) - expected).max() > 1e-3 * np.abs(expected).max(), (
            "none was clamped"
        )
