"""Affine deformations and uniaxial traction, which linear elements reproduce exactly."""

import numpy as np
import pytest
from scipy.linalg import polar

from palpate.bodies.body import nest
from palpate.bodies.material import Material
from palpate.effects.linear_elements import LinearElements
from palpate.solvers.equilibrium import Equilibrium
from palpate.solvers.newton import minimise


def stress(f, material):
    """First Piola–Kirchhoff stress 2μ (F − R) + λ tr(S − I) R [Pa], by scipy's polar decomposition."""
    r, s = polar(f)
    return 2 * material.shear_pa * (f - r) + material.lame_pa * np.trace(s - np.eye(3)) * r


def boundary_forces(mesh, first_piola):
    """∫ P N over the boundary, as nodal forces (n_nodes, 3) [N]."""
    a, b, c = (mesh.nodes[mesh.triangles[:, i]] for i in range(3))
    thirds = np.cross(b - a, c - a) / 6.0 @ first_piola.T
    forces = np.zeros_like(mesh.nodes)
    for corner in range(3):
        np.add.at(forces, mesh.triangles[:, corner], thirds)
    return forces


class Supported:
    """A mesh with single components held: ``held`` (n_nodes, 3) bool stay where Newton's method starts."""

    def __init__(self, mesh, material, held, load):
        self._elasticity, self._held, self._load, self._rest = LinearElements(mesh, material), held, load, mesh.nodes

    def energy(self, x):
        return self._elasticity.energy(x) - np.vdot(self._load, x - self._rest)

    def force(self, x):
        return np.where(self._held, 0.0, self._elasticity.force(x) + self._load)

    def linearise(self, x, definite):
        matrix = self._elasticity.stiffness(x, definite).toarray()
        held = self._held.ravel()
        matrix[held], matrix[:, held], matrix[held, held] = 0.0, 0.0, 1.0
        inverse = np.linalg.pinv(matrix)
        return (lambda p: (matrix @ p.ravel()).reshape(p.shape)), (lambda p: (inverse @ p.ravel()).reshape(p.shape))


AFFINE = np.array([[1.2, 0.1, -0.05], [0.0, 0.9, 0.15], [0.1, -0.1, 1.1]])


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.49])
def test_patch_affine_deformations_leave_no_inner_force(box, rotation, poisson):
    """Inner nodes of an irregular mesh are in balance, those of the boundary bear P N."""
    mesh, material = box([3, 3, 3], [0.1, 0.1, 0.1], jitter=0.2), Material(3000.0, poisson, 1000.0)
    f = rotation(1.3) @ AFFINE
    force = LinearElements(mesh, material).force(mesh.nodes @ f.T + [1.0, 2.0, 3.0])
    expected = -boundary_forces(mesh, stress(f, material))
    inner = np.setdiff1d(np.arange(len(mesh.nodes)), mesh.surface)
    assert len(inner) == 8 and np.abs(expected[inner]).max() < 1e-16
    assert np.abs(force - expected).max() < 1e-10 * np.abs(expected).max()


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.49])
def test_patch_a_moved_boundary_moves_inner_nodes_affinely(box, rotation, poisson):
    mesh, material = box([3, 3, 3], [0.1, 0.1, 0.1], jitter=0.2), Material(3000.0, poisson, 1000.0)
    exact = mesh.nodes @ (rotation(0.4) @ AFFINE).T
    held = np.isin(np.arange(len(mesh.nodes)), mesh.surface)
    start = np.where(held[:, None], exact, mesh.nodes)
    problem = Supported(mesh, material, np.repeat(held[:, None], 3, axis=1), np.zeros_like(exact))
    x = minimise(problem, start, material.young_pa * mesh.size**2, 1e-13).x
    assert np.abs(x - start).max() > 0.1 * mesh.size
    assert np.abs(x - exact).max() < 1e-10 * mesh.size


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.49])
@pytest.mark.parametrize("level", [0, 1])
def test_patch_tractions_make_a_large_affine_deformation(box, poisson, level):
    """x ↦ x + x₁ a keeps the held face in place, so P N on the other faces must give it exactly."""
    mesh = box([2, 2, 2], [0.1, 0.1, 0.1], jitter=0.2)
    held = np.flatnonzero(mesh.nodes[:, 0] == 0.0)
    body = nest("patch", mesh, level, held, Material(3000.0, poisson, 1000.0))
    f = np.eye(3)
    f[:, 0] += [0.25, 0.3, -0.2]
    solution = Equilibrium(body, level).solve(boundary_forces(body.fine, stress(f, body.material)), 1e-12)
    assert np.abs(solution.x - body.fine.nodes @ f.T).max() < 1e-10 * mesh.size


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.49])
@pytest.mark.parametrize("pull", [1e-3, 0.4, -0.3])
def test_uniaxial_traction(box, poisson, pull):
    """On symmetry supports a bar under nominal traction T = E ε stretches by ε and thins by ν ε, however large T is."""
    mesh, material = box([3, 2, 2], [0.3, 0.1, 0.1], jitter=0.2), Material(3000.0, poisson, 1000.0)
    load = boundary_forces(mesh, np.diag([pull * material.young_pa, 0.0, 0.0]))
    load[mesh.nodes[:, 0] == 0.0] = 0.0
    x = minimise(Supported(mesh, material, mesh.nodes == 0.0, load), mesh.nodes, np.linalg.norm(load), 1e-9).x
    strain = np.ptp(x, axis=0) / np.ptp(mesh.nodes, axis=0) - 1.0
    assert strain[0] == pytest.approx(pull, rel=1e-4)
    assert strain[1:] == pytest.approx(-poisson * pull, rel=1e-4, abs=1e-9)
    assert np.abs(x - mesh.nodes * (1.0 + strain)).max() < 1e-9 * mesh.size


def test_a_pulled_bar_without_poissons_effect(box):
    """Then the held face does not hinder it: the strain is σ/E everywhere."""
    mesh = box([4, 2, 2], [0.2, 0.1, 0.1], jitter=0.2)
    body = nest("bar", mesh, 1, np.flatnonzero(mesh.nodes[:, 0] == 0.0), Material(3000.0, 0.0, 1000.0))
    load = boundary_forces(body.fine, np.diag([150.0, 0.0, 0.0]))
    x = Equilibrium(body, 1).solve(load, 1e-10).x
    assert np.abs(x - body.fine.nodes * [1.05, 1.0, 1.0]).max() < 1e-8 * mesh.size
