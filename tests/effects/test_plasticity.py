"""Plastic flow of finite elements against the analytic relaxation, and the laws it must not break."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.bodies.material import Material
from palpate.bodies.mesh import TetMesh
from palpate.bodies.particles import particles_of
from palpate.effects import shape_matching
from palpate.effects.elements import shape_gradients
from palpate.effects.fem_plasticity import FemPlasticity
from palpate.effects.linear_elements import LinearElements
from palpate.effects.settings import Clusters, Plasticity, ShapeMatching
from palpate.effects.shape_plasticity import ShapePlasticity
from palpate.errors import InputError

TETRAHEDRON = TetMesh(np.array([[0.0, 0, 0], [1.1, 0.1, 0], [0.2, 0.9, 0.1], [0, 0.2, 1.3]]), np.array([[0, 1, 2, 3]]))
YIELD, CREEP, MOST = 0.05, 10.0, 0.5


def plastic(mesh, poisson=0.3, yield_strain=YIELD, most=MOST):
    elastic = LinearElements(mesh, Material(3000.0, poisson, 1000.0))
    return elastic, FemPlasticity(elastic, yield_strain, CREEP, most)


def stretched(strain, rotation, swelling=1.0):
    """The tetrahedron drawn out along a skew axis by a logarithmic strain, at a volume of ``swelling`` of its own."""
    stretch = swelling ** (1 / 3) * np.diag(np.exp([strain, -strain / 2, -strain / 2]))
    return TETRAHEDRON.nodes @ (rotation(1.0) @ stretch @ rotation(2.0).T).T


def elastic_gradients(elastic, x):
    return np.einsum("eai,eaj->eij", x[elastic.tetrahedra], elastic.gradients)


def strain_of(f):
    """√(2/3) of the norm of the deviatoric Hencky strain of each matrix."""
    logs = np.log(np.linalg.svd(f, compute_uv=False))
    return np.sqrt(2 / 3) * np.linalg.norm(logs - logs.mean(axis=-1, keepdims=True), axis=-1)


@pytest.fixture(scope="module")
def lump(box):
    """An irregular block and positions: turned, squeezed and crumpled, no element inverted."""
    mesh = box([3, 3, 3], [0.1, 0.1, 0.1], jitter=0.2)
    x = mesh.nodes @ np.diag([1.5, 0.8, 0.9]) + 0.004 * np.random.default_rng(4).normal(size=mesh.nodes.shape)
    assert TetMesh(x, mesh.tetrahedra).volumes.min() > 0.0
    return mesh, x


@pytest.mark.parametrize("strain", [0.0, 0.049, -0.049])
def test_nothing_flows_below_yield(strain, rotation):
    elastic, plasticity = plastic(TETRAHEDRON)
    before = elastic.gradients.copy()
    plasticity.relax(stretched(strain, rotation), 1.0)
    assert np.array_equal(elastic.gradients, before)
    assert np.array_equal(plasticity.plastic[0], np.eye(3))


@pytest.mark.parametrize("strain", [0.3, -0.3])
@pytest.mark.parametrize("swelling", [1.0, 1.1])
def test_a_held_bar_relaxes_exponentially_to_the_yield_strain(strain, swelling, rotation):
    x = stretched(strain, rotation, swelling)
    for h in (1e-3, 0.03, 0.2):
        elastic, plasticity = plastic(TETRAHEDRON)
        for step in range(1, 6):
            plasticity.relax(x, h)
            expected = YIELD + (abs(strain) - YIELD) * np.exp(-CREEP * h * step)
            f = elastic_gradients(elastic, x)
            assert strain_of(f)[0] == pytest.approx(expected, rel=1e-12)
            assert np.linalg.det(f[0]) == pytest.approx(swelling, rel=1e-13)
            assert strain_of(plasticity.plastic)[0] == pytest.approx(abs(strain) - expected, rel=1e-9)


def test_what_has_flowed_stays(rotation):
    """Without forces the element comes to rest with the plastic strain, of the rest volume."""
    elastic, plasticity = plastic(TETRAHEDRON)
    plasticity.relax(stretched(0.3, rotation), 100.0)
    rest = TETRAHEDRON.nodes @ plasticity.plastic[0].T
    assert elastic.energy(rest) < 1e-25 * 3000.0 and np.abs(elastic.force(rest)).max() < 1e-11 * 3000.0
    assert strain_of(plasticity.plastic)[0] == pytest.approx(0.3 - YIELD, rel=1e-12)


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.49])
def test_energy_falls_and_volume_stays_through_many_flows(lump, rotation, poisson):
    mesh, x = lump
    elastic, plasticity = plastic(mesh, poisson, yield_strain=0.02, most=0.3)
    random, flowed = np.random.default_rng(5), 0
    for step in range(200):
        moved = (x if step % 2 else mesh.nodes) @ rotation(0.1 * step).T + 0.003 * random.normal(size=x.shape)
        before = elastic.energy(moved)
        plasticity.relax(moved, 0.02)
        after = elastic.energy(moved)
        assert after <= before * (1.0 + 1e-14)
        flowed += after < before
        assert strain_of(plasticity.plastic).max() <= 0.3 * (1.0 + 1e-12)
    assert flowed == 200 and strain_of(plasticity.plastic).max() == pytest.approx(0.3, rel=1e-9)
    assert np.abs(np.linalg.det(plasticity.plastic) - 1.0).max() < 1e-12
    # the gradients are those of the mesh seen through Fₚ
    expected = np.einsum("eji,eaj->eai", np.linalg.inv(plasticity.plastic), shape_gradients(mesh)[0])
    assert np.abs(elastic.gradients - expected).max() < 1e-12 * np.abs(expected).max()


def test_force_and_stiffness_are_derivatives_after_a_flow(lump, check_derivatives):
    mesh, x = lump
    elastic, plasticity = plastic(mesh)
    plasticity.relax(x, 0.1)
    assert np.median(strain_of(plasticity.plastic)) > 0.2
    check_derivatives(elastic, x, 1e-6 * mesh.size)
    assert np.abs(elastic.force(x).sum(axis=0)).max() < 1e-10 * np.abs(elastic.force(x)).max()


def test_the_plastic_strain_is_bounded_in_size_and_may_turn(rotation):
    """At the bound more of the same changes nothing, and flow another way can still go on."""
    elastic, plasticity = plastic(TETRAHEDRON, most=0.1)
    x = stretched(0.6, rotation)
    for _ in range(20):
        plasticity.relax(x, 0.1)
        assert strain_of(plasticity.plastic)[0] <= 0.1 * (1.0 + 1e-12)
    assert strain_of(plasticity.plastic)[0] == pytest.approx(0.1, rel=1e-12)
    assert strain_of(elastic_gradients(elastic, x))[0] == pytest.approx(0.5, rel=1e-12)
    across = TETRAHEDRON.nodes @ np.diag([1 / 1.4, 1.4, 1.0])
    before = elastic.energy(across)
    for _ in range(100):
        plasticity.relax(across, 0.1)
    assert strain_of(plasticity.plastic)[0] == pytest.approx(0.1, rel=1e-9)
    assert elastic.energy(across) < before
    assert np.abs(np.linalg.svd(plasticity.plastic[0]).Vh[0]) == pytest.approx([0, 1, 0], abs=1e-9)


@pytest.mark.parametrize("stretches", [[1.2, 0.9, 0.0], [1.2, 0.9, -0.4], [1.2, 0.0, 0.0], [0.0, 0.0, 0.0]])
def test_collapsed_and_inverted_elements_do_not_flow(stretches, rotation):
    elastic, plasticity = plastic(TETRAHEDRON)
    plasticity.relax(TETRAHEDRON.nodes @ (rotation(1.0) @ np.diag(stretches)).T, 1.0)
    assert np.array_equal(plasticity.plastic[0], np.eye(3))
    assert np.isfinite(elastic.gradients).all()


def test_no_flow_where_it_would_cost_energy():
    """Below tr S − 3 ≈ −2μ/λ shear lowers the corotational energy, and flow, which takes it away, would raise it."""
    elastic, plasticity = plastic(TETRAHEDRON, poisson=0.49)
    mu, lam = (modulus[0] for modulus in elastic.moduli)
    for squeeze, flows in ((-0.5, True), (-2.0, False)):
        size = 1.0 + squeeze * 2.0 * mu / lam / 3.0
        x = TETRAHEDRON.nodes @ (size * np.diag(np.exp([0.1, -0.05, -0.05])))
        before = elastic.energy(x)
        plasticity.relax(x, 0.1)
        assert (elastic.energy(x) < before) == flows
        assert np.array_equal(plasticity.plastic[0], np.eye(3)) != flows
        plasticity.plastic[:], elastic.gradients[:] = np.eye(3), shape_gradients(TETRAHEDRON)[0]


@pytest.fixture(scope="module")
def particles(slab):
    return particles_of(slab, 0, surface=False)


def clay(particles, kind="one", max_strain=0.5):
    matching = ShapeMatching(mode="quadratic", alpha=0.5, beta=0.0, clusters=Clusters(kind=kind))
    matched = shape_matching.make(particles, matching)
    return matched, ShapePlasticity(Plasticity(yield_strain=0.05, creep_1_s=5.0, max_strain=max_strain), matched)


def shape_of(matched, x):
    """Sides of the goals' bounding box."""
    out = np.empty_like(x)
    matched.goals(x, out)
    return np.ptp(out, axis=0)


def test_nothing_flows_below_the_yield_strain(particles, rotation):
    matched, plasticity = clay(particles)
    frames = matched.frames.copy()
    for stretch in ([1.0, 1.0, 1.0], [1.049, 1.0, 0.951]):
        plasticity.relax(particles.nodes * stretch @ rotation(1.0).T, 10.0)
        assert np.array_equal(plasticity.plastic[0], np.eye(3))
    assert np.array_equal(matched.frames, frames)


def test_a_turned_body_creeps_as_an_unturned_one(particles, rotation):
    x = particles.nodes * [1.3, 1.0, 0.9]
    plastics = []
    for angle in (0.0, 1.0, 3.0):
        _, plasticity = clay(particles)
        plasticity.relax(x @ rotation(angle).T, 0.05)
        plastics.append(plasticity.plastic[0])
    assert np.abs(plastics[0] - np.eye(3)).max() > 0.01
    assert np.abs(np.diff(plastics, axis=0)).max() < 1e-12


def test_the_rest_shape_reaches_a_shape_of_the_same_volume(particles):
    """However long the steps: what is left of the strain is below the yield strain."""
    stretch = np.array([1.25, 1.0, 0.8])
    for h in (1e-3, 0.1, 100.0):
        matched, plasticity = clay(particles)
        for _ in range(max(20, int(2.0 / h))):
            plasticity.relax(particles.nodes * stretch, h)
        left = stretch * np.ptp(particles.nodes, axis=0) / shape_of(matched, particles.nodes * stretch)
        assert np.abs(left - 1.0).max() < 0.06
        assert np.linalg.det(plasticity.plastic[0]) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("kind", ["one", "tetrahedra"])
def test_strain_and_volume_stay_within_their_bounds_whatever_happens(particles, kind):
    random = np.random.default_rng(0)
    matched, plasticity = clay(particles, kind)
    for factor in ([9, 1, 1], [1, 1, 0], [0, 0, 0], [-1, 1, 1], [0.1, 0.1, 0.1], [3, 3, 0.1]):
        for _ in range(5):
            x = particles.nodes * np.array(factor, dtype=float) + 0.05 * random.normal(size=particles.nodes.shape)
            plasticity.relax(x, 0.1)
            assert np.linalg.norm(plasticity.plastic - np.eye(3), 2, axis=(1, 2)).max() <= 0.5 * (1 + 1e-8)
            assert np.abs(np.linalg.det(plasticity.plastic) - 1.0).max() < 1e-12
    assert np.isfinite(matched.frames).all()


def test_a_sheet_creeps_in_its_plane_only(particles, rotation):
    sheet = replace(particles, nodes=particles.nodes * [1.0, 1.0, 0.0] @ rotation(0.5).T)
    normal = rotation(0.5)[:, 2]
    _, plasticity = clay(sheet)
    x = particles.nodes * [1.2, 1.0, 0.0]
    plasticity.relax(x, 0.1)
    assert np.linalg.norm(plasticity.plastic[0] - np.eye(3)) > 0.02
    assert np.abs(plasticity.plastic[0] @ normal - normal).max() < 1e-12
    plasticity.relax(x * [1, 0, 0], 0.1)
    plasticity.relax(x * 0.0, 0.1)
    assert np.abs(plasticity.plastic[0] @ normal - normal).max() < 1e-12


def test_a_strain_that_turns_clusters_inside_out_is_refused(particles):
    with pytest.raises(InputError, match="max_strain"):
        clay(particles, max_strain=1.0)
