"""Corotational elasticity against its definition, finite differences and scikit-fem."""

import numpy as np
import pytest
from scipy.linalg import polar
from skfem import Basis, ElementTetP1, ElementVector, MeshTet
from skfem.models.elasticity import linear_elasticity

from palpate.bodies.material import Material
from palpate.bodies.mesh import TetMesh
from palpate.effects.linear_elements import LinearElements, shape_gradients

TETRAHEDRON = TetMesh(np.array([[0.0, 0, 0], [1.1, 0.1, 0], [0.2, 0.9, 0.1], [0, 0.2, 1.3]]), np.array([[0, 1, 2, 3]]))
STRETCHES = {
    "rest": [1, 1, 1],
    "stretched": [1.5, 1.2, 0.8],
    "crushed": [0.5, 0.3, 0.2],
    "flat": [1.2, 0.9, 0],
    "line": [1.2, 0.1, 0],
    "inverted": [1.2, 0.9, -0.4],
    "inside out": [1.5, 1.1, -0.9],
}
# where the rotation is about to jump, and the energy's fold is rounded off
FOLDS = {"at the fold": [1.2, 0.6, -0.6], "near the fold": [1.2, 0.6, -0.58], "folded line": [1.2, 0.01, 0.01]}


@pytest.fixture(scope="module", params=[0.0, 0.3, 0.49])
def block(request, box):
    """0.1 m of an irregular box and its elasticity."""
    mesh = box([2, 2, 2], [0.1, 0.1, 0.1], jitter=0.2)
    return mesh, LinearElements(mesh, Material(3000.0, request.param, 1000.0))


def deformed(stretches, rotation):
    """The one tetrahedron with these signed singular values and skew axes."""
    return TETRAHEDRON.nodes @ (rotation(1.0) @ np.diag(stretches) @ rotation(2.0).T).T


def crumpled(mesh, rotation, amount=0.15):
    """Turned far, and every node moved."""
    return mesh.nodes @ rotation(2.0).T + amount * 0.05 * np.random.default_rng(3).normal(size=mesh.nodes.shape)


def deformation_gradients(mesh, x):
    rest = np.swapaxes(mesh.nodes[mesh.tetrahedra][:, 1:] - mesh.nodes[mesh.tetrahedra][:, :1], 1, 2)
    now = np.swapaxes(x[mesh.tetrahedra][:, 1:] - x[mesh.tetrahedra][:, :1], 1, 2)
    return now @ np.linalg.inv(rest)


def stretch_of(f):
    """The symmetric factor of F = R S with R proper: S's smallest eigenvalue is negative where det F < 0."""
    values, vectors = np.linalg.eigh(polar(f)[1])
    values[0] *= np.sign(np.linalg.det(f))
    return vectors @ np.diag(values) @ vectors.T


def test_rotation_by_any_angle_gives_no_force(block, rotation):
    mesh, elasticity = block
    scale = elasticity.moduli[0][0] * mesh.size**2
    for angle in [*np.linspace(0, 2 * np.pi, 25), np.pi - 1e-8, 1e-9]:
        x = mesh.nodes @ rotation(angle).T + [0.3, -0.2, 0.1]
        assert np.abs(elasticity.force(x)).max() < 1e-10 * scale
        assert abs(elasticity.energy(x)) < 1e-20 * scale * mesh.size


def test_energy_and_force_turn_with_the_body(block, rotation):
    mesh, elasticity = block
    x, turn = crumpled(mesh, rotation), rotation(0.7)
    moved = x @ turn.T + [1.0, 2.0, -0.5]
    assert elasticity.energy(moved) == pytest.approx(elasticity.energy(x), rel=1e-11)
    force = elasticity.force(x)
    assert np.abs(elasticity.force(moved) - force @ turn.T).max() < 1e-10 * np.abs(force).max()


def test_forces_and_moments_balance(block, rotation):
    mesh, elasticity = block
    x = crumpled(mesh, rotation)
    force = elasticity.force(x)
    assert np.abs(force.sum(axis=0)).max() < 1e-12 * np.abs(force).sum()
    assert np.abs(np.cross(x, force).sum(axis=0)).max() < 1e-12 * np.abs(force).sum() * mesh.size


def test_energy_is_the_defined_one(block, rotation):
    """μ ‖S − I‖² + λ/2 tr²(S − I), with scipy's polar decomposition; some elements here are inverted."""
    mesh, elasticity = block
    mu, lam = (modulus[0] for modulus in elasticity.moduli)
    for amount in (0.1, 0.6):
        x = crumpled(mesh, rotation, amount)
        gradients = deformation_gradients(mesh, x)
        assert (np.linalg.det(gradients) < 0).any() == (amount == 0.6)
        strains = [stretch_of(f) - np.eye(3) for f in gradients]
        density = np.array([mu * np.sum(e**2) + 0.5 * lam * np.trace(e) ** 2 for e in strains])
        assert elasticity.energy(x) == pytest.approx(float(density @ mesh.volumes), rel=1e-11)


def test_force_and_stiffness_are_derivatives(block, rotation, differences):
    mesh, elasticity = block
    x = crumpled(mesh, rotation)
    force, stiffness = elasticity.force(x), elasticity.stiffness(x).toarray()
    slope = differences(elasticity.energy, x, 1e-6 * mesh.size).reshape(x.shape)
    assert np.abs(force + slope).max() < 1e-7 * np.abs(force).max()
    slope = -differences(elasticity.force, x, 1e-6 * mesh.size)
    assert np.abs(stiffness - slope).max() < 1e-7 * np.abs(stiffness).max()
    assert np.abs(stiffness - stiffness.T).max() < 1e-13 * np.abs(stiffness).max()


@pytest.mark.parametrize("name", STRETCHES | FOLDS)
def test_derivatives_of_collapsed_and_inverted_elements(name, soft, rotation, differences):
    elasticity = LinearElements(TETRAHEDRON, soft)
    x = deformed((STRETCHES | FOLDS)[name], rotation)
    force, stiffness = elasticity.force(x), elasticity.stiffness(x).toarray()
    slope = differences(elasticity.energy, x, 1e-5).reshape(x.shape)
    assert np.abs(force + slope).max() < 1e-7 * soft.young_pa
    slope = -differences(elasticity.force, x, 1e-6)
    assert np.abs(stiffness - slope).max() < 1e-7 * np.abs(stiffness).max()


@pytest.mark.parametrize("name", STRETCHES)
def test_definite_stiffness_drops_exactly_the_negative_part(name, soft, rotation):
    """The Hessian with respect to F, found back from one element's stiffness, loses its negative eigenvalues."""
    elasticity = LinearElements(TETRAHEDRON, soft)
    x = deformed(STRETCHES[name], rotation)
    gradients, volumes = shape_gradients(TETRAHEDRON)
    to_f = np.einsum("aj,ik->ijak", gradients[0], np.eye(3)).reshape(9, 12)
    back = np.linalg.pinv(to_f)
    hessian = back.T @ elasticity.stiffness(x).toarray() @ back / volumes[0]
    values, vectors = np.linalg.eigh(hessian)
    assert (values[0] < -1.0) == (name not in ("rest", "stretched"))
    clamped = vectors @ np.diag(np.maximum(values, 0.0)) @ vectors.T
    expected = volumes[0] * to_f.T @ clamped @ to_f
    found = elasticity.stiffness(x, definite=True).toarray()
    assert np.abs(found - expected).max() < 1e-10 * np.abs(expected).max()


def test_definite_stiffness_of_a_crumpled_block(block, rotation):
    mesh, elasticity = block
    x = crumpled(mesh, rotation, 0.6)
    exact, definite = (np.linalg.eigvalsh(elasticity.stiffness(x, d).toarray()) for d in (False, True))
    assert exact[0] < -0.01 * exact[-1]
    assert definite[0] > -1e-12 * definite[-1]
    stretched = 1.05 * mesh.nodes @ rotation(2.0).T
    assert np.array_equal(elasticity.stiffness(stretched).data, elasticity.stiffness(stretched, definite=True).data)


@pytest.mark.parametrize("name", FOLDS)
def test_definite_stiffness_is_so_in_the_fold_too(name, soft, rotation):
    elasticity, x = LinearElements(TETRAHEDRON, soft), deformed(FOLDS[name], rotation)
    exact, definite = (np.linalg.eigvalsh(elasticity.stiffness(x, d).toarray()) for d in (False, True))
    assert exact[0] < -0.01 * definite[-1]
    assert definite[0] > -1e-12 * definite[-1]


def test_nothing_jumps_where_the_rotation_does(soft):
    """Energy and force on both sides of s₂ + s₃ = 0, where U Vᵀ turns by π about the first axis."""
    elasticity = LinearElements(TETRAHEDRON, soft)
    one, other = (TETRAHEDRON.nodes @ np.diag([1.2, -0.6, 0.6 + d]) for d in (1e-9, -1e-9))
    assert elasticity.energy(one) == pytest.approx(elasticity.energy(other), rel=1e-8)
    assert np.abs(elasticity.force(one) - elasticity.force(other)).max() < 1e-4 * soft.young_pa * 1e-2


def test_rest_stiffness_is_linear_elasticity(block):
    mesh, elasticity = block
    mu, lam = (modulus[0] for modulus in elasticity.moduli)
    reference = MeshTet(mesh.nodes.T.copy(), mesh.tetrahedra.T.copy(), sort_t=False)
    basis = Basis(reference, ElementVector(ElementTetP1()))
    order = basis.nodal_dofs.T.ravel()
    expected = linear_elasticity(lam, mu).assemble(basis).toarray()[np.ix_(order, order)]
    found = elasticity.stiffness(mesh.nodes).toarray()
    assert np.abs(found - expected).max() < 1e-12 * np.abs(expected).max()


def test_shape_gradients_of_an_irregular_mesh(box):
    mesh = box([2, 2, 2], [0.1, 0.2, 0.3], jitter=0.2)
    gradients, volumes = shape_gradients(mesh)
    assert volumes == pytest.approx(mesh.volumes, rel=1e-12)
    # Σ xₐ ⊗ ∇Nₐ = I: linear functions have the right gradient
    assert np.abs(np.einsum("eai,eaj->eij", mesh.nodes[mesh.tetrahedra], gradients) - np.eye(3)).max() < 1e-12
