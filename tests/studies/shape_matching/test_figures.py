"""Every case of the poke has its curve and its share of moved nodes."""

import pytest

from palpate.studies.shape_matching import figures


def test_bars_are_what_was_measured(shape_matching_results):
    limits, tips = figures.draw_cluster_goals(shape_matching_results["cluster_goals"]).axes
    assert [bar.get_height() for bar in limits.patches] == pytest.approx([1.0, 1.0, 1.0, 0.151])
    assert [bar.get_height() for bar in tips.patches] == pytest.approx([10.0, 12.0, 9.0, 11.0])
    said = [text.get_text() for text in limits.texts]
    assert said.count("none\nup to 1") == 3 and "0.151" in said


def test_both_curves_and_their_difference_are_drawn(shape_matching_results):
    table = shape_matching_results["maxwell_creep"]
    moved, error = figures.draw_maxwell_creep(table).axes
    springs, closed, simulated = (line.get_ydata() for line in moved.lines)
    assert simulated.max() == pytest.approx(1e3 * table["creep_m"].max())
    assert closed.max() == pytest.approx(10.0) and springs.max() == pytest.approx(10.0)
    assert error.lines[1].get_ydata() == pytest.approx([1.0] * len(table))
