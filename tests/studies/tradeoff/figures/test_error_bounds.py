"""The figure of bounds has a point a setting and scene, for each estimate."""

import numpy as np
import pytest
from fixtures.drawn import texts
from fixtures.trade_off import OWN
from fixtures.trade_off import error_bounds as made_up

from palpate.studies.tradeoff.figures import truth


def test_sharpness_and_coverage_of_each_estimate_are_drawn():
    left, right = truth.draw_error_bounds(made_up()).axes
    points = [line for line in left.lines if line.get_marker() == "o"]
    assert [set(line.get_ydata()) for line in points] == [{4.0}, {1.3}]
    assert all(len(line.get_xdata()) == 2 * len(OWN) for line in points)
    assert set(points[0].get_xdata()) == {0.0} and set(points[1].get_xdata()) == {0.95}
    full, hollow = ([line for line in right.lines if line.get_mfc() == kind] for kind in ("#9a9a9a", "none"))
    assert set(full[0].get_ydata()) == {96.0}
    assert np.nanmax(hollow[0].get_ydata()) == pytest.approx(20.0)
    assert "one fine residual" in texts(left.figure)
