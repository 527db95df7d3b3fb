"""The longest stable step: motions below it stay small, and a longer one gets a sentence."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.errors import InputError, NotConverged
from palpate.models.springs.fitness import Range, check_step, step_limit
from palpate.models.springs.spring_motion import simulate


@pytest.mark.parametrize("volume", [0.0, 2.0])
def test_the_limit_is_the_edge(cube, volume):
    settings = replace(cube.settings, volume_n_m=volume, steps=400)
    limit = step_limit(cube.particles, cube.model, settings, 5000.0)
    young = np.full(120, 5000.0)
    below = simulate(cube.model, young, cube.press, replace(settings, step_s=0.97 * limit))[0]
    assert np.abs(below - settings.keys.of(cube.model.nodes)).max() < 1e-3
    with pytest.raises(NotConverged):
        simulate(cube.model, young, cube.press, replace(settings, step_s=2.0 * limit))


def test_a_step_that_is_too_long_gets_one_sentence(cube):
    check_step(cube.particles, cube.model, cube.settings, Range(300.0, 5000.0))
    with pytest.raises(InputError, match=r"^springs.step_s is 0.0004 s, and springs of 50000 Pa are stable .*\.$"):
        check_step(cube.particles, cube.model, cube.settings, Range(300.0, 50000.0))
