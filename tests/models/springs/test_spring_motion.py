"""The fast steps are those of the effects under symplectic Euler."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.effects.held import Held
from palpate.effects.kelvin import Kelvin
from palpate.effects.linear_elements import LinearElements
from palpate.effects.springs import Springs
from palpate.effects.volume_preservation import Volume
from palpate.errors import InputError, NotConverged
from palpate.models.springs import spring_motion
from palpate.models.springs.spring_motion import Load, Press, dampings, reference_motion, simulate, stiffnesses
from palpate.solvers.symplectic_euler import SymplecticEuler
from palpate.solvers.system import System

VOLUME = 0.5


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


def test_a_motion_is_that_of_the_effects(cube, young):
    settings = replace(cube.settings, volume_n_m=VOLUME)
    load = Load(cube.press)
    steps = integrator(cube, young, load)
    x, v = cube.model.nodes, np.zeros((120, 3))
    for load.factor in cube.press.factors(settings.step_s, settings.steps):
        x, v = steps.step(x, v, settings.step_s)
    positions, velocities = simulate(cube.model, young, cube.press, settings)
    assert positions[-1] == pytest.approx(settings.keys.of(x), rel=1e-10)
    assert velocities[-1] == pytest.approx(settings.keys.of(v), rel=1e-8, abs=1e-12)


def test_the_papers_damping_would_freeze_the_cube(cube):
    """Eq. 6 with lengths in metres: hundreds of times critical, and a spring relaxes over seconds."""
    model = cube.model
    k = stiffnesses(model, np.full(120, 1000.0))
    paper = 2.0 * np.sqrt(k * model.masses[model.pairs].sum(axis=1)) / model.rest_m
    ours = dampings(model, k, 1.0)
    assert np.median(paper / ours) > 500.0 and np.median(paper / k) > 1.0 > 100.0 * np.median(ours / k)


def test_a_diverging_motion_and_bad_moduli_are_reported(cube):
    with pytest.raises(NotConverged, match="the motion diverges; take steps shorter than"):
        simulate(cube.model, np.full(120, 1000.0), cube.press, replace(cube.settings, step_s=0.01, steps=300))
    for young in (np.full(120, -1.0), np.ones(119)):
        with pytest.raises(InputError, match="120 positive numbers"):
            simulate(cube.model, young, cube.press, cube.settings)


def test_key_points_follow_an_affine_motion(cube):
    gradient, shift = np.array([[1.1, 0.2, 0], [0, 0.9, 0.1], [0.3, 0, 1]]), np.array([1.0, 2, 3])
    moved = np.stack([cube.model.nodes, cube.model.nodes @ gradient.T + shift])
    points = cube.settings.keys.of(moved)
    assert points.shape == (2, 4, 3)
    assert points[0] == pytest.approx(np.array([[5, 5, 10], [0, 0, 10], [10, 3, 6], [5, 4, 5]]) * 1e-3, abs=1e-15)
    assert points[1] == pytest.approx(points[0] @ gradient.T + shift, rel=1e-12)


@pytest.mark.parametrize("point", [[0.005, 0.005, 0.0101], [-1, 0, 0], [np.nan, 0.001, 0.001]])
def test_a_point_outside_gets_one_sentence(cube, point):
    said = r"^springs\.key_points_m\[1\] is \[.*\], which is outside the mesh; give .*\.$"
    with pytest.raises(InputError, match=said):
        spring_motion.key_points(cube.mesh.nodes, cube.mesh.tetrahedra, [[0.001, 0.001, 0.001], point])


def test_a_press_rises_without_a_kink():
    factors = Press("top", 0, np.zeros(3), 0.01).factors(0.001, 20)
    assert factors[[4, 9, 19]] == pytest.approx([0.5, 1.0, 1.0])
    assert (np.diff(factors) >= 0.0).all()


def test_swelling_is_damped_as_in_the_springs(cube):
    """At ν = 1/4, where both have the same bulk modulus."""
    model, v = cube.model, 3.0 * cube.model.nodes
    k, rates = stiffnesses(model, np.full(120, 1000.0)), 3.0 * model.rest_m
    stiffness = LinearElements(cube.particles, cube.particles.material).stiffness(model.nodes, definite=True)
    power = spring_motion.damping_time(model, 1000.0, 0.2) * v.ravel() @ (stiffness @ v.ravel())
    assert (dampings(model, k, 0.2) * rates**2).sum() == pytest.approx(power, rel=1e-9)


def test_the_reference_follows_the_press_and_finer_steps_converge_to_first_order(cube):
    """The top goes down, and as far within a factor of three as springs of a modulus half as large again."""
    settings = replace(cube.settings, steps=20)
    coarse, middle, fine = (
        reference_motion(cube.particles, cube.model, cube.press, settings, substeps)[0] for substeps in (1, 2, 4)
    )
    assert coarse.shape == (20, 4, 3)
    moved, off = np.abs(fine - settings.keys.of(cube.model.nodes)).max(), np.abs(middle - fine).max()
    assert 1e-5 < moved < 1e-3 and off < 0.05 * moved
    assert np.abs(coarse - middle).max() / off == pytest.approx(2.0, rel=0.2)
    assert 1.0 < (0.01 - cube.motion[0][19, 0, 2]) / (0.01 - fine[-1, 0, 2]) < 3.0
