"""Errors beside a measured body are drawn where they are, hollow for a modulus as given."""

import numpy as np
from fixtures.drawn import texts

from palpate.report import style
from palpate.studies.measured.figures import models as figures


def test_a_panel_a_case_and_quantity(measured_table, tmp_path):
    figure = figures.draw_measured(measured_table, scene="beam")
    titles = [axis.get_title("left") for axis in figure.axes]
    assert (titles[0], titles[-1], len(titles)) == ("gravity: place", "load: creep", 8)  # none of what nobody measured
    place = figure.axes[4]
    drawn = {(line.get_xdata()[0], line.get_mfc()) for line in place.lines if line.get_marker() == "h"}
    assert drawn == {(-4.0, "white"), (-5.0, "#111111")}
    bands = [patch.get_extents().transformed(place.transData.inverted()).width for patch in place.patches]
    assert np.allclose(bands, [16.0, 2.0])  # twice the uncertainty; the range of the repeats
    assert "quadratic elements (P2), 1701 nodes" in texts(figure) and "not measured" in texts(figure)
    assert "repeats: 2\u00a0%" in texts(figure)
    style.save(figure, tmp_path / "measured_beam")
