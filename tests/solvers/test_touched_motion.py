"""Quadratic elements under moved instruments, against statics, another integrator, Coulomb's law and sums of forces."""

import numpy as np
import pytest

from palpate.bodies.body import Body, nest
from palpate.bodies.material import Material
from palpate.bodies.refinement import finer
from palpate.collision.contact.instrument_contact import InstrumentContact
from palpate.collision.contact.obstacles import Obstacle
from palpate.effects.settings import Gravity, Loads, Rayleigh
from palpate.solvers.indentation import Indentation, contact_points
from palpate.solvers.quadratic_motion import QuadraticMotion
from palpate.solvers.touched_motion import TouchedMotion

TOP = np.array([0.04, 0.04, 0.03])
DOWN = np.array([0.0, 0.0, -1.0])
DEPTH, PRESS_S, RADIUS = 0.003, 0.05, 0.02
DAMPED = Rayleigh(mass_1_s=100.0, stiffness_s=0.003)


@pytest.fixture(scope="module")
def slab(box) -> Body:
    mesh = box([4, 4, 2], [0.08, 0.08, 0.03])
    return finer(nest("slab", mesh, 0, np.flatnonzero(mesh.nodes[:, 2] == 0.0), Material(10000.0, 0.3, 1000.0)), 1)


def near(at: np.ndarray) -> np.ndarray:
    return at[:, 2] == TOP[2]


def sliding(way: float = 0.0, radius: float = RADIUS, above: float = 0.0) -> Obstacle:
    """Return a ball that is pressed in until PRESS_S, and then moves ``way`` [m/s] along x."""
    down, along = DEPTH * RADIUS / radius * DOWN, np.array([way * (1.0 - PRESS_S), 0.0, 0.0])
    shifts = np.array([0.0 * down, down, down + along])
    centre = TOP - (radius + above) * DOWN
    return Obstacle("", "sphere", centre[None], np.zeros((1, 3)), radius, np.array([0.0, PRESS_S, 1.0]), shifts)


def pressed(slab: Body, friction: float = 0.0, way: float = 0.0, radius: float = RADIUS):
    """Return the motion of the slab under the ball."""
    points = contact_points(slab.levels[0], 2, slab.material.young_pa, near)
    return TouchedMotion(slab, 0, Loads(), DAMPED, points, InstrumentContact([sliding(way, radius)], friction, 1e-3))


def ends(motion: TouchedMotion, duration_s: float, count: int, tolerance: float = 1e-5) -> list:
    return list(motion.touched_steps(duration_s / count, count, tolerance))


@pytest.mark.parametrize(("level", "most"), [(0, 0.02), pytest.param(1, 0.01, marks=pytest.mark.slow)])
def test_what_is_pressed_and_left_alone_comes_to_the_static_equilibrium(slab, level, most):
    """There multipliers end the overlap, which here remains, a part of what elements cannot follow."""
    body = finer(slab, 1) if level else slab
    points = contact_points(body.levels[level], 2, body.material.young_pa, near)
    *_, last = ends(
        TouchedMotion(body, level, Loads(), DAMPED, points, InstrumentContact([sliding()], 0.0, 1e-3)), 0.3, 12, 1e-4
    )
    (rest,) = Indentation(body, level, 2, points, [sliding().pose(0.0)]).push(DOWN, [DEPTH], 1e-5)
    assert np.linalg.norm(last.forces[0] - rest.force) < most * np.linalg.norm(rest.force)
    surface = body.levels[level].surface
    moved = (rest.x - body.levels[level + 1].nodes)[surface]
    assert np.sqrt(np.mean((last.x - rest.x)[surface] ** 2)) < 0.01 * np.abs(moved).max()


def test_the_anchors_bear_what_the_instrument_presses(slab):
    motion = pressed(slab)
    *_, last = ends(motion, 0.4, 30)
    motion.load = np.zeros_like(last.x)
    elastic = motion.elements.force(last.x)
    assert -elastic[motion.held].sum(axis=0) == pytest.approx(-last.forces[0], abs=1e-3 * abs(last.forces[0, 2]))


def test_steps_that_touch_nothing_are_those_of_another_rule_to_their_order(slab):
    """SDIRK2 and the midpoint rule under weight come nearer to each other by four with each halving of the step."""
    loads, off = Loads(gravity=Gravity(acceleration_m_s2=[3.0, 0.0, -5.0])), []
    light = Rayleigh(mass_1_s=2.0, stiffness_s=0.001)
    other, points = QuadraticMotion(slab, 0, loads, light), contact_points(slab.levels[0], 2, 1e4, near)
    mine = TouchedMotion(slab, 0, loads, light, points, InstrumentContact([sliding(above=0.24)], 0.3, 1e-3))
    for count in (16, 32):
        *_, (x, *_) = ends(mine, 0.06, count, 1e-7)
        *_, (theirs, *_) = other.steps(0.06 / count, count, 1e-7)
        off.append(np.linalg.norm(x - theirs) / np.linalg.norm(theirs - slab.levels[1].nodes))
    assert off[1] < 0.02 and off[0] > 3.2 * off[1]


@pytest.mark.parametrize(("count", "most"), [(20, 7e-3), pytest.param(80, 1e-3, marks=pytest.mark.slow)])
def test_the_work_of_the_instrument_is_kept_damped_or_rubbed_away(slab, count, most):
    """To −0.5 % in 20 steps and to 0.05 % in 80; not evenly between, as single points come to touch."""
    motion = pressed(slab, 0.4, 0.1)
    reached = ends(motion, 0.1, count)
    work, lost = (sum(getattr(each, name) for each in reached) for name in ("work_j", "lost_j"))
    kept = motion.total_energy(reached[-1].x, reached[-1].v)
    assert work - lost - kept == pytest.approx(0.0, abs=most * work) and 0.2 * work < lost < work


def test_what_slides_is_dragged_by_the_coefficient_of_friction(slab):
    """Under a ball so large that its surface is flat all points slide along x."""
    free, rough = (ends(pressed(slab, mu, 0.1, 0.2), 0.15, 40)[-1].forces[0] for mu in (0.0, 0.2))
    assert rough[0] - free[0] == pytest.approx(0.2 * abs(rough[2]), rel=0.05)
    assert abs(rough[1]) < 0.02 * rough[0]


@pytest.mark.slow
def test_what_is_pressed_and_left_alone_sticks_below_the_limit(slab):
    """Surfaces that would slide out from under the ball are held back, so that it is felt harder."""
    free, rough = (ends(pressed(slab, mu), 0.15, 20)[-1] for mu in (0.0, 0.9))
    assert 1.0 < rough.forces[0, 2] / free.forces[0, 2] < 1.2
