"""Sentences and figures about palpation follow from its tables."""

import pandas as pd
import pytest
from fixtures.drawn import texts

from palpate.studies.palpation import figures


@pytest.fixture
def tables():
    rows = [["liver", 3, 0.005, 0.1, 0.004, 0.005, 0.25, True], ["liver", 8, 0.05, 0.1, 0.009, 0.01, 0.01, False]]
    names = ["body", "contact", "cover_m", "force_n", "depth_m", "depth_without_m", "stiffer", "felt"]
    limits = [
        [c, 0.01, k, s, 0.15, n] for c, k, s, n in ((0.004, 2, 0.2, 37), (0.004, 1e4, 0.6, 42), (0.016, 2, 0.01, 37))
    ]
    columns = ["cover_m", "ball_radius_m", "contrast", "stiffer", "threshold", "products"]
    return {
        "palpation": pd.DataFrame(rows, columns=names).assign(threshold=0.15),
        "palpation_limits": pd.DataFrame(limits, columns=columns),
    }


def test_places_and_limits_are_drawn(tables):
    left, right = figures.draw_palpation(tables["palpation"]).axes
    assert left.lines[0].get_xdata().tolist() == [0.0, 4.0] and left.lines[1].get_xdata().tolist() == [0.0, 5.0]
    assert right.collections[0].get_offsets().tolist() == [[5.0, 25.0], [50.0, 1.0]]
    figure = figures.draw_palpation_limits(tables["palpation_limits"])
    assert figure.axes[0].lines[0].get_ydata().tolist() == [20.0, 60.0] and "never felt" in texts(figure)
