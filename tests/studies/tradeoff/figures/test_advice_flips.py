"""Cells show what is advised for each radius of the finger, and lines where that changes."""

import pytest
from fixtures.drawn import texts
from fixtures.trade_off import advice_by_radius
from matplotlib.colors import to_hex
from matplotlib.patches import Rectangle

from palpate.report.model_looks import look
from palpate.studies.tradeoff.figures import advice


@pytest.fixture
def figure():
    return advice.draw_advice_flips(advice_by_radius())


def test_each_body_and_kind_of_error_has_its_panel(figure):
    assert [axis.get_title("left") for axis in figure.axes] == [
        f"{body}: error {kind}" for body in ("cylinder", "liver") for kind in ("over the surface", "at the patch")
    ]
    assert [text.get_text() for text in figure.axes[2].get_xticklabels()] == ["4", "8", "12", "20"]
    asked = [text.get_text().replace("\u00a0", " ") for text in figure.axes[0].get_yticklabels()]
    assert asked == ["within 1 ms", "within 16.7 ms", "at most 5 %", "at most 0.01 %"]


def test_a_cell_has_the_colour_of_its_model_and_the_error_of_its_kind(figure):
    surface, patch = figure.axes[:2]
    cells = [cell for cell in surface.patches if isinstance(cell, Rectangle)]
    models = ["linear_residual"] * 2 + ["linear_fem"] * 2 + ["detail_correction"] * 4
    assert [to_hex(cell.get_facecolor()) for cell in cells[:8]] == [look(model).colour for model in models]
    assert [text.replace("\u00a0", " ") for text in texts(patch) if text.startswith("7.5")] == ["7.5 %"] * 3
    assert texts(surface).count("none") == 4


def test_a_line_stands_where_the_model_changes(figure):
    lines = [(line.get_xdata()[0], line.get_ydata()[0]) for line in figure.axes[0].lines]
    assert lines == [(1.5, -0.5)]  # between 8 and 12 mm, first question
