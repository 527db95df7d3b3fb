"""The reference motion: same damping as the springs, and its own damping by the step small."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.effects.linear_elements import LinearElements
from palpate.models.springs.spring_motion import damping_time, dampings, reference_motion, stiffnesses


def test_swelling_is_damped_as_in_the_springs(cube):
    """At ν = 1/4, where both have the same bulk modulus."""
    model, v = cube.model, 3.0 * cube.model.nodes
    k = stiffnesses(model, np.full(120, 1000.0))
    rates = 3.0 * model.rest_m
    elastic = LinearElements(cube.particles, cube.particles.material)
    stiffness = elastic.stiffness(model.nodes, definite=True)
    power = damping_time(model, 1000.0, 0.2) * v.ravel() @ (stiffness @ v.ravel())
    assert (dampings(model, k, 0.2) * rates**2).sum() == pytest.approx(power, rel=1e-9)


def test_finer_steps_converge_to_first_order(cube):
    settings = replace(cube.settings, steps=20)
    coarse, middle, fine = (
        reference_motion(cube.particles, cube.model, cube.press, settings, substeps)[0] for substeps in (1, 2, 4)
    )
    assert coarse.shape == (20, 4, 3)
    moved = np.abs(fine - settings.keys.of(cube.model.nodes)).max()
    assert 1e-5 < moved < 1e-3
    assert np.abs(middle - fine).max() < 0.05 * moved
    assert np.abs(coarse - middle).max() / np.abs(middle - fine).max() == pytest.approx(2.0, rel=0.2)


def test_it_follows_the_press(cube):
    """The top goes down, and as far within a factor of three as springs of the same modulus."""
    positions, velocities = reference_motion(
        cube.particles, cube.model, cube.press, replace(cube.settings, steps=30), 1
    )
    down = 0.01 - positions[-1, 0, 2]
    assert 1.0 < (0.01 - cube.motion[0][29, 0, 2]) / down < 3.0
    assert velocities[10, 0, 2] < 0.0
