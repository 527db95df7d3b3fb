"""The simulated and the closed displacement are drawn in mm, and their difference in per cent."""

import pytest

from palpate.studies.shape_matching import figures


def test_both_curves_and_their_difference_are_drawn(shape_matching_results):
    table = shape_matching_results["maxwell_creep"]
    moved, error = figures.draw_maxwell_creep(table).axes
    springs, closed, simulated = (line.get_ydata() for line in moved.lines)
    assert simulated.max() == pytest.approx(1e3 * table["creep_m"].max())
    assert closed.max() == pytest.approx(10.0) and springs.max() == pytest.approx(10.0)
    assert error.lines[1].get_ydata() == pytest.approx([1.0] * len(table))
