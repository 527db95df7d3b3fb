"""A line for each change and contact, the mesh's errors beside it, and crosses where there is no answer."""

import pytest
from fixtures.drawn import texts

from palpate.studies.law.figures import colour, draw_law, label


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


def test_a_change_without_a_truth_is_hollow(law_table):
    doubted = law_table.assign(believed=law_table["believed"] & law_table["poisson"].ne(0.49))
    figure = draw_law(doubted)
    lines = [line for line in figure.axes[1].lines if line.get_marker() == "o"]
    assert [line.get_linestyle() for line in lines] == ["-", "-", ":"] and lines[2].get_markerfacecolor() == "white"
    assert texts(figure).count("without a truth that is believed") == 1


def test_a_law_of_ones_own_is_named_by_its_file():
    assert label("law", "models/my_law.py", 0.3) == "my law" and colour("law", "models/my_law.py", 0) == "#8b0000"
    assert label("law", "exponential(8)", 0.3) == "exponential, b = 8"
    assert label("nothing", "neo_hookean", 0.49) == "neo-Hookean, ν = 0.49"
    assert label("regions", "corotational", 0.3) == "without its regions"
