"""Springs, and what is made like them, against finite differences and the conservation laws."""

import numpy as np
import pytest

from palpate.bodies.body import nest
from palpate.bodies.material import Material
from palpate.bodies.particles import particles_of
from palpate.effects import body_springs, kelvin, maxwell, springs, volume_force
from palpate.effects.springs import Springs, rest_lengths, surface_springs, volume_springs
from palpate.errors import InputError
from palpate.solvers.system import System

SURFACE = {"structural_n_m": 20.0, "shear_n_m": 10.0, "bending_n_m": 5.0}


@pytest.fixture(scope="module")
def particles(slab):
    return particles_of(slab, 0, False)


@pytest.fixture(scope="module")
def systems(slab, particles):
    """One effect each; nothing is held."""
    surface = particles_of(slab, 0, True)
    elastic = springs.make(particles, {})
    relaxed = maxwell.make(particles, {"stiffness_ratio": 0.5, "relaxation_s": 0.1}, elastic)
    relaxed.relax(1.3 * particles.nodes, 0.05)
    made = {
        "springs": (particles, elastic),
        "surface springs": (surface, springs.make(surface, SURFACE)),
        "maxwell": (particles, relaxed),
        "volume": (particles, volume_force.make(particles, {"stiffness_n_m": 10.0}, elastic)),
        "body springs": (
            particles,
            body_springs.make(particles, {"stiffness_n_m": 3.0, "damping_ratio": 0.5}, elastic),
        ),
    }
    return {name: System(moved, {name: effect}) for name, (moved, effect) in made.items()}


NAMES = ("springs", "surface springs", "maxwell", "volume", "body springs")


def crumpled(nodes, rotation, amount):
    return nodes @ rotation(2.0).T + amount * 0.05 * np.random.default_rng(3).normal(size=nodes.shape)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("amount", [0.1, 1.0])
def test_force_and_stiffness_are_derivatives(systems, rotation, name, amount):
    system = systems[name]
    x = crumpled(system.particles.nodes, rotation, amount)
    force, stiffness, still = system.force(x, 0 * x), system.stiffness(x, False).toarray(), np.zeros_like(x)
    step = 1e-6 * system.particles.size
    for i in range(x.size):
        delta = np.zeros(x.size)
        delta[i] = step
        delta = delta.reshape(x.shape)
        slope = (system.energy(x + delta) - system.energy(x - delta)) / (2 * step)
        assert abs(force.flat[i] + slope) < 1e-7 * np.abs(force).max()
        slope = (system.force(x - delta, still) - system.force(x + delta, still)).ravel() / (2 * step)
        assert np.abs(stiffness[i] - slope).max() < 1e-6 * np.abs(stiffness).max()
    assert np.abs(stiffness - stiffness.T).max() < 1e-14 * np.abs(stiffness).max()


@pytest.mark.parametrize("name", NAMES)
def test_definite_stiffness_only_adds_what_makes_it_so(systems, rotation, name):
    """Exact minus definite is the clamped, negative part; a stretched body has none."""
    system = systems[name]
    x = 0.4 * crumpled(system.particles.nodes, rotation, 0.2)
    exact, definite = (system.stiffness(x, d).toarray() for d in (False, True))
    assert np.linalg.eigvalsh(definite)[0] > -1e-12 * np.abs(definite).max()
    assert np.linalg.eigvalsh(definite - exact)[0] > -1e-12 * np.abs(exact).max()
    assert (np.linalg.eigvalsh(exact)[0] < -0.1) == (name != "body springs")
    stretched = 1.5 * system.particles.nodes
    assert np.array_equal(system.stiffness(stretched, False).data, system.stiffness(stretched, True).data)


@pytest.mark.parametrize("name", ["springs", "surface springs", "maxwell", "volume"])
def test_forces_and_moments_balance(systems, rotation, name):
    system = systems[name]
    x = crumpled(system.particles.nodes, rotation, 0.5)
    force = system.force(x, 0 * x)
    assert np.abs(force.sum(axis=0)).max() < 1e-13 * np.abs(force).sum()
    assert np.abs(np.cross(x, force).sum(axis=0)).max() < 1e-13 * np.abs(force).sum() * system.particles.size


@pytest.mark.parametrize("name", ["springs", "surface springs", "volume"])
def test_turning_costs_nothing_and_stretching_is_resisted(systems, rotation, name):
    system = systems[name]
    nodes = system.particles.nodes
    turned = nodes @ rotation(1.0).T + [0.1, 0.2, 0.3]
    assert np.abs(system.force(turned, 0 * nodes)).max() < 1e-10
    for factor in (0.8, 1.2):
        x = factor * nodes
        back = system.force(x, 0 * nodes)
        assert np.vdot(back, x - x.mean(axis=0)) * (factor - 1.0) < 0.0


@pytest.mark.parametrize("name", NAMES)
def test_collapsed_bodies_stay_finite(systems, name):
    """All nodes at one point, on a line, at distances that underflow when squared."""
    system = systems[name]
    nodes = system.particles.nodes
    for x in (0 * nodes, nodes * [1.0, 0.0, 0.0], 1e-170 * nodes, 1e-160 * nodes):
        assert np.isfinite(system.energy(x))
        assert np.isfinite(system.force(x, 0 * x)).all()
        for definite in (False, True):
            assert np.isfinite(system.stiffness(x, definite).data).all()
        assert np.linalg.eigvalsh(system.stiffness(x, True).toarray())[0] > -1e-9


def test_a_surface_says_what_stiffness_it_lacks(slab):
    surface = particles_of(slab, 0, True)
    with pytest.raises(InputError, match=r"springs\.bending_n_m of slab is missing"):
        springs.make(surface, {"structural_n_m": 1.0, "shear_n_m": 1.0})
    with pytest.raises(InputError, match="have no stiffness"):
        springs.make(surface, dict.fromkeys(SURFACE, 0.0))
    only = springs.make(surface, {"structural_n_m": 1.0, "shear_n_m": 0.0, "bending_n_m": 0.0})
    assert 2 * len(only.pairs) == 3 * len(surface.triangles)


def test_volume_needs_tetrahedra(slab):
    with pytest.raises(InputError, match="volume, which needs tetrahedra"):
        volume_force.make(particles_of(slab, 0, True), {"stiffness_n_m": 1.0}, None)


def grid(n):
    """Triangles of an n × n grid of nodes, two a square, all diagonals alike."""
    corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()[:, None]
    return np.concatenate([corner + np.array(cut) for cut in ([0, n, n + 1], [0, n + 1, 1])])


def test_every_edge_of_a_solid_is_one_spring(slab):
    pairs, stiffness = volume_springs(particles_of(slab, 0, False))
    assert np.array_equal(pairs, slab.coarse.edges)
    assert (stiffness > 0).all()


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


def test_no_pair_is_a_spring_twice(slab):
    particles = particles_of(slab, 0, True)
    pairs = np.concatenate(list(surface_springs(particles.triangles, len(particles.nodes)).values()))
    assert len(np.unique(pairs, axis=0)) == len(pairs)
    assert (pairs[:, 0] < pairs[:, 1]).all()


def test_a_closed_tetrahedron_has_its_six_edges_only():
    kinds = surface_springs(np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]]), 4)
    assert [len(pairs) for pairs in kinds.values()] == [6, 0, 0]


def test_a_node_returns_as_a_damped_oscillator(slab):
    """Against x'' = −ω² x − 2 ratio ω x', whatever the node's mass, over half a period."""
    from palpate.solvers.symplectic_euler import SymplecticEuler
    from palpate.solvers.system import System

    particles, k, ratio = particles_of(slab, 0, False), 5.0, 0.3
    tie = body_springs.make(particles, {"stiffness_n_m": k, "damping_ratio": ratio}, None)
    integrator = SymplecticEuler(System(particles, {"body_springs": tie}))
    start = 0.01 * np.random.default_rng(0).normal(size=particles.nodes.shape)
    x, v = particles.nodes + start, 0 * start
    frequency = np.sqrt(k / particles.masses)[:, None]
    h, steps = float(1e-4 / frequency.max()), 30000
    for _ in range(steps):
        x, v = integrator.step(x, v, h)
    decay, swing = ratio * frequency * h * steps, np.sqrt(1 - ratio**2) * frequency * h * steps
    expected = start * np.exp(-decay) * (np.cos(swing) + ratio / np.sqrt(1 - ratio**2) * np.sin(swing))
    assert np.abs(x - particles.nodes - expected).max() < 3e-4 * np.abs(start).max()


def test_rest_is_where_nothing_pulls(slab):
    particles = particles_of(slab, 0, True)
    tie = body_springs.make(particles, {"stiffness_n_m": 5.0, "damping_ratio": 0.5}, None)
    force = np.zeros_like(particles.nodes)
    tie.add_force(particles.nodes, force.copy(), force)
    assert not force.any()
    assert tie.energy(particles.nodes) == 0.0
    assert tie.energy(particles.nodes + np.array([0.01, 0, 0])) == pytest.approx(
        0.5 * 5.0 * 1e-4 * len(particles.nodes)
    )


@pytest.mark.parametrize("name", ["kelvin", "body_springs"])
def test_force_is_minus_the_matrix_times_velocity(particles, rotation, name):
    elastic = springs.make(particles, {})
    damper = (
        kelvin.make(particles, {"ratio": 0.3}, elastic)
        if name == "kelvin"
        else body_springs.make(particles, {"stiffness_n_m": 3.0, "damping_ratio": 0.3}, elastic)
    )
    system = System(particles, {name: damper})
    random = np.random.default_rng(1)
    x = particles.nodes @ rotation(1.0).T + 0.02 * random.normal(size=particles.nodes.shape)
    v, matrix = random.normal(size=x.shape), system.damping(x).toarray()
    slowed = system.force(x, v) - system.force(x, 0 * v)
    assert np.abs(slowed.ravel() + matrix @ v.ravel()).max() < 1e-12 * np.abs(slowed).max()
    assert np.abs(matrix - matrix.T).max() < 1e-14 * np.abs(matrix).max()
    assert np.linalg.eigvalsh(matrix)[0] > -1e-12 * np.abs(matrix).max()


def test_turning_is_not_damped(particles):
    system = System(particles, {"kelvin": kelvin.make(particles, {"ratio": 1.0}, springs.make(particles, {}))})
    v = np.cross([1.0, 2.0, -1.0], particles.nodes) + np.array([0.3, 0.1, 0.2])
    assert np.abs(system.force(particles.nodes, v)).max() < 1e-12


def test_coincident_ends_are_not_damped(particles):
    system = System(particles, {"kelvin": kelvin.make(particles, {"ratio": 1.0}, springs.make(particles, {}))})
    nothing = np.zeros_like(particles.nodes)
    assert np.array_equal(system.force(nothing, particles.nodes), nothing)
    assert not system.damping(nothing).data.any()


def test_ratio_1_is_critical_damping():
    """μ² = 4 k m of the pair's reduced mass: the roots of z² + μ/m z + k/m coincide."""
    pair = Springs(np.array([[0, 1]]), np.array([7.0]), np.array([0.1]))
    damper = kelvin.Kelvin(pair, np.array([0.2, 0.3]), 1.0)
    assert damper.damping[0] ** 2 == pytest.approx(4 * 7.0 * (0.2 * 0.3 / 0.5), rel=1e-14)


@pytest.mark.parametrize("effect", [kelvin, maxwell])
def test_only_beside_springs(particles, effect):
    settings = {"ratio": 0.1, "stiffness_ratio": 0.5, "relaxation_s": 0.1}
    with pytest.raises(InputError, match="is not springs"):
        effect.make(particles, settings, object())


@pytest.fixture
def element(slab):
    particles = particles_of(slab, 0, False)
    elastic = springs.make(particles, {})
    return particles, elastic, maxwell.make(particles, {"stiffness_ratio": 0.5, "relaxation_s": 0.2}, elastic)


def test_stress_under_a_held_stretch_decays_as_exp(element):
    particles, elastic, maxwell_springs = element
    x = 1.1 * particles.nodes
    first = maxwell_springs.energy(x)
    assert first == pytest.approx(0.5 * elastic.energy(x), rel=1e-14)
    for step in range(1, 41):  # whatever the step: the decay is exact
        maxwell_springs.relax(x, 0.01)
        assert maxwell_springs.energy(x) == pytest.approx(first * np.exp(-2 * 0.01 * step / 0.2), rel=1e-10)


def test_no_step_makes_energy_and_long_ones_forget_all(element, rotation):
    particles, _, maxwell_springs = element
    random = np.random.default_rng(2)
    for h in (1e-6, 1e-2, 1.0, 1e6):
        x = particles.nodes + 0.05 * random.normal(size=particles.nodes.shape)
        before = maxwell_springs.energy(x)
        maxwell_springs.relax(x, h)
        assert 0.0 <= maxwell_springs.energy(x) < before
    assert maxwell_springs.energy(x) < 1e-25


def test_the_elastic_springs_keep_their_rest_lengths(element):
    particles, elastic, maxwell_springs = element
    rest = elastic.rest_m.copy()
    maxwell_springs.relax(2.0 * particles.nodes, 1.0)
    assert np.array_equal(elastic.rest_m, rest)
