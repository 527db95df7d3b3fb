"""Times and false pairs of bounding structures are drawn as their table has them."""

import pytest

from palpate.errors import InputError
from palpate.report import style
from palpate.studies.collision import figures


def test_time_over_false_pairs_has_a_curve_a_structure_and_a_line_a_rival(collision_results):
    figure = figures.draw_collision(collision_results["collision"])
    above = figure.axes[:2]
    assert [axis.get_title("left").split(",")[0] for axis in above] == ["two livers", "folding sheet"]
    drawn = {line.get_color(): line for line in above[0].lines}
    for depths, false, query in (("4/2", 100.0, 2.0), ("8/4", 400.0, 4.0)):
        composite = drawn[figures.look("composite", depths, ["4/2", "8/4"]).colour]
        assert (composite.get_xdata()[0], composite.get_ydata()[0]) == (false, query)
    joined = drawn[style.FAINT]
    assert list(joined.get_xdata()) == [100.0, 400.0]
    assert drawn[figures.look("obb_coal").colour].get_ydata()[0] == 2.0
    assert len(above[0].lines) == len(above[1].lines) + 1


def test_frames_have_a_row_each(collision_results):
    figure = figures.draw_collision(collision_results["collision"])
    labels = [text.get_text() for text in figure.axes[2].get_yticklabels()]
    assert labels == ["spheres", "AABBs", "composite 4/2", "composite 8/4", "coal, OBBs, rebuilt"]
    whole = [line.get_xdata()[0] for line in figure.axes[2].lines[2::3]]
    assert whole == [4.5, 1.5, 2.5, 4.5, 12.0]


def test_an_unknown_structure_has_no_colour(collision_results):
    with pytest.raises(InputError, match="structure cone has no colour"):
        figures.look("cone")
    table = collision_results["collision"].replace({"structure": {"aabb": "cone"}})
    with pytest.raises(InputError, match="structure cone has no colour"):
        figures.draw_collision(table)
