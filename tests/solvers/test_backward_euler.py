import math
from itertools import pairwise

import numpy as np
import pytest

from palpate.bodies.body import nest
from palpate.bodies.cylinder import cylinder
from palpate.bodies.material import Material
from palpate.bodies.particles import Particles, particles_of
from palpate.effects import gravity, held, linear_elements, velocity_damping
from palpate.effects.springs import Springs
from palpate.errors import InputError
from palpate.scenes.run_scene import STARTS, initial_positions
from palpate.solvers import backward_euler
from palpate.solvers.equilibrium import Equilibrium
from palpate.solvers.system import System


@pytest.fixture(scope="module")
def body():
    mesh = cylinder(0.2, 0.03)
    return nest("bar", mesh, 0, np.flatnonzero(mesh.nodes[:, 2] < 1e-6), Material(3000.0, 0.3, 1000.0))


def system(body, acceleration=(0.0, 0.0, 0.0), anchored=True, rate=0.0) -> System:
    particles = particles_of(body, 0, surface=False)
    effects = {"corotational": linear_elements.make(particles, {})}
    elastic = effects["corotational"]
    if any(acceleration):
        effects["gravity"] = gravity.make(particles, {"acceleration_m_s2": acceleration}, elastic)
    if anchored:
        effects["held"] = held.make(particles, {}, elastic)
    if rate:
        effects["velocity_damping"] = velocity_damping.make(particles, {"rate_1_s": rate}, elastic)
    return System(particles, effects)


def total(system, x, v) -> float:
    return system.energy(x) + 0.5 * float(np.vdot(system.masses[:, None] * v, v))


@pytest.mark.parametrize("start", [s for s in STARTS if s != "rest"])
@pytest.mark.parametrize("anchored", [True, False])
def test_no_step_makes_energy_from_any_start(body, start, anchored):
    moved = system(body, (1.0, 0.0, -2.0), anchored)
    integrator = backward_euler.make(moved, {"tolerance": 1e-8})
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
    none, nodes = np.empty((0, 3), dtype=int), np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    particles = Particles("spring", nodes, np.ones(2), np.array([0]), none, none, Material(1.0, 0.0, 1.0))
    spring = Springs(np.array([[0, 1]]), np.array([1.0]), np.array([1.0]))
    moved = System(particles, {"springs": spring, "held": held.make(particles, {}, spring)})
    integrator = backward_euler.make(moved, {"tolerance": 1e-10})
    x, v = np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0]]), np.array([[0.0, 0.0, 0.0], [0.0, 2.0, 0.0]])
    before, h = total(moved, x, v), 0.05
    x, v = integrator.step(x, v, h)
    plain = (x - np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0]])) / h
    assert total(moved, x, plain) > before + 1e-3
    assert total(moved, x, v) <= before + 1e-12
    np.testing.assert_allclose(np.cross(v[1], plain[1]), 0.0, atol=1e-12)


@pytest.mark.parametrize("h", [1e-4, 1.0, 100.0])
def test_any_step_is_stable(body, h):
    moved = system(body, (1.0, 0.0, 0.0))
    integrator = backward_euler.make(moved, {"tolerance": 1e-8})
    assert integrator.limit_s == math.inf
    x, v = moved.particles.nodes.copy(), np.zeros_like(moved.particles.nodes)
    before = 0.0
    for _ in range(10):
        x, v = integrator.step(x, v, h)
        after = total(moved, x, v)
        assert after <= before + 1e-12
        before = after


def test_comes_to_rest_at_the_static_equilibrium(body):
    moved = system(body, (1.0, 0.0, -1.0), rate=5.0)
    integrator = backward_euler.make(moved, {"tolerance": 1e-9})
    x, v = moved.particles.nodes.copy(), np.zeros_like(moved.particles.nodes)
    for _ in range(60):
        x, v = integrator.step(x, v, 0.5)
    load = np.outer(moved.masses, (1.0, 0.0, -1.0))
    still = Equilibrium(body, 0).solve(load, 1e-11).x
    assert np.abs(x - still).max() < 1e-6 * np.abs(still - moved.particles.nodes).max()


def test_small_steps_converge_to_first_order(body):
    ends = []
    for steps in (20, 40, 80, 160):
        moved = system(body, (0.2, 0.0, 0.0))
        integrator = backward_euler.make(moved, {"tolerance": 1e-10})
        x, v = moved.particles.nodes.copy(), np.zeros_like(moved.particles.nodes)
        for _ in range(steps):
            x, v = integrator.step(x, v, 0.2 / steps)
        ends.append(x)
    apart = [np.linalg.norm(b - a) for a, b in pairwise(ends)]
    orders = np.log2(np.array(apart[:-1]) / apart[1:])
    assert abs(orders[-1] - 1.0) < 0.1


def test_free_fall_is_exact_and_held_nodes_stay(body):
    moved = system(body, (0.0, 0.0, -9.81), anchored=False)
    integrator = backward_euler.make(moved, {"tolerance": 1e-8})
    x, v = moved.particles.nodes.copy(), np.zeros_like(moved.particles.nodes)
    for _ in range(10):
        x, v = integrator.step(x, v, 0.1)
    np.testing.assert_allclose(v, np.tile([0.0, 0.0, -9.81], (len(v), 1)), atol=1e-6)
    np.testing.assert_allclose(x - moved.particles.nodes, np.tile([0, 0, -9.81 * 0.01 * 55], (len(v), 1)), atol=1e-6)
    pinned = system(body, (0.0, 0.0, -9.81))
    x, _ = backward_euler.make(pinned, {"tolerance": 1e-8}).step(pinned.particles.nodes, np.ones_like(v), 0.1)
    assert np.array_equal(x[~pinned.free], pinned.particles.nodes[~pinned.free])


def test_needs_an_energy_to_minimise(body):
    particles = particles_of(body, 0, surface=False)
    goals = type("Goals", (), {"goals": None, "alpha": 0.5})()
    with pytest.raises(InputError, match="goal_position"):
        backward_euler.make(System(particles, {"shape_matching": goals}), {"tolerance": 1e-8})
