"""The calibration curve passes through its published points."""

import numpy as np
import pytest

from palpate.bodies.ct.masses import density


@pytest.mark.parametrize(
    ("hu", "g_cm3"),
    [
        (-1000, 0.00121),  # air
        (-50, 1.018 - 0.893e-3 * 50),  # adipose tissue
        (0, 1.018),
        (18, 1.03),
        (60, 1.003 + 1.169e-3 * 60),  # soft tissue
        (800, 1.017 + 0.592e-3 * 800),  # bone
    ],
)
def test_schneiders_lines(hu, g_cm3):
    assert density(hu) == pytest.approx(1e3 * g_cm3, rel=1e-12)


def test_it_jumps_nowhere_but_at_the_end_of_soft_tissue():
    hu = np.arange(-1024, 3072)
    steps = np.diff(density(hu))
    assert (hu[:-1][np.abs(steps) > 2] == 100).all()
    assert steps[hu[:-1] == 100] == pytest.approx(-43.0, abs=0.2)
    assert (density([-3024, -2000, -1000]) == density(-1000)).all()
