"""Errors over time are drawn for each layer, beside the whole tree."""

import pytest

from palpate.studies.collision import figures
from palpate.studies.collision.figures import look


def test_each_structure_has_a_curve_of_its_layers_and_a_mark_of_the_whole_tree(collision_results):
    figure = figures.draw_collision_precision(collision_results["collision_precision"])
    axes = figure.axes
    assert len(axes) == 3 * 2
    assert [axis.get_title("left").split(",")[0] for axis in axes[:2]] == ["two livers", "livers apart"]
    curves = [line for line in axes[0].lines if line.get_color() == look("aabb").colour]
    assert curves[0].get_xdata() == pytest.approx([0.1, 0.3, 0.5])
    assert curves[0].get_ydata() == pytest.approx([100.0, 25.0, 6.25])
    assert (curves[1].get_xdata(), curves[1].get_ydata()) == (pytest.approx([0.5]), pytest.approx([1.0]))
    # the response itself: 10 mm
    assert axes[0].lines[-1].get_ydata()[0] == pytest.approx(10.0)
    assert [text.get_text() for text in axes[0].texts] == ["0", "2", "4"]


def test_panels_without_numbers_say_so(collision_results):
    axes = figures.draw_collision_precision(collision_results["collision_precision"]).axes
    assert [text.get_text() for text in axes[3].texts] == ["never in contact"]
    assert [text.get_text() for text in axes[4].texts] == ["never apart"]
    assert not axes[3].lines and not axes[4].lines
