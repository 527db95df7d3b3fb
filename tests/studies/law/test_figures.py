"""A line for each change and contact, the mesh's errors beside it, and crosses where there is no answer."""

import pytest
from fixtures.drawn import texts

from palpate.studies.law.figures import colour, draw_law


def test_changes_and_meshes_stand_side_by_side(law_table):
    figure = draw_law(law_table)
    above, below = figure.axes[:2], figure.axes[2:]
    changes = ("law", "neo_hookean", 0), ("law", "st_venant_kirchhoff", 0), ("poisson", "", 0)
    for axis, body in zip(above, ("cylinder", "liver"), strict=True):
        assert axis.get_title(loc="left") == body
        lines = [line for line in axis.lines if line.get_marker() == "o"]
        assert [line.get_color() for line in lines] == [colour(*change) for change in changes]
        assert lines[0].get_ydata() == pytest.approx([0.1, 0.3, 0.6, 1.0])  # per cent: a tenth of the depth
        meshes = [line.get_ydata()[0] for line in axis.lines if line.get_marker() == "None"]
        assert meshes == pytest.approx([5.0, 2.0, 0.5, 0.1])
    assert [len(axis.lines) for axis in below] == [4, 4]
    assert below[0].lines[0].get_ydata() == pytest.approx([-0.04, -0.12, -0.24, -0.4])
    # the press without an answer is crossed
    crossed, none = ([line for line in axis.lines if line.get_marker() == "x"] for axis in above)
    assert [line.get_xdata().tolist() for line in crossed] == [[pytest.approx(10.0)]] and not none
    assert crossed[0].get_color() == colour("law", "st_venant_kirchhoff", 0)
    for name in ("neo-Hookean", "St. Venant–Kirchhoff", "ν = 0.49", "the body as it is described"):
        assert texts(figure).count(name) == 1
