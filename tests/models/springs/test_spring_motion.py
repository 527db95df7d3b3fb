"""The fast steps are those of the effects under symplectic Euler."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.effects.held import Held
from palpate.effects.kelvin import Kelvin
from palpate.effects.springs import Springs
from palpate.effects.volume_force import Volume
from palpate.errors import InputError, NotConverged
from palpate.models.springs.spring_motion import ALONE, advance, constants, dampings, simulate, stiffnesses, trajectory
from palpate.solvers.symplectic_euler import SymplecticEuler
from palpate.solvers.system import System

VOLUME = 0.5


class Load:
    outer = True

    def __init__(self, node, force):
        self.node, self.force = node, force

    def add_force(self, x, v, force):
        force[self.node] += self.force


def integrator(cube, young, load):
    """Step by symplectic Euler with the same springs, dampers, volume force and load, from effects."""
    model = cube.model
    springs = Springs(model.pairs, stiffnesses(model, young), model.rest_m)
    effects = {
        "springs": springs,
        "kelvin": Kelvin(springs, model.masses, cube.settings.damping_ratio),
        "volume": Volume(cube.particles, VOLUME),
        "held": Held(model.held),
        "push": load,
    }
    return SymplecticEuler(System(cube.particles, effects))


@pytest.fixture
def young():
    return np.random.default_rng(3).uniform(500.0, 3000.0, 120)


def test_one_step_is_that_of_the_effects(cube, young):
    settings = replace(cube.settings, volume_n_m=VOLUME)
    random = np.random.default_rng(0)
    x = cube.model.nodes + random.normal(0, 2e-4, (120, 3))
    v = random.normal(0, 0.02, (120, 3))
    v[cube.model.held] = 0.0
    *network, load, factors, h = constants(cube.model, cube.press, settings)
    expected = integrator(cube, young, Load(slice(None), factors[20] * load)).step(x, v, h)
    k = stiffnesses(cube.model, young)[:, None]
    new_x, new_v = x.copy(), v.copy()
    damping = dampings(cube.model, k[:, 0], settings.damping_ratio)[:, None]
    advance(new_x, new_v, np.empty_like(x), np.empty(12), k, damping, *network[1:], load, factors[20], h, ALONE)
    assert new_v == pytest.approx(expected[1], rel=1e-12, abs=1e-14)
    assert new_x == pytest.approx(expected[0], rel=1e-12, abs=1e-16)


def test_a_motion_is_that_of_the_effects(cube, young):
    settings = replace(cube.settings, volume_n_m=VOLUME)
    load = Load(cube.press.node, None)
    steps = integrator(cube, young, load)
    x, v = cube.model.nodes, np.zeros((120, 3))
    for factor in cube.press.factors(settings.step_s, settings.steps):
        load.force = factor * cube.press.force_n
        x, v = steps.step(x, v, settings.step_s)
    positions, velocities = simulate(cube.model, young, cube.press, settings)
    assert positions[-1] == pytest.approx(settings.keys.of(x), rel=1e-10)
    assert velocities[-1] == pytest.approx(settings.keys.of(v), rel=1e-8, abs=1e-12)


def test_held_nodes_stay_and_the_pressed_one_goes_in(cube, young):
    positions, velocities = trajectory(cube.model, young, cube.press, cube.settings)
    assert (positions[:, cube.model.held] == cube.model.nodes[cube.model.held]).all()
    assert (velocities[0] == 0.0).all()
    assert (positions[0] == cube.model.nodes).all()
    assert 1e-4 < cube.model.nodes[cube.press.node, 2] - positions[-1, cube.press.node, 2] < 1e-3


def test_half_the_step_halves_the_error(cube):
    """First order, against steps of an eighth."""

    def at_the_end(parts):
        settings = replace(cube.settings, step_s=cube.settings.step_s / parts, steps=cube.settings.steps * parts)
        return simulate(cube.model, np.full(120, 1000.0), cube.press, settings)[0][-1]

    # against the limit extrapolated from steps of 1/32 and 1/64
    limit = 2 * at_the_end(64) - at_the_end(32)
    errors = [np.linalg.norm(at_the_end(parts) - limit) for parts in (4, 8)]
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.1)


def test_the_papers_damping_would_freeze_the_cube(cube):
    """Eq. 6 with lengths in metres: hundreds of times critical, and a spring relaxes over seconds."""
    model = cube.model
    k = stiffnesses(model, np.full(120, 1000.0))
    paper = 2.0 * np.sqrt(k * model.masses[model.pairs].sum(axis=1)) / model.rest_m
    assert np.median(paper / dampings(model, k, 1.0)) > 500.0
    assert np.median(paper / k) > 1.0
    assert np.median(dampings(model, k, 1.0) / k) < 0.01


def test_a_diverging_motion_and_bad_moduli_are_reported(cube):
    with pytest.raises(NotConverged, match="the motion diverges; take steps shorter than"):
        simulate(cube.model, np.full(120, 1000.0), cube.press, replace(cube.settings, step_s=0.01, steps=300))
    for young in (np.full(120, -1.0), np.ones(119)):
        with pytest.raises(InputError, match="120 positive numbers"):
            simulate(cube.model, young, cube.press, cube.settings)
