"""The goal-position scheme: as stable as its formula says, from wherever a body starts."""

import math

import numpy as np
import pytest

from palpate.bodies.particles import particles_of
from palpate.effects import shape_matching
from palpate.effects.gravity import Gravity
from palpate.effects.held import Held
from palpate.effects.shape_matching import rotations
from palpate.effects.velocity_damping import VelocityDamping
from palpate.errors import InputError, NotConverged
from palpate.solvers import goal_position
from palpate.solvers.system import System

CLUSTERS = {
    "one": {"kind": "one"},
    "tetrahedra": {"kind": "tetrahedra"},
    "cubes": {"kind": "cubes", "edge_m": 0.09, "overlap": 0.5},
}
MODES = ["rigid", "linear", "quadratic"]
STARTS = ["point", "line", "plane", "inverted", "inside out", "random"]


@pytest.fixture(scope="module")
def particles(slab):
    return particles_of(slab, 0, surface=False)


def start(particles, kind):
    random, middle = np.random.default_rng(0), particles.nodes.mean(axis=0)
    if kind == "random":
        return middle + random.uniform(-10, 10, particles.nodes.shape) * particles.size
    squeeze = {"point": [0, 0, 0], "line": [1, 0, 0], "plane": [1, 1, 0], "inverted": [-1, 1, 1]}
    return middle + (particles.nodes - middle) * squeeze.get(kind, [-1, -1, -1])


def integrator(particles, mode, kind="one", alpha=0.5, **others):
    settings = {"mode": mode, "alpha": alpha, "beta": 0.5, "clusters": CLUSTERS[kind]}
    effects = {"shape_matching": shape_matching.make(particles, settings)} | others
    return goal_position.make(System(particles, effects), {})


def misfit(particles, x):
    """How far ``x`` is from the rest shape, moved and turned, relative to its size."""
    rest, now = particles.nodes - particles.nodes.mean(axis=0), x - x.mean(axis=0)
    turn = rotations((now.T @ rest)[None])[0]
    return np.abs(now - rest @ turn.T).max() / particles.size


@pytest.mark.parametrize("kind", CLUSTERS)
@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("h", [1e-4, 1e-2, 10.0])
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


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("alpha", [0.1, 0.5, 1.0])
def test_bounded_from_every_start_without_damping(particles, mode, alpha):
    """A start at a point is the hardest: it comes back there, where any rotation is as good."""
    for begin in STARTS:
        x = start(particles, begin)
        v, widest = np.zeros_like(x), (60.0 if alpha == 1.0 else 20.0) * max(particles.size, np.ptp(x, axis=0).max())
        stepper = integrator(particles, mode, "one", alpha)
        for _ in range(1000):
            x, v = stepper.step(x, v, 0.01)
            assert np.ptp(x, axis=0).max() < widest, begin


@pytest.mark.parametrize("kind", STARTS)
def test_alpha_one_is_there_at_once(particles, kind):
    x = start(particles, kind)
    x, _ = integrator(particles, "rigid", alpha=1.0).step(x, np.zeros_like(x), 10.0)
    assert misfit(particles, x) < 1e-13


@pytest.mark.parametrize("alpha", [0.01, 0.5, 1.0])
def test_a_small_swing_neither_grows_nor_decays(particles, alpha):
    """[[1, −α/h], [h, 1 − α]] keeps |u|² − α u·d + α |d|², of the step u = h v and the distance d to the goal."""
    h, middle = 0.02, particles.nodes.mean(axis=0)
    stepper, x, v = integrator(particles, "rigid", alpha=alpha), middle + 1.01 * (particles.nodes - middle), None
    v, kept = np.zeros_like(x), []
    for _ in range(2000):
        goals = np.empty_like(x)
        stepper._system.elastic.goals(x, goals)
        u, d = h * v, x - goals
        kept.append(particles.masses @ (u * u - alpha * u * d + alpha * d * d).sum(axis=1))
        x, v = stepper.step(x, v, h)
    assert np.ptp(kept) < 1e-9 * kept[0]


def test_the_period_is_that_of_the_eigenvalues(particles):
    """They are exp(± iφ) with cos φ = 1 − α/2."""
    alpha, middle = 0.2, particles.nodes.mean(axis=0)
    stepper, stretches = integrator(particles, "rigid", alpha=alpha), []
    x, v = middle + 1.01 * (particles.nodes - middle), np.zeros_like(particles.nodes)
    for _ in range(3000):
        x, v = stepper.step(x, v, 0.01)
        stretches.append(np.ptp(x[:, 0]) / np.ptp(particles.nodes[:, 0]) - 1.0)
    turns = np.flatnonzero(np.diff(np.signbit(stretches)))
    assert (turns[-1] - turns[0]) / (len(turns) - 1) == pytest.approx(np.pi / math.acos(1 - alpha / 2), rel=1e-3)


@pytest.mark.parametrize("kind", CLUSTERS)
def test_momentum_and_angular_momentum_are_kept(particles, kind):
    random = np.random.default_rng(1)
    x = particles.nodes + 0.1 * particles.size * random.normal(size=particles.nodes.shape)
    v = random.normal(size=x.shape)
    stepper, m = integrator(particles, "quadratic", kind), particles.masses[:, None]
    before = np.concatenate([(m * v).sum(axis=0), np.cross(x, m * v).sum(axis=0)])
    for _ in range(500):
        x, v = stepper.step(x, v, 0.01)
    after = np.concatenate([(m * v).sum(axis=0), np.cross(x, m * v).sum(axis=0)])
    assert np.abs(after - before).max() < 1e-10 * np.abs(before).max()


def test_weight_makes_it_fall_and_held_nodes_stay(particles):
    weight = Gravity(particles, np.array([0.0, 0.0, -9.81]))
    x, v = particles.nodes, np.zeros_like(particles.nodes)
    stepper = integrator(particles, "rigid", gravity=weight)
    for _ in range(10):
        x, v = stepper.step(x, v, 0.1)
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


def test_says_so_when_a_force_runs_away(particles):
    stepper, x, v = integrator(particles, "rigid", runaway=_Runaway()), particles.nodes, np.zeros_like(particles.nodes)
    with pytest.raises(NotConverged, match="grows"):
        for _ in range(10):
            x, v = stepper.step(x, v, 1.0)


def test_needs_goals(particles):
    with pytest.raises(InputError, match="shape_matching"):
        goal_position.make(System(particles, {"gravity": Gravity(particles, np.zeros(3))}), {})
