"""What hangs on a body until it is let go."""

import numpy as np
import pytest

from palpate.studies.measured.release import DeadLoad


def test_the_energy_of_a_dead_load_is_zero_at_rest_and_falls_by_its_work():
    rng = np.random.default_rng(1)
    rest, force, moved = rng.normal(size=(3, 5, 3))
    load, found = DeadLoad(rest, force), np.zeros((5, 3))
    load.add_force(rest + moved, moved, found)
    np.testing.assert_array_equal(found, force)
    assert load.energy(rest) == 0.0
    assert load.energy(rest + moved) == pytest.approx(-(force * moved).sum())
