"""Snaps of the dent under a growing pressure are marked, and loads without an equilibrium."""

import pytest
from fixtures.trade_off import limit_points as made_up

from palpate.benchmark.presses import PRESSURE
from palpate.studies.tradeoff.figures import truth


def test_only_the_contact_that_snaps_is_marked():
    cylinder, liver = truth.draw_limit_points(made_up()).axes[:2]
    thick = [[line for line in axis.lines if line.get_linewidth() == 2.5] for axis in (cylinder, liver)]
    assert thick[0] == [] and [list(line.get_xdata()) for line in thick[1]] == [[0.29, 0.31]]
    crosses = [
        [x for line in axis.lines if line.get_marker() == "x" for x in line.get_xdata()] for axis in (cylinder, liver)
    ]
    assert crosses == [[], [pytest.approx(0.31), pytest.approx(0.34)]]


def test_the_colour_is_the_least_determinant():
    table = made_up()
    points = truth.draw_limit_points(table).axes[0].collections[0]
    first = table[(table["body"] == "cylinder") & (table["contact"] == 0)]
    assert list(points.get_array()) == list(first["least_det"])


def test_the_limit_is_that_of_the_presses():
    lines = truth.draw_limit_points(made_up()).axes[0].lines
    assert [line.get_xdata()[0] for line in lines if line.get_linestyle() == ":"] == [PRESSURE]
