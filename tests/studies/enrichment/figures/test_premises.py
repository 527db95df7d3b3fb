"""Premises are drawn in the order of how local they are, with a whisker for each comparison."""

import pytest

from palpate.report import style
from palpate.studies.enrichment.figures import charts


def test_rows_go_from_local_to_global(results):
    figure = charts.draw_premises(results["premises"], results["premise_bodies"])
    left, right = figure.axes
    labels = [label.get_text() for label in left.get_yticklabels()]
    assert [label.split("\n")[0] for label in labels] == ["pad", "bent", "own*"]
    assert labels[0].endswith("20 % of the surface moves")
    ordered = style.look("ordered_nonnegative_a").colour
    marks = [line for line in right.lines if line.get_color() == ordered and line.get_marker() == "s"]
    assert [line.get_xdata()[0] for line in marks] == pytest.approx([0.2, 0.9, 1.0])


def test_vectors_of_two_presses_are_drawn_where_least_and_most_moves(results):
    figure = charts.draw_feature_vectors(results["feature_vectors"], results["premise_bodies"])
    assert len(figure.axes) == 2 * 3 and all(len(axis.lines) == 2 for axis in figure.axes)
    assert figure.axes[0].get_ylabel().startswith("own") and figure.axes[3].get_ylabel().startswith("pad")
    assert figure.axes[1].get_title(loc="left") == "contact-ordered\n0.00 apart"
    assert figure.axes[0].get_title(loc="left") != "unordered\n0.00 apart"


def test_a_ratio_beyond_the_scale_is_marked_at_its_end(results):
    rows = results["premises"].copy()
    rows.loc[(rows["features"] == "framed") & (rows["weights"] == "linear"), ["ratio", "ratio_low", "ratio_high"]] = 1e5
    right = charts.draw_premises(rows, results["premise_bodies"]).axes[1]
    ends = [line for line in right.lines if line.get_marker() == ">"]
    assert len(ends) == 3 and all(line.get_xdata()[0] < right.get_xlim()[1] for line in ends)
