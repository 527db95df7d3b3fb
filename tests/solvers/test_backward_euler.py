"""Backward Euler never makes energy; BDF2 is of second order, and begins with backward Euler's steps."""

import math
from itertools import pairwise

import numpy as np
import pytest

from palpate.bodies.body import nest
from palpate.bodies.material import Material
from palpate.bodies.particles import Particles, particles_of
from palpate.bodies.simple_shapes import box, cylinder
from palpate.effects import gravity, held, linear_elements, rayleigh, velocity_damping
from palpate.effects.settings import Ball, Contact, Gravity, Rayleigh, Stepping, VelocityDamping
from palpate.effects.springs import Springs
from palpate.errors import InputError, NotConverged
from palpate.scenes.run_scene import initial_positions, run
from palpate.scenes.settings import Scene
from palpate.solvers import backward_euler, bdf2
from palpate.solvers.bdf2 import Bdf2
from palpate.solvers.equilibrium import Equilibrium
from palpate.solvers.system import System


@pytest.fixture(scope="module")
def body():
    mesh = cylinder(0.2, 0.03)
    return nest("bar", mesh, 0, np.flatnonzero(mesh.nodes[:, 2] < 1e-6), Material(3000.0, 0.3, 1000.0))


def system(body, acceleration=(0.0, 0.0, 0.0), anchored=True, rate=0.0) -> System:
    particles = particles_of(body, 0, surface=False)
    effects = {"corotational": linear_elements.make(particles, None)}
    elastic = effects["corotational"]
    if any(acceleration):
        effects["gravity"] = gravity.make(particles, Gravity(acceleration_m_s2=acceleration), elastic)
    if anchored:
        effects["held"] = held.make(particles, None, elastic)
    if rate:
        effects["velocity_damping"] = velocity_damping.make(particles, VelocityDamping(rate_1_s=rate), elastic)
    return System(particles, effects)


def on_a_spring(stiffness) -> System:
    """Two masses of 1 kg on a spring of 1 m along x, the first of them held."""
    none, nodes = np.empty((0, 3), dtype=int), np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    particles = Particles("spring", nodes, np.ones(2), np.array([0]), none, none, Material(1.0, 0.0, 1.0))
    spring = Springs(np.array([[0, 1]]), np.array([stiffness]), np.array([1.0]))
    return System(particles, {"springs": spring, "held": held.make(particles, None, spring)})


def total(system, x, v) -> float:
    return system.energy(x) + 0.5 * float(np.vdot(system.masses[:, None] * v, v))


def at_rest(system) -> tuple[np.ndarray, np.ndarray]:
    return system.particles.nodes.copy(), np.zeros_like(system.particles.nodes)


def stepping(tolerance) -> Stepping:
    return Stepping(step_s=0.01, duration_s=1.0, tolerance=tolerance)


def after(system, module, duration_s, steps, tolerance=1e-10) -> tuple[np.ndarray, np.ndarray]:
    """Positions and velocities after so many steps from rest."""
    integrator, (x, v) = module.make(system, stepping(tolerance)), at_rest(system)
    for _ in range(steps):
        x, v = integrator.step(x, v, duration_s / steps)
    return x, v


@pytest.mark.parametrize(
    "start",
    ["inverted", "plane", "line", *(pytest.param(name, marks=pytest.mark.slow) for name in ("random", "point"))],
)
@pytest.mark.parametrize("anchored", [True, False])
def test_no_step_makes_energy_from_any_start(body, start, anchored):
    moved = system(body, (1.0, 0.0, -2.0), anchored)
    integrator = backward_euler.make(moved, stepping(1e-8))
    x = initial_positions(moved.particles, moved.free, start, seed=3)
    v, before = np.zeros_like(x), moved.energy(x)
    for _ in range(12):
        x, v = integrator.step(x, v, 0.02)
        after = total(moved, x, v)
        assert after <= before + 1e-10 * abs(before)
        before = after
    assert np.isfinite(x).all()


def test_energy_that_a_concave_potential_would_make_is_taken_back():
    """A mass that flies across a spring pressed to half its length: there the plain scheme speeds it up too much."""
    moved = on_a_spring(1.0)
    integrator = backward_euler.make(moved, stepping(1e-10))
    start, v = np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0]]), np.array([[0.0, 0.0, 0.0], [0.0, 2.0, 0.0]])
    before, h = total(moved, start, v), 0.05
    x, v = integrator.step(start, v, h)
    plain = (x - start) / h
    assert total(moved, x, plain) > before + 1e-3
    assert total(moved, x, v) <= before + 1e-12
    np.testing.assert_allclose(np.cross(v[1], plain[1]), 0.0, atol=1e-12)


@pytest.mark.parametrize("h", [1e-4, 1.0, 100.0])
def test_any_step_is_stable(body, h):
    moved = system(body, (1.0, 0.0, 0.0))
    integrator, before = backward_euler.make(moved, stepping(1e-8)), 0.0
    assert integrator.limit_s == math.inf
    x, v = at_rest(moved)
    for _ in range(10):
        x, v = integrator.step(x, v, h)
        after = total(moved, x, v)
        assert after <= before + 1e-12
        before = after


def test_comes_to_rest_at_the_static_equilibrium(body):
    moved = system(body, (1.0, 0.0, -1.0), rate=5.0)
    x, _ = after(moved, backward_euler, 30.0, 60, 1e-9)
    load = np.outer(moved.masses, (1.0, 0.0, -1.0))
    still = Equilibrium(body, 0).solve(load, 1e-11).x
    assert np.abs(x - still).max() < 1e-6 * np.abs(still - moved.particles.nodes).max()


def last_order(ends) -> float:
    """The order of convergence of positions at the end, each with half the step of the one before."""
    *_, first, second = (np.linalg.norm(b - a) for a, b in pairwise(ends))
    return float(np.log2(first / second))


def test_small_steps_converge_to_first_order(body):
    ends = [after(system(body, (0.2, 0.0, 0.0)), backward_euler, 0.2, steps)[0] for steps in (40, 80, 160)]
    assert abs(last_order(ends) - 1.0) < 0.1


def test_free_fall_is_exact_and_held_nodes_stay(body):
    moved = system(body, (0.0, 0.0, -9.81), anchored=False)
    x, v = after(moved, backward_euler, 1.0, 10, 1e-8)
    np.testing.assert_allclose(v, np.tile([0.0, 0.0, -9.81], (len(v), 1)), atol=1e-6)
    np.testing.assert_allclose(x - moved.particles.nodes, np.tile([0, 0, -9.81 * 0.01 * 55], (len(v), 1)), atol=1e-6)
    pinned = system(body, (0.0, 0.0, -9.81))
    x, _ = backward_euler.make(pinned, stepping(1e-8)).step(pinned.particles.nodes, np.ones_like(v), 0.1)
    assert np.array_equal(x[~pinned.free], pinned.particles.nodes[~pinned.free])


@pytest.fixture(scope="module")
def bar():
    mesh = box([0.2, 0.05, 0.05], [6, 2, 2])
    body = nest("bar", mesh, 0, np.flatnonzero(mesh.nodes[:, 0] == 0.0), Material(3000.0, 0.3, 1000.0))
    return particles_of(body, 0, surface=False)


def bending(particles, stiffness_s) -> System:
    """A bar that bends far under its weight."""
    elastic = linear_elements.make(particles, None)
    effects = {"corotational": elastic, "held": held.make(particles, None, elastic)}
    effects["gravity"] = gravity.make(particles, Gravity(acceleration_m_s2=[0.0, 0.0, -0.8]), elastic)
    effects["rayleigh"] = rayleigh.make(particles, Rayleigh(mass_1_s=1.0, stiffness_s=stiffness_s), elastic)
    return System(particles, effects)


@pytest.mark.parametrize("stiffness_s", [0.0, 0.2])
def test_small_steps_converge_to_second_order_and_to_what_backward_euler_converges_to(bar, stiffness_s):
    ends = [after(bending(bar, stiffness_s), bdf2, 0.4, steps)[0] for steps in (32, 64, 128)]
    assert last_order(ends) == pytest.approx(2.0, abs=0.25)
    longer, shorter = (after(bending(bar, stiffness_s), backward_euler, 0.4, steps)[0] for steps in (128, 256))
    limit = np.abs(2.0 * shorter - longer - ends[-1]).max()
    assert limit < 2e-3 * np.abs(ends[-1] - bar.nodes).max() and 2.0 * limit < np.abs(shorter - ends[-1]).max()


def test_a_spring_swings_as_the_closed_solution_says():
    errors = []
    for steps in (100, 200):
        integrator = Bdf2(on_a_spring(4.0), 1e-9)
        x, v = np.array([[0.0, 0.0, 0.0], [1.1, 0.0, 0.0]]), np.zeros((2, 3))
        for _ in range(steps):
            x, v = integrator.step(x, v, 2.0 / steps)
        assert not x[0].any() and not v[0].any()
        errors.append(abs(x[1, 0] - 1.0 - 0.1 * np.cos(4.0)))
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.2) and errors[1] < 1e-4


def test_a_state_that_is_not_its_own_begins_anew_with_a_step_of_first_order(bar):
    integrator, first = Bdf2(bending(bar, 0.1), 1e-10), backward_euler.BackwardEuler(bending(bar, 0.1), 1e-10)
    x, v = integrator.step(bar.nodes, np.zeros_like(bar.nodes), 0.05)
    assert np.array_equal(x, first.step(bar.nodes, np.zeros_like(bar.nodes), 0.05)[0])
    moved = x + 1e-3 * (bar.nodes[:, :1] > 0.1)
    assert np.allclose(integrator.step(moved, v, 0.05)[0], first.step(moved, v, 0.05)[0], rtol=0, atol=1e-12)
    x, v = integrator.step(*integrator.step(x, v, 0.05), 0.05)
    assert np.abs(integrator.step(x, v, 0.05)[0] - first.step(x, v, 0.05)[0]).max() > 1e-5


def test_a_step_that_is_not_found_is_one_of_first_order(bar, monkeypatch):
    integrator, first = Bdf2(bending(bar, 0.1), 1e-10), backward_euler.BackwardEuler(bending(bar, 0.1), 1e-10)
    x, v = integrator.step(bar.nodes, np.zeros_like(bar.nodes), 0.05)

    def refused(*_):
        raise NotConverged("not found", [])

    with monkeypatch.context() as patch:
        patch.setattr(Bdf2, "least", refused)
        with pytest.raises(NotConverged, match="not found"):  # nor are the halves of backward Euler
            integrator.step(x, v, 0.05)
    tries = []

    def once(self, *arguments):
        tries.append(1)
        return refused() if len(tries) == 1 else backward_euler.BackwardEuler.least(self, *arguments)

    monkeypatch.setattr(Bdf2, "least", once)
    assert np.allclose(integrator.step(x, v, 0.05)[0], first.step(x, v, 0.05)[0], rtol=0, atol=1e-12)


def test_nothing_passes_through_anything(bar):
    mesh = box([0.05, 0.05, 0.05], [2, 2, 2])
    body = nest("cube", mesh, 0, np.flatnonzero(mesh.nodes[:, 2] < 1e-9), Material(5000.0, 0.3, 100.0))
    path = {"times_s": [0.0, 0.1, 0.2], "shifts_m": [[0, 0, 0], [0, 0, -0.008], [0, 0, 0.01]]}
    contact = Contact(instruments=[Ball(center_m=[0.025, 0.025, 0.0615], radius_m=0.01, **path)])
    damping = Rayleigh(mass_1_s=1.0, stiffness_s=0.02)
    scene = Scene(body="cube", step_s=0.01, duration_s=0.1, contact=contact, rayleigh=damping)
    particles = particles_of(body, 0, surface=False)
    touched, other = (run(scene.but(integrator=name), particles).motion for name in ("bdf2", "backward_euler"))
    assert len(touched.contacts) and (touched.contacts["gap_m"] > 0.0).all()
    assert np.abs(touched.positions - other.positions).max() < 1e-3


@pytest.mark.parametrize("module", [backward_euler, bdf2])
def test_needs_an_energy_to_minimise(bar, module):
    goals = type("Goals", (), {"goals": None, "alpha": 0.5})()
    with pytest.raises(InputError, match="goal_position"):
        module.make(System(bar, {"shape_matching": goals}), stepping(1e-8))
