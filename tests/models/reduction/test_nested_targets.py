"""What snapshots change from level to level, fitted."""

import numpy as np
import pytest

from palpate.models.contact_modes.workshop import fitted


def test_weak_presses_are_met_as_well_as_hard_ones():
    rng = np.random.default_rng(0)
    seen, truth = rng.normal(size=(8, 6)) * [1.0, 1.0, 1.0, 0.03, 0.03, 0.03], rng.normal(size=(5, 3, 8))
    wanted = truth @ seen
    found = fitted(seen, wanted) @ seen
    assert np.linalg.norm(found - wanted, axis=(0, 1)) == pytest.approx(
        np.zeros(6), abs=0.01 * np.linalg.norm(wanted[:, :, 3:], axis=(0, 1)).min()
    )


def test_a_press_that_moves_nothing_is_left_out():
    seen, wanted = np.diag([1.0, 2.0, 0.0]), np.ones((2, 3, 3))
    assert np.isfinite(fitted(seen, wanted)).all()
    assert fitted(seen, wanted) @ seen[:, :2] == pytest.approx(wanted[:, :, :2], rel=1e-3)
