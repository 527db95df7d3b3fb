"""Viscous stress: relaxation and creep against closed solutions, its order in the step, and its energy."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import sqrtm

from palpate.bodies.body import nest
from palpate.bodies.material import NAMED, Material, Tissue
from palpate.bodies.mesh import TetMesh
from palpate.bodies.particles import particles_of
from palpate.effects import prony
from palpate.effects import settings as blocks
from palpate.effects.linear_elements import LinearElements
from palpate.effects.prony import SLOPE, WIDTH
from palpate.errors import NotConverged
from palpate.scenes.run_scene import run
from palpate.scenes.settings import Scene
from palpate.solvers import backward_euler, symplectic_euler
from palpate.solvers.system import System

TETRAHEDRON = TetMesh(np.array([[0.0, 0, 0], [1.1, 0.1, 0], [0.2, 0.9, 0.1], [0, 0.2, 1.3]]), np.array([[0, 1, 2, 3]]))
SHARES, TIMES = [0.3, 0.2], [0.1, 1.0]
LIGHT = Material(3000.0, 0.3, 0.01)
"""Without weight to speak of, so that a body is in equilibrium at every time."""


def beside(elastic, mesh, shares=SHARES, times=TIMES):
    return prony.make(mesh, blocks.Prony(shares=shares, times_s=times), elastic)


def made(mesh, material=LIGHT, shares=SHARES, times=TIMES):
    return beside(LinearElements(mesh, material), mesh, shares, times)


@pytest.fixture
def tetrahedron():
    return particles_of(nest("tet", TETRAHEDRON, 0, np.empty(0, int), LIGHT), 0, False)


@pytest.fixture(scope="module")
def block(box):
    mesh = box([1, 1, 1], [0.1, 0.1, 0.1], jitter=0.2)
    return particles_of(nest("block", mesh, 0, np.empty(0, int), LIGHT), 0, False)


@pytest.fixture(scope="module")
def heavy(box):
    mesh = box([2, 2, 2], [0.1, 0.1, 0.1], jitter=0.2)
    return particles_of(nest("heavy", mesh, 0, np.empty(0, int), Material(3000.0, 0.3, 1000.0)), 0, False)


@pytest.mark.parametrize("explicit", [False, True])
@pytest.mark.parametrize("h", [1e-3, 0.07, 2.0])
def test_a_held_strain_relaxes_exactly_in_steps_of_any_length(h, explicit, tetrahedron, rotation, force_of):
    """Large shear and stretch, while the body turns: the force turns and fades."""
    shape = TETRAHEDRON.nodes @ np.array([[1.3, 0.6, 0.0], [0.0, 0.8, 0.2], [0.1, 0.0, 1.1]]).T
    effect = made(tetrahedron)
    first, stored = force_of(effect, shape), effect.energy(shape)
    ratios, decays = effect.series.ratios, np.exp(-h / np.array(TIMES))
    for step in range(1, 6):
        x = shape @ rotation(0.4 * step).T
        if not explicit:
            effect.begin(shape, h)
            effect.end(x)
        effect.relax(x, h)
        left = (effect.series.modulus(h * step) - 1.0) / (effect.series.modulus(0.0) - 1.0)
        expected = left * first @ rotation(0.4 * step).T
        assert np.abs(force_of(effect, x) - expected).max() < 1e-12 * np.abs(first).max()
        energy = stored * (ratios @ decays ** (2 * step)) / ratios.sum()
        assert effect.energy(x) == pytest.approx(energy, rel=1e-10, abs=1e-14 * stored)


@pytest.mark.parametrize(
    ("shear", "law"), [(1e-4, "corotational"), (1e-3, "corotational"), *((1e-4, law) for law in NAMED)]
)
def test_the_shear_stress_relaxes_as_the_series_says(shear, law, tetrahedron, force_of):
    """That of body and branches together is G(t) times the shear, to second order in it, whatever the law."""
    x = TETRAHEDRON.nodes @ np.array([[1.0, shear, 0], [0, 1, 0], [0, 0, 1]]).T
    elastic = LinearElements(TETRAHEDRON, replace(LIGHT, law=law))
    effect = beside(elastic, tetrahedron)
    for step in range(1, 8):
        effect.relax(x, 0.1)
        force = force_of(elastic, x) + force_of(effect, x)
        stress = -np.einsum("ai,aj->ij", force, TETRAHEDRON.nodes) / elastic.volumes[0]
        expected = LIGHT.shear_pa * effect.series.modulus(0.1 * step) * shear
        assert stress[0, 1] == pytest.approx(expected, rel=max(1e-4, 2 * shear))


def test_each_region_has_branches_of_its_own_modulus(heavy):
    """Under a stretch that keeps the volume both energies have μ alone as their factor."""
    materials = heavy.material, replace(heavy.material, young_pa=3e4)
    elastic = LinearElements(heavy, Tissue(materials, np.arange(len(heavy.tetrahedra)) % 2))
    effect = beside(elastic, heavy, [0.5], [1.0])
    x = heavy.nodes @ np.diag([1.02, 0.99, 0.99])
    assert effect.energy(x) == pytest.approx(elastic.energy(x), rel=1e-3)
    x = np.where(np.isin(np.arange(len(x)), heavy.tetrahedra[1])[:, None], x, heavy.nodes)
    assert effect.energy(x) > 3 * made(heavy, heavy.material, [0.5], [1.0]).energy(x)


def strained_by(e, effect, h, steps, explicit):
    """The branches' strain (k,) along the axis of a bar that is drawn out by e(t), and fatter by as much."""
    axis = np.diag([1.0, -0.5, -0.5])
    for step in range(steps):
        x, y = (TETRAHEDRON.nodes @ (np.eye(3) + e(t) * axis) for t in (step * h, (step + 1) * h))
        if explicit:
            effect.energy(x)
        else:
            effect.begin(x, h)
            effect.end(y)
        effect.relax(y, h)
    return e(steps * h) - effect.inner[0, :, 0]


@pytest.mark.parametrize("explicit", [False, True])
def test_an_oscillating_strain_is_followed_to_second_order(explicit, tetrahedron):
    size, omega, end, times = 1e-4, 7.0, 0.8, np.array(TIMES)
    lag = omega * times
    exact = np.cos(omega * end) + lag * np.sin(omega * end) - np.exp(-end / times)
    exact *= size * lag / (1 + lag**2)
    errors = []
    for steps in (16, 32, 64):
        found = strained_by(lambda t: size * np.sin(omega * t), made(tetrahedron), end / steps, steps, explicit)
        errors.append(np.abs(found - exact).max() / size)
    assert errors[0] < 0.02
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1) and errors[1] / errors[2] == pytest.approx(4.0, rel=0.1)


class Pull:
    """A dead stress along x on both ends of a free block, which grows evenly over ``ramp`` [s] and then stays."""

    outer = True

    def __init__(self, particles, stress, ramp):
        self._ramp, self._part, self._load = ramp, 0.0, np.zeros_like(particles.nodes)
        normals = np.cross(*(particles.nodes[particles.triangles[:, i]] - particles.nodes[particles.triangles[:, 0]]
                             for i in (1, 2)))  # fmt: skip
        for triangle, normal in zip(particles.triangles, normals / 2, strict=True):
            if np.abs(normal[0]) > 0.99 * np.linalg.norm(normal):
                self._load[triangle, 0] += stress * normal[0] / 3

    def at(self, t):
        self._part = min(1.0, t / self._ramp)

    def add_force(self, x, v, force):
        force += self._part * self._load


def crept(particles, shares, times, h, steps, stress=0.6, ramp=0.1):
    """The stretch of a block under a dead stress minus 1, after each step; the block may turn as it likes."""
    (edge,) = np.argwhere(np.abs(particles.nodes - [0.1, 0.0, 0.0]).max(axis=1) < 1e-9)
    elastic = LinearElements(particles, LIGHT)
    effects = {"corotational": elastic, "pull": Pull(particles, stress, ramp)}
    effects["prony"] = beside(elastic, particles, shares, times)
    system = System(particles, effects)
    integrator = backward_euler.make(system, blocks.Stepping(step_s=h, duration_s=1.0))
    x, v, found = particles.nodes.copy(), np.zeros_like(particles.nodes), []
    for step in range(steps):
        system.at((step + 1) * h)
        x, v = integrator.step(x, v, h)
        system.relax(x, h)
        found.append(float(np.linalg.norm(x[edge] - x[0])) / 0.1 - 1.0)
    return np.array(found)


def standard_linear_solid(t, share, tau, stress=0.6, ramp=0.1):
    """Creep in tension, ε = σ (1/9K + J/3), with the shear compliance J = 1/G∞ − (1/G∞ − 1/G₀) exp(−t G∞/(τ G₀))."""
    mu, bulk = LIGHT.shear_pa, LIGHT.lame_pa + 2 / 3 * LIGHT.shear_pa
    slow, grown = tau / (1 - share), np.minimum(t, ramp)
    gone = slow * (np.exp(-(t - grown) / slow) - np.exp(-t / slow))
    return stress / ramp * (grown / (9 * bulk) + (grown - share * gone) / mu / 3)


@pytest.mark.parametrize(("share", "tau"), [(0.5, 0.2), (0.9, 0.05), (0.2, 0.55)])
def test_a_standard_linear_solid_creeps_as_the_closed_solution(share, tau, block):
    h = 0.005
    t = h * np.arange(1, 161)
    found, exact = crept(block, [share], [tau], h, 160), standard_linear_solid(t, share, tau)
    assert np.abs(found - exact).max() < 1e-4 * exact[-1]


def test_two_branches_creep_as_the_ordinary_differential_equation(block):
    """That of the shear strain under half of the stress, found by another solver."""
    mu, bulk = LIGHT.shear_pa, LIGHT.lame_pa + 2 / 3 * LIGHT.shear_pa
    ratios, stress, ramp = np.array([0.6, 0.4]), 0.6, 0.1

    def deviator(t, q):
        return (stress * min(1.0, t / ramp) / 3 / mu + ratios @ q) / (1 + ratios.sum())

    def rates(t, q):
        return (deviator(t, q) - q) / np.array(TIMES)

    first = solve_ivp(rates, (0, ramp), [0, 0], rtol=1e-10, atol=1e-16)
    then = solve_ivp(rates, (ramp, 0.8), first.y[:, -1], rtol=1e-10, atol=1e-16)
    exact = deviator(0.8, then.y[:, -1]) + stress / (9 * bulk)
    assert crept(block, SHARES, TIMES, 0.01, 80)[-1] == pytest.approx(exact, rel=1e-5)


def test_creep_is_of_second_order_in_the_step(block):
    exact = standard_linear_solid(0.8, 0.5, 0.2, ramp=0.4)
    found = [crept(block, [0.5], [0.2], 0.8 / steps, steps, ramp=0.4)[-1] for steps in (16, 32, 64)]
    errors = np.abs(np.array(found) - exact) / exact
    assert errors[0] < 2e-4
    assert (np.log2(errors[:-1] / errors[1:]) > 1.85).all()


@pytest.mark.parametrize("h", [1e-9, 0.01, 0.3, 1e9])
def test_branches_take_energy_from_every_step(h, heavy):
    """What is stored is at least the step's energy at its beginning, and at most that at its end."""
    effect, random = made(heavy), np.random.default_rng(1)
    x, taken = heavy.nodes, 0
    for _ in range(30):
        stored = effect.energy(x)
        effect.begin(x, h)
        before = effect.energy(x)
        x = heavy.nodes @ np.diag([1.4, 0.8, 1.1]) + 0.02 * random.normal(size=x.shape)
        after = effect.energy(x)
        effect.end(x)
        effect.relax(x, h)
        left, rounding = effect.energy(x), 1e-12 * (stored + after)
        assert before <= stored + rounding and left <= after + rounding
        taken += stored + after - before - left > 1e-10 * stored
    assert taken >= 29 or h < 1e-6


@pytest.mark.parametrize(("tau", "share"), [(1e-7, 0.99), (0.02, 0.5), (0.02, 0.99), (1e7, 0.5)])
def test_the_energy_of_a_free_body_falls_in_every_step_of_backward_euler(tau, share, heavy):
    elastic = LinearElements(heavy, heavy.material)
    effects = {"corotational": elastic, "prony": beside(elastic, heavy, [share], [tau])}
    system, h = System(heavy, effects), 0.02
    integrator = backward_euler.make(system, blocks.Stepping(step_s=h, duration_s=1.0))
    x = heavy.nodes @ np.diag([1.5, 0.8, 1.0]) + 0.005 * np.random.default_rng(2).normal(size=heavy.nodes.shape)
    v = np.cross([3.0, 2.0, 1.0], x)
    energies = []
    for _ in range(40):
        kinetic = 0.5 * float(np.vdot(heavy.masses[:, None] * v, v))
        energies.append(kinetic + system.energy(x))
        x, v = integrator.step(x, v, h)
        system.relax(x, h)
    assert np.diff(energies).max() <= 1e-9 * energies[0]
    assert energies[-1] < 0.5 * energies[0]


def test_explicit_steps_are_damped_and_limited_by_the_instantaneous_modulus(heavy):
    free = System(heavy, {"corotational": LinearElements(heavy, heavy.material)})
    elastic = LinearElements(heavy, heavy.material)
    effects = {"corotational": elastic, "prony": beside(elastic, heavy, [0.75], [0.02])}
    system = System(heavy, effects)
    integrator = symplectic_euler.make(system)
    assert 0.5 <= integrator.limit_s / symplectic_euler.make(free).limit_s < 0.8
    h, energies = 0.3 * integrator.limit_s, []
    x, v = heavy.nodes @ np.diag([1.1, 0.95, 1.0]), np.zeros_like(heavy.nodes)
    for _ in range(1500):
        energies.append(0.5 * float(np.vdot(heavy.masses[:, None] * v, v)) + system.energy(x))
        x, v = integrator.step(x, v, h)
        system.relax(x, h)
    assert max(energies) < 1.02 * energies[0]
    assert energies[-1] < 0.1 * energies[0]


def pressed(heavy, shares=SHARES, times_s=TIMES, **more):
    held = np.flatnonzero(heavy.nodes[:, 2] < 1e-9)
    load = blocks.Load(at_m=[0.05, 0.05, 0.1], force_n=[0.0, 0.0, -2.0], radius_m=0.06, press_s=0.05, hold_s=1.0)
    branches = blocks.Prony(shares=shares, times_s=times_s)
    given = {"step_s": 0.02, "duration_s": 0.2, "push": blocks.Push(loads=[load]), "prony": branches} | more
    body = nest("pressed", TetMesh(heavy.nodes, heavy.tetrahedra), 0, held, heavy.material)
    return run(Scene(body="pressed", **given), particles_of(body, 0, False)).motion


def test_runs_of_a_scene_know_nothing_of_each_other(heavy):
    first, second = pressed(heavy), pressed(heavy)
    assert np.array_equal(first.positions, second.positions)
    assert first.energy["prony_j"].iloc[0] < 1e-20 < 1e-6 < first.energy["prony_j"].iloc[-1]
    assert first.energy["gain_j"].iloc[-1] <= 1e-6 * first.energy["outer_work_j"].iloc[-1]


def moved(motion):
    return motion.positions[-1] - motion.rest


def test_branches_much_faster_than_the_step_are_not_felt_and_much_slower_ones_never_relax(heavy):
    """The latter are a body of more shear modulus, but for the width of the root's smoothing."""
    without = moved(pressed(heavy, prony=None))
    peak = np.abs(without).max()
    fast = moved(pressed(heavy, [0.5], [1e-9]))
    assert np.abs(fast - without).max() < 1e-6 * peak
    slow, slower = (moved(pressed(heavy, [0.5], [tau])) for tau in (1e6, 1e9))
    assert np.abs(slow - slower).max() < 1e-6 * peak
    assert 0.4 * peak < np.abs(slow).max() < 0.8 * peak


@pytest.mark.parametrize("start", ["inverted", "random", "plane"])
def test_a_disordered_start_ends_without_a_gain_of_energy(start, heavy):
    energy = pressed(heavy, [0.5], [0.05], start=start, duration_s=0.4, held=False).energy
    assert np.isfinite(energy["total_j"]).all()
    assert energy["gain_j"].max() <= 1e-9 * energy["total_j"].iloc[0]


def test_halved_steps_update_the_branches_half_by_half(heavy, monkeypatch):
    short = pressed(heavy, step_s=0.01)

    def refuse(step, *rest, minimise=backward_euler.minimise_by_newton):
        if step._h > 0.011:
            raise NotConverged("too long", [])
        return minimise(step, *rest)

    monkeypatch.setattr(backward_euler, "minimise_by_newton", refuse)
    halved = pressed(heavy)
    assert np.abs(moved(halved) - moved(short)).max() < 1e-9 * np.abs(moved(short)).max()
    assert halved.energy["prony_j"].iloc[-1] == pytest.approx(short.energy["prony_j"].iloc[-1], rel=1e-9)


STRETCHES = [[1, 1, 1], [1 + 1e-7, 1, 1], [1.3, 1.0, 0.7], [2.0, 2.0, 0.5], [1.5, 0.9, 0.0], [1.2, 1.0, -0.8]]
STRETCHES += [[1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [100.0, 1.0, 0.001], [1e4, 1e4, 1e4]]
H = 0.05


def strained(mesh, soft, x):
    """An effect in the middle of a step, whose branches have strains of their own."""
    prony, random = made(mesh, soft), np.random.default_rng(3)
    prony.inner = 0.1 * random.normal(size=prony.inner.shape)
    prony.inner[..., :3] -= prony.inner[..., :3].mean(axis=-1, keepdims=True)
    prony.begin(x, H)
    return prony


@pytest.fixture(scope="module")
def crumpled(box):
    """A block and positions: turned, squeezed and crumpled, some elements inverted."""
    mesh = box([2, 2, 2], [0.1, 0.1, 0.1], jitter=0.2)
    x = mesh.nodes @ np.diag([1.4, 0.7, 0.9]) + 0.02 * np.random.default_rng(4).normal(size=mesh.nodes.shape)
    assert TetMesh(x, mesh.tetrahedra).volumes.min() < 0.0
    return mesh, x


def full(e):
    return np.array([[e[0], e[5], e[4]], [e[5], e[1], e[3]], [e[4], e[3], e[2]]])


@pytest.mark.parametrize("stretches", STRETCHES)
def test_the_strain_is_the_deviator_of_the_root(stretches, soft, rotation):
    f = rotation(2.0) @ np.diag(stretches) @ rotation(1.0).T
    found = made(TETRAHEDRON, soft)._strains(TETRAHEDRON.nodes @ f.T)[0]
    root = SLOPE * np.real(sqrtm(f.T @ f + WIDTH**2 * np.eye(3)))
    expected = root - np.trace(root) / 3 * np.eye(3)
    bound = 1e-13 if max(stretches) < 3.0 else 1e-11
    assert np.abs(full(found) - expected).max() < bound * max(1.0, np.abs(root).max())


def test_force_and_stiffness_are_derivatives(crumpled, soft, check_derivatives):
    mesh, x = crumpled
    y = x + 0.002 * np.random.default_rng(5).normal(size=x.shape)
    check_derivatives(strained(mesh, soft, x), y, 1e-7, force_error=1e-6, symmetry=1e-14)


def test_the_definite_stiffness_has_no_negative_eigenvalue_and_is_exact_without_stress(crumpled, soft, stiffness_of):
    mesh, x = crumpled
    prony = strained(mesh, soft, x)
    exact, definite = stiffness_of(prony, x), stiffness_of(prony, x, definite=True)
    size = np.abs(definite).max()
    assert np.linalg.eigvalsh(exact)[0] < -0.01 * size and np.linalg.eigvalsh(definite)[0] > -1e-13 * size
    fresh = made(mesh, soft)
    at_rest = stiffness_of(fresh, mesh.nodes), stiffness_of(fresh, mesh.nodes, definite=True)
    assert np.abs(at_rest[0] - at_rest[1]).max() < 1e-13 * np.abs(at_rest[1]).max()


def test_a_rotation_changes_nothing_and_forces_balance(crumpled, soft, check_frame):
    mesh, x = crumpled
    check_frame(strained(mesh, soft, x), x + 0.01, mesh.size)


@pytest.mark.parametrize("share", [0.2, 0.9])
def test_at_once_the_body_is_corotational_with_a_larger_shear_modulus(crumpled, soft, share, force_of):
    """The bulk modulus stays; the elements of this check are not inverted, where the two strains differ."""
    mesh, _ = crumpled
    x = mesh.nodes @ np.diag([1.2, 0.9, 1.0]) + 0.002 * np.random.default_rng(4).normal(size=mesh.nodes.shape)
    mu, bulk = soft.shear_pa / (1 - share), soft.lame_pa + 2 / 3 * soft.shear_pa
    stiffer = type(soft)(9 * bulk * mu / (3 * bulk + mu), (3 * bulk - 2 * mu) / (6 * bulk + 2 * mu), 1000.0)
    together = force_of(LinearElements(mesh, soft), x) + force_of(made(mesh, soft, [share], [1.0]), x)
    expected = force_of(LinearElements(mesh, stiffer), x)
    assert np.abs(together - expected).max() < 1e-3 * np.abs(expected).max()


@pytest.mark.parametrize("stretches", STRETCHES)
def test_nothing_is_undefined_for_flat_inverted_and_extreme_elements(stretches, soft, rotation, force_of, stiffness_of):
    x = TETRAHEDRON.nodes @ (rotation(1.0) @ np.diag(stretches)).T
    prony = strained(TETRAHEDRON, soft, x)
    for values in (prony.energy(x), force_of(prony, x), stiffness_of(prony, x), stiffness_of(prony, x, True)):
        assert np.isfinite(values).all()
    prony.end(x)
    assert np.isfinite(prony.inner).all()
