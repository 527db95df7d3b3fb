"""BDF2 is of second order, also with damping that turns with the body, and begins with backward Euler's steps."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from palpate.bodies.body import nest
from palpate.bodies.box import box
from palpate.bodies.material import Material
from palpate.bodies.particles import Particles, particles_of
from palpate.effects import gravity, held, linear_elements, rayleigh
from palpate.effects.springs import Springs
from palpate.errors import InputError, NotConverged
from palpate.scenes.run_scene import run
from palpate.scenes.scene import Scene
from palpate.solvers import backward_euler, bdf2
from palpate.solvers.bdf2 import Bdf2
from palpate.solvers.system import System

FINGER = {"kind": "sphere", "name": "finger", "center_m": [0.025, 0.025, 0.0615], "radius_m": 0.01}
FINGER |= {"times_s": [0.0, 0.1, 0.2], "shifts_m": [[0, 0, 0], [0, 0, -0.008], [0, 0, 0.01]]}


@pytest.fixture(scope="module")
def bar():
    mesh = box([0.2, 0.05, 0.05], [6, 2, 2])
    body = nest("bar", mesh, 0, np.flatnonzero(mesh.nodes[:, 0] == 0.0), Material(3000.0, 0.3, 1000.0))
    return particles_of(body, 0, surface=False)


def bending(particles, stiffness_s) -> System:
    """A bar that bends far under its weight."""
    elastic = linear_elements.make(particles, {})
    effects = {"corotational": elastic, "held": held.make(particles, {}, elastic)}
    effects["gravity"] = gravity.make(particles, {"acceleration_m_s2": [0.0, 0.0, -0.8]}, elastic)
    effects["rayleigh"] = rayleigh.make(particles, {"mass_1_s": 1.0, "stiffness_s": stiffness_s}, elastic)
    return System(particles, effects)


def after(system, module, duration_s, steps) -> np.ndarray:
    integrator = module.make(system, {"tolerance": 1e-10})
    x, v = system.particles.nodes, np.zeros_like(system.particles.nodes)
    for _ in range(steps):
        x, v = integrator.step(x, v, duration_s / steps)
    return x


@pytest.mark.parametrize("stiffness_s", [0.0, 0.2])
def test_small_steps_converge_to_second_order_and_to_what_backward_euler_converges_to(bar, stiffness_s):
    ends = [after(bending(bar, stiffness_s), bdf2, 0.4, steps) for steps in (16, 32, 64, 128)]
    apart = [np.linalg.norm(b - a) for a, b in pairwise(ends)]
    orders = np.log2(np.array(apart[:-1]) / apart[1:])
    assert orders[-1] == pytest.approx(2.0, abs=0.25)
    longer, shorter = (after(bending(bar, stiffness_s), backward_euler, 0.4, steps) for steps in (128, 256))
    limit = np.abs(2.0 * shorter - longer - ends[-1]).max()
    assert limit < 2e-3 * np.abs(ends[-1] - bar.nodes).max() and 2.0 * limit < np.abs(shorter - ends[-1]).max()


def test_a_spring_swings_as_the_closed_solution_says():
    none, nodes = np.empty((0, 3), dtype=int), np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    particles = Particles("spring", nodes, np.ones(2), np.array([0]), none, none, Material(1.0, 0.0, 1.0))
    spring = Springs(np.array([[0, 1]]), np.array([4.0]), np.array([1.0]))
    errors = []
    for steps in (100, 200):
        system = System(particles, {"springs": spring, "held": held.make(particles, {}, spring)})
        integrator, x, v = Bdf2(system, 1e-9), np.array([[0.0, 0.0, 0.0], [1.1, 0.0, 0.0]]), np.zeros((2, 3))
        for _ in range(steps):
            x, v = integrator.step(x, v, 2.0 / steps)
        assert np.array_equal(x[0], nodes[0]) and not v[0].any()
        errors.append(abs(x[1, 0] - 1.0 - 0.1 * np.cos(4.0)))
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.2) and errors[1] < 1e-4


def test_a_state_that_is_not_its_own_begins_anew_with_a_step_of_first_order(bar):
    system = bending(bar, 0.1)
    integrator, first = Bdf2(system, 1e-10), backward_euler.BackwardEuler(bending(bar, 0.1), 1e-10)
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
    effects = ["corotational", "held", "contact", "rayleigh"]
    settings = {"contact": {"instruments": [FINGER]}, "rayleigh": {"mass_1_s": 1.0, "stiffness_s": 0.02}}
    scene = Scene("poked", effects, "bdf2", step_s=0.01, duration_s=0.1, settings=settings)
    touched = run(scene, particles_of(body, 0, surface=False)).motion
    other = run(replace(scene, integrator="backward_euler"), particles_of(body, 0, surface=False)).motion
    assert len(touched.contacts) and (touched.contacts["gap_m"] > 0.0).all()
    assert np.abs(touched.positions - other.positions).max() < 1e-3


def test_needs_an_energy_to_minimise(bar):
    goals = type("Goals", (), {"goals": None, "alpha": 0.5})()
    with pytest.raises(InputError, match="goal_position"):
        bdf2.make(System(bar, {"shape_matching": goals}), {"tolerance": 1e-8})
