"""Times and false pairs of bounding structures are drawn as their table has them."""

import pytest

from palpate.report import style
from palpate.studies.collision import figures
from palpate.studies.collision.figures import look


def test_time_over_false_pairs_has_a_curve_a_structure_and_frames_a_row(collision_results):
    figure = figures.draw_collision(collision_results["collision"])
    above = figure.axes[:2]
    assert [axis.get_title("left").split(",")[0] for axis in above] == ["two livers", "folding sheet"]
    drawn = {line.get_color(): line for line in above[0].lines}
    for depths, false, query in (("4/2", 100.0, 2.0), ("8/4", 400.0, 4.0)):
        composite = drawn[look("composite", depths, ["4/2", "8/4"]).colour]
        assert (composite.get_xdata()[0], composite.get_ydata()[0]) == (false, query)
    joined = drawn[style.FAINT]
    assert list(joined.get_xdata()) == [100.0, 400.0]
    assert drawn[look("obb_coal").colour].get_ydata()[0] == 2.0
    assert len(above[0].lines) == len(above[1].lines) + 1
    labels = [text.get_text() for text in figure.axes[2].get_yticklabels()]
    assert labels == ["spheres", "AABBs", "composite 4/2", "composite 8/4", "coal, OBBs, rebuilt"]
    whole = [line.get_xdata()[0] for line in figure.axes[2].lines[2::3]]
    assert whole == [4.5, 1.5, 2.5, 4.5, 12.0]


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
    assert [text.get_text() for text in axes[0].texts] == ["0", "4"]
    # panels without numbers say so
    assert [text.get_text() for text in axes[3].texts] == ["never in contact"]
    assert [text.get_text() for text in axes[4].texts] == ["never apart"]
    assert not axes[3].lines and not axes[4].lines


def test_growth_has_a_panel_a_stage_and_names_exponents(collision_results):
    figure = figures.draw_collision_scaling(collision_results["collision_scaling"])
    assert [axis.get_title("left") for axis in figure.axes] == ["build", "refit", "query"]
    labels = [[text.get_text() for text in axis.get_legend().get_texts()] for axis in figure.axes]
    assert "AABBs: n$^{1.00}$" in labels[1] and "composite 4/2: n$^{0.50}$" in labels[2]
    assert not any("coal" in label for label in labels[1])
