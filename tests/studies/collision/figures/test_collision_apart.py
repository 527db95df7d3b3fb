"""Tests and times over the gap are drawn as their table has them."""

import pytest

from palpate.studies.collision import figures
from palpate.studies.collision.figures import look


def test_each_structure_has_a_curve_and_rivals_only_times(collision_results):
    figure = figures.draw_collision_apart(collision_results["collision_apart"])
    tests, query, whole = figure.axes[:3]
    assert len(figure.axes) == 6
    (curve,) = [line for line in tests.lines if line.get_color() == look("aabb").colour]
    assert curve.get_xdata() == pytest.approx([1.0, 10.0]) and curve.get_ydata() == pytest.approx([100.0, 10.0])
    rival = look("obb_coal").colour
    assert not [line for line in tests.lines if line.get_color() == rival]
    for axis, value in ((query, 0.2), (whole, 10.0)):
        (line,) = [line for line in axis.lines if line.get_color() == rival]
        assert line.get_ydata() == pytest.approx([value, value]) and line.get_linestyle() == ":"
    assert tests.get_title("left") == "two livers, 8,832 triangles"
