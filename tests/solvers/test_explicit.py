"""Explicit steps: what they keep, how exact they are, and when they blow up."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from palpate.bodies.material import Material
from palpate.bodies.particles import Particles, particles_of
from palpate.effects import kelvin, shape_matching, springs
from palpate.effects import settings as blocks
from palpate.effects.gravity import Gravity
from palpate.effects.held import Held
from palpate.effects.springs import Springs
from palpate.effects.velocity_damping import VelocityDamping
from palpate.errors import InputError, NotConverged
from palpate.linalg.polar import nearest_rotation
from palpate.solvers import goal_position, symplectic_euler
from palpate.solvers.system import System, stable_step

K, M1, M2, REST = 7.0, 0.2, 0.3, 0.1
REDUCED = M1 * M2 / (M1 + M2)


def pair(held=False, ratio=0.0):
    """Two masses on a spring along x, alone in space or with the first held."""
    nodes = np.array([[0.0, 0.0, 0.0], [REST, 0.0, 0.0]])
    none = np.empty((0, 3), dtype=np.int64)
    particles = Particles(
        "pair", nodes, np.array([M1, M2]), np.empty(0, int), none, np.empty((0, 4), int), Material(1.0, 0.0, 1.0)
    )
    effects = {"springs": Springs(np.array([[0, 1]]), np.array([K]), np.array([REST]))}
    if ratio:
        effects["kelvin"] = kelvin.make(particles, blocks.Kelvin(ratio=ratio), effects["springs"])
    if held:
        effects["held"] = SimpleNamespace(fixed=np.array([0]))
    return System(particles, effects)


@pytest.fixture(scope="module")
def particles(slab):
    return particles_of(slab, 0, surface=False)


def energy(system, x, v):
    return system.energy(x) + 0.5 * float(np.vdot(system.masses[:, None] * v, v))


def momenta(masses, x, v):
    """Momentum and angular momentum, (6,)."""
    moving = masses[:, None] * v
    return np.concatenate([moving.sum(axis=0), np.cross(x, moving).sum(axis=0)])


def after(stepper, x, v, h, steps):
    """Positions and velocities after so many steps."""
    for _ in range(steps):
        x, v = stepper.step(x, v, h)
    return x, v


def fastest(integrator, x, v, h, steps):
    """The largest speed along the way, which ends once it is far beyond that at the start."""
    largest = 0.0
    for _ in range(steps):
        x, v = integrator.step(x, v, h)
        largest = max(largest, float(np.abs(v).max()))
        if largest > 1e-3:
            break
    return largest


def test_energy_of_a_pair_does_not_drift_over_1e5_steps():
    system = pair()
    integrator = symplectic_euler.make(system)
    x, v = system.particles.nodes.copy(), np.array([[-0.05, 0.02, 0.0], [0.07, 0.0, -0.03]])  # it swings and turns
    h = 1e-3 * math.sqrt(REDUCED / K)
    first, worst = energy(system, x, v), 0.0
    for step in range(100_000):
        x, v = integrator.step(x, v, h)
        if step % 20 == 0:
            worst = max(worst, abs(energy(system, x, v) / first - 1.0))
    assert 1e-9 < worst < 1e-3  # it does swing


@pytest.mark.parametrize("held", [False, True])
def test_period_of_a_pair(held):
    """2π sqrt(m/k) with the reduced mass, or that of the one that moves; crossings of rest found by interpolation."""
    system = pair(held)
    integrator = symplectic_euler.make(system)
    expected = 2 * math.pi * math.sqrt((M2 if held else REDUCED) / K)
    x, v = system.particles.nodes.copy(), np.array([[0.0, 0.0, 0.0], [0.01, 0.0, 0.0]])
    h, crossings, last = expected / 500, [], 0.0
    for step in range(1, 5300):
        x, v = integrator.step(x, v, h)
        stretch = x[1, 0] - x[0, 0] - REST
        if last < 0.0 <= stretch:
            crossings.append((step - stretch / (stretch - last)) * h)
        last = stretch
    periods = np.diff(crossings)
    assert len(periods) >= 8
    assert periods.mean() == pytest.approx(expected, rel=1e-4)


def springy(particles, ratio) -> System:
    """Springs with Kelvin's damping."""
    elastic = springs.make(particles, None)
    damper = kelvin.make(particles, blocks.Kelvin(ratio=ratio), elastic)
    return System(particles, {"springs": elastic, "kelvin": damper})


def test_momentum_and_angular_momentum_are_kept(particles, rotation):
    integrator = symplectic_euler.make(springy(particles, 0.05))
    random = np.random.default_rng(4)
    x, v = particles.nodes @ rotation(1.0).T, np.cross([1.0, -2.0, 3.0], particles.nodes) + np.array([0.3, 0.2, 0.1])
    x, v = x + 0.002 * random.normal(size=x.shape), v + 0.1 * random.normal(size=x.shape)
    before = momenta(particles.masses, x, v)
    x, v = after(integrator, x, v, 0.3 * integrator.limit_s, 2000)
    change = np.abs(momenta(particles.masses, x, v) - before)
    for part in (slice(3), slice(3, 6)):
        assert change[part].max() < 1e-10 * np.linalg.norm(before[part])


@pytest.mark.parametrize("ratio", [0.0, 0.2, 1.0, 5.0])
def test_limit_of_a_pair_is_exact(ratio):
    """Just below it the motion stays, just above it grows without end."""
    system = pair(held=True, ratio=ratio)
    integrator = symplectic_euler.make(system)
    rate = 2 * ratio * math.sqrt(K * REDUCED) / M2
    assert integrator.limit_s**2 * K / M2 + 2 * integrator.limit_s * rate == pytest.approx(4.0, rel=1e-12)
    for part, grows in ((0.99, False), (1.01, True)):
        v = np.array([[0.0, 0.0, 0.0], [1e-9, 0.0, 0.0]])
        assert (fastest(integrator, system.particles.nodes, v, part * integrator.limit_s, 2000) > 1e-5) == grows


def test_limit_by_iteration_is_that_of_all_eigenvalues_and_without_stiffness_there_is_none(particles, monkeypatch):
    system = springy(particles, 0.2)
    iterated = stable_step(system)
    assert iterated == stable_step(system)
    monkeypatch.setattr("palpate.solvers.system.DENSE_UNKNOWNS", 10_000)
    assert iterated == pytest.approx(stable_step(system), rel=1e-5)
    assert stable_step(System(particles, {"held": SimpleNamespace(fixed=np.array([0]))})) == math.inf


CLUSTERS = {
    "one": blocks.Clusters(kind="one"),
    "tetrahedra": blocks.Clusters(kind="tetrahedra"),
    "cubes": blocks.Clusters(kind="cubes", edge_m=0.09),
}
MODES = ["rigid", "linear", "quadratic"]
STARTS = ["point", "line", "plane", "inverted", "inside out", "random"]


def start(particles, kind):
    random, middle = np.random.default_rng(0), particles.nodes.mean(axis=0)
    if kind == "random":
        return middle + random.uniform(-10, 10, particles.nodes.shape) * particles.size
    squeeze = {"point": [0, 0, 0], "line": [1, 0, 0], "plane": [1, 1, 0], "inverted": [-1, 1, 1]}
    return middle + (particles.nodes - middle) * squeeze.get(kind, [-1, -1, -1])


def integrator(particles, mode, kind="one", alpha=0.5, **others):
    matching = blocks.ShapeMatching(mode=mode, alpha=alpha, beta=0.5, clusters=CLUSTERS[kind])
    effects = {"shape_matching": shape_matching.make(particles, matching)} | others
    return goal_position.make(System(particles, effects))


def misfit(particles, x):
    """How far ``x`` is from the rest shape, moved and turned, relative to its size."""
    rest, now = particles.nodes - particles.nodes.mean(axis=0), x - x.mean(axis=0)
    turn = nearest_rotation(now.T @ rest)
    return np.abs(now - rest @ turn.T).max() / particles.size


@pytest.mark.parametrize("kind", CLUSTERS)
@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("h", [1e-4, 10.0])
def test_stable_and_back_to_its_shape_from_every_start(particles, mode, kind, h):
    """With a damping of a twentieth a step, however long a step is."""
    damping = VelocityDamping(particles.masses, 0.05 / h)
    for begin in STARTS:
        x = start(particles, begin)
        v, widest = np.zeros_like(x), 3.0 * max(particles.size, np.ptp(x, axis=0).max())
        stepper = integrator(particles, mode, kind, 0.5, velocity_damping=damping)
        for _ in range(1200):
            x, v = stepper.step(x, v, h)
            assert np.ptp(x, axis=0).max() < widest
        assert misfit(particles, x) < 1e-9, begin


@pytest.mark.parametrize("alpha", [0.01, 0.5, 1.0])
def test_a_small_swing_neither_grows_nor_decays(particles, alpha):
    """[[1, −α/h], [h, 1 − α]] keeps |u|² − α u·d + α |d|², of the step u = h v and the distance d to the goal."""
    h, middle, kept = 0.02, particles.nodes.mean(axis=0), []
    stepper, x = integrator(particles, "rigid", alpha=alpha), middle + 1.01 * (particles.nodes - middle)
    v = np.zeros_like(x)
    for _ in range(2000):
        goals = np.empty_like(x)
        stepper._system.elastic.goals(x, goals)
        u, d = h * v, x - goals
        kept.append(particles.masses @ (u * u - alpha * u * d + alpha * d * d).sum(axis=1))
        x, v = stepper.step(x, v, h)
    assert np.ptp(kept) < 1e-9 * kept[0]


@pytest.mark.parametrize("kind", CLUSTERS)
def test_momentum_and_angular_momentum_are_kept_of_goal_position(particles, kind):
    random = np.random.default_rng(1)
    x = particles.nodes + 0.1 * particles.size * random.normal(size=particles.nodes.shape)
    v = random.normal(size=x.shape)
    stepper, before = integrator(particles, "quadratic", kind), momenta(particles.masses, x, v)
    x, v = after(stepper, x, v, 0.01, 500)
    assert np.abs(momenta(particles.masses, x, v) - before).max() < 1e-10 * np.abs(before).max()


def test_weight_makes_it_fall_and_held_nodes_stay(particles):
    weight = Gravity(particles, np.array([0.0, 0.0, -9.81]))
    x, v = after(integrator(particles, "rigid", gravity=weight), particles.nodes, 0.0 * particles.nodes, 0.1, 10)
    assert np.abs(v - [0.0, 0.0, -9.81]).max() < 1e-12
    fixed = np.array([0, 3, 5])
    stepper = integrator(particles, "rigid", gravity=weight, held=Held(fixed))
    for _ in range(10):
        x, v = stepper.step(x, np.ones_like(v), 0.1)
        assert np.array_equal(v[fixed], np.zeros((3, 3)))
    assert np.abs(x[fixed] - (particles.nodes[fixed] - [0, 0, 9.81 * 0.55])).max() < 1e-12


def test_a_step_leaves_what_it_was_given_alone(particles):
    x, v = start(particles, "inverted"), np.ones_like(particles.nodes)
    before = x.copy()
    integrator(particles, "linear").step(x, v, 0.01)
    assert np.array_equal(x, before) and np.array_equal(v, np.ones_like(v))


class _Runaway:
    def add_force(self, x, v, force):
        force[0] += np.inf


def test_says_so_when_a_force_runs_away_or_there_are_no_goals(particles):
    stepper = integrator(particles, "rigid", runaway=_Runaway())
    with pytest.raises(NotConverged, match="grows"):
        after(stepper, particles.nodes, np.zeros_like(particles.nodes), 1.0, 10)
    with pytest.raises(InputError, match="shape_matching"):
        goal_position.make(System(particles, {"gravity": Gravity(particles, np.zeros(3))}))
