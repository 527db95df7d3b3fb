"""Springs, and what is made like them, against finite differences and the conservation laws."""

import numpy as np
import pytest

from palpate.bodies.body import nest
from palpate.bodies.material import Material
from palpate.bodies.particles import particles_of
from palpate.effects import body_springs, kelvin, maxwell, springs, volume_preservation
from palpate.effects import settings as blocks
from palpate.effects.springs import Springs, rest_lengths, surface_springs, volume_springs
from palpate.solvers.system import System

SURFACE = blocks.Springs(structural_n_m=20.0, shear_n_m=10.0, bending_n_m=5.0)


@pytest.fixture(scope="module")
def particles(slab):
    return particles_of(slab, 0, False)


@pytest.fixture(scope="module")
def effects(slab, particles):
    """The particles and the one effect that moves them, by name."""
    surface = particles_of(slab, 0, True)
    elastic = springs.make(particles, None)
    relaxed = maxwell.make(particles, blocks.Maxwell(stiffness_ratio=0.5, relaxation_s=0.1), elastic)
    relaxed.relax(1.3 * particles.nodes, 0.05)
    ties = body_springs.make(particles, blocks.BodySprings(stiffness_n_m=3.0, damping_ratio=0.5), elastic)
    return {
        "springs": (particles, elastic),
        "surface springs": (surface, springs.make(surface, SURFACE)),
        "maxwell": (particles, relaxed),
        "volume": (particles, volume_preservation.make(particles, blocks.Volume(stiffness_n_m=10.0), elastic)),
        "body springs": (particles, ties),
    }


NAMES = ("springs", "surface springs", "maxwell", "volume", "body springs")


def crumpled(nodes, rotation, amount):
    return nodes @ rotation(2.0).T + amount * 0.05 * np.random.default_rng(3).normal(size=nodes.shape)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("amount", [0.1, 1.0])
def test_force_and_stiffness_are_derivatives(effects, rotation, check_derivatives, name, amount):
    moved, effect = effects[name]
    check_derivatives(effect, crumpled(moved.nodes, rotation, amount), 1e-6 * moved.size, symmetry=1e-14)


@pytest.mark.parametrize("name", NAMES)
def test_definite_stiffness_only_adds_what_makes_it_so(effects, rotation, stiffness_of, name):
    """Exact minus definite is the clamped, negative part; a stretched body has none."""
    moved, effect = effects[name]
    x = 0.4 * crumpled(moved.nodes, rotation, 0.2)
    exact, definite = (stiffness_of(effect, x, d) for d in (False, True))
    assert np.linalg.eigvalsh(definite)[0] > -1e-12 * np.abs(definite).max()
    assert np.linalg.eigvalsh(definite - exact)[0] > -1e-12 * np.abs(exact).max()
    assert (np.linalg.eigvalsh(exact)[0] < -0.1) == (name != "body springs")
    assert np.array_equal(stiffness_of(effect, 1.5 * moved.nodes), stiffness_of(effect, 1.5 * moved.nodes, True))


@pytest.mark.parametrize("name", NAMES[:-1])
def test_forces_balance_turning_is_free_and_stretching_is_resisted(effects, rotation, force_of, check_frame, name):
    moved, effect = effects[name]
    check_frame(effect, crumpled(moved.nodes, rotation, 0.5), moved.size, balance=1e-13)
    if name == "maxwell":  # it has another rest length
        return
    assert np.abs(force_of(effect, moved.nodes @ rotation(1.0).T + [0.1, 0.2, 0.3])).max() < 1e-10
    for factor in (0.8, 1.2):
        x = factor * moved.nodes
        assert np.vdot(force_of(effect, x), x - x.mean(axis=0)) * (factor - 1.0) < 0.0


@pytest.mark.parametrize("name", NAMES)
def test_collapsed_bodies_stay_finite(effects, force_of, stiffness_of, name):
    """All nodes at one point, on a line, at distances that underflow when squared."""
    moved, effect = effects[name]
    for x in (0 * moved.nodes, moved.nodes * [1.0, 0.0, 0.0], 1e-170 * moved.nodes, 1e-160 * moved.nodes):
        for value in (effect.energy(x), force_of(effect, x), stiffness_of(effect, x), stiffness_of(effect, x, True)):
            assert np.isfinite(value).all()
        assert np.linalg.eigvalsh(stiffness_of(effect, x, True))[0] > -1e-9


def test_a_kind_of_no_stiffness_is_left_out(slab):
    surface = particles_of(slab, 0, True)
    only = springs.make(surface, SURFACE.but(shear_n_m=0.0, bending_n_m=0.0))
    assert 2 * len(only.pairs) == 3 * len(surface.triangles)


def grid(n):
    """Triangles of an n × n grid of nodes, two a square, all diagonals alike."""
    corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()[:, None]
    return np.concatenate([corner + np.array(cut) for cut in ([0, n, n + 1], [0, n + 1, 1])])


def test_stiffness_is_paper_2_eq_5(box, soft):
    """And Σ k l² = 6 E V, which is 9λ + 6μ = 3λ + 12μ of the isotropic material with E and the Poisson ratio 1/4."""
    body = nest("cube", box([3, 3, 3], [0.1, 0.1, 0.1], jitter=0.2), 0, np.array([0]), soft)
    particles = particles_of(body, 0, False)
    pairs, stiffness = volume_springs(particles)
    lengths = rest_lengths(particles.nodes, pairs)
    quarter = Material(soft.young_pa, 0.25, soft.density_kg_m3)
    assert np.sum(stiffness * lengths**2) == pytest.approx(6 * soft.young_pa * 1e-3, rel=1e-12)
    assert 9 * quarter.lame_pa + 6 * quarter.shear_pa == pytest.approx(6 * soft.young_pa, rel=1e-12)
    assert 3 * quarter.lame_pa + 12 * quarter.shear_pa == pytest.approx(6 * soft.young_pa, rel=1e-12)
    around = [(np.isin(body.coarse.tetrahedra, pair).sum(axis=1) == 2) @ body.coarse.volumes for pair in pairs]
    assert stiffness == pytest.approx(soft.young_pa * np.array(around) / lengths**2, rel=1e-12)


def test_springs_of_a_grid_are_those_of_cloth():
    """Around an inner node of a regular grid: 6 neighbours, 6 across an edge, 6 straight ahead."""
    kinds = surface_springs(grid(7), 49)
    middle = 3 * 7 + 3
    found = {}
    for kind, pairs in kinds.items():
        others = pairs[(pairs == middle).any(axis=1)].sum(axis=1) - middle
        rows, columns = np.divmod(others, 7)
        found[kind] = {(int(r) - 3, int(c) - 3) for r, c in zip(rows, columns, strict=True)}
    assert found["structural"] == {(0, 1), (1, 0), (1, 1), (0, -1), (-1, 0), (-1, -1)}
    assert found["shear"] == {(1, -1), (1, 2), (2, 1), (-1, 1), (-1, -2), (-2, -1)}
    assert found["bending"] == {(2 * r, 2 * c) for r, c in found["structural"]}


def test_no_pair_is_a_spring_twice_and_a_closed_tetrahedron_has_its_six_edges_only(slab):
    particles = particles_of(slab, 0, True)
    pairs = np.concatenate(list(surface_springs(particles.triangles, len(particles.nodes)).values()))
    assert len(np.unique(pairs, axis=0)) == len(pairs)
    assert (pairs[:, 0] < pairs[:, 1]).all()
    kinds = surface_springs(np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]]), 4)
    assert [len(pairs) for pairs in kinds.values()] == [6, 0, 0]


@pytest.mark.parametrize(
    ("module", "asked"),
    [(kelvin, blocks.Kelvin(ratio=0.3)), (body_springs, blocks.BodySprings(stiffness_n_m=3.0, damping_ratio=0.3))],
)
def test_force_is_minus_the_matrix_times_velocity(particles, rotation, module, asked):
    system = System(particles, {"damping": module.make(particles, asked, springs.make(particles, None))})
    random = np.random.default_rng(1)
    x = particles.nodes @ rotation(1.0).T + 0.02 * random.normal(size=particles.nodes.shape)
    v, matrix = random.normal(size=x.shape), system.damping(x).toarray()
    slowed = system.force(x, v) - system.force(x, 0 * v)
    assert np.abs(slowed.ravel() + matrix @ v.ravel()).max() < 1e-12 * np.abs(slowed).max()
    assert np.abs(matrix - matrix.T).max() < 1e-14 * np.abs(matrix).max()
    assert np.linalg.eigvalsh(matrix)[0] > -1e-12 * np.abs(matrix).max()


def test_turning_and_coincident_ends_are_not_damped(particles):
    damper = kelvin.make(particles, blocks.Kelvin(ratio=1.0), springs.make(particles, None))
    system = System(particles, {"kelvin": damper})
    v = np.cross([1.0, 2.0, -1.0], particles.nodes) + np.array([0.3, 0.1, 0.2])
    assert np.abs(system.force(particles.nodes, v)).max() < 1e-12
    nothing = np.zeros_like(particles.nodes)
    assert np.array_equal(system.force(nothing, particles.nodes), nothing)
    assert not system.damping(nothing).data.any()


def test_ratio_1_is_critical_damping(particles):
    """μ² = 4 k m of the pair's reduced mass, or of the node's: the roots of z² + μ/m z + k/m coincide."""
    pair = Springs(np.array([[0, 1]]), np.array([7.0]), np.array([0.1]))
    damper = kelvin.Kelvin(pair, np.array([0.2, 0.3]), 1.0)
    assert damper.damping[0] ** 2 == pytest.approx(4 * 7.0 * (0.2 * 0.3 / 0.5), rel=1e-14)
    tie = body_springs.BodySprings(particles, 5.0, 1.0)
    assert tie.damping[:, 0] ** 2 == pytest.approx(4 * 5.0 * particles.masses, rel=1e-14)


@pytest.fixture
def element(slab):
    particles = particles_of(slab, 0, False)
    elastic = springs.make(particles, None)
    return particles, elastic, maxwell.make(particles, blocks.Maxwell(stiffness_ratio=0.5, relaxation_s=0.2), elastic)


def test_stress_under_a_held_stretch_decays_as_exp(element):
    particles, elastic, maxwell_springs = element
    x, rest = 1.1 * particles.nodes, elastic.rest_m.copy()
    first = maxwell_springs.energy(x)
    assert first == pytest.approx(0.5 * elastic.energy(x), rel=1e-14)
    for step in range(1, 41):  # whatever the step: the decay is exact
        maxwell_springs.relax(x, 0.01)
        assert maxwell_springs.energy(x) == pytest.approx(first * np.exp(-2 * 0.01 * step / 0.2), rel=1e-10)
    assert np.array_equal(elastic.rest_m, rest)
