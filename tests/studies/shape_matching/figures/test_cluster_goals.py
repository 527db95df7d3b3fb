"""Bars stand for the measured limits and tips, and limits above 1 are said to be none."""

import pytest

from palpate.studies.shape_matching import figures


def test_bars_are_what_was_measured(shape_matching_results):
    limits, tips = figures.draw_cluster_goals(shape_matching_results["cluster_goals"]).axes
    assert [bar.get_height() for bar in limits.patches] == pytest.approx([1.0, 1.0, 1.0, 0.151])
    assert [bar.get_height() for bar in tips.patches] == pytest.approx([10.0, 12.0, 9.0, 11.0])
    said = [text.get_text() for text in limits.texts]
    assert said.count("none\nup to 1") == 3 and "0.151" in said
