"""Figures of truths, of bounds of single answers, and of limit points, have what their tables say."""

import numpy as np
import pytest
from fixtures import trade_off
from fixtures.drawn import texts
from fixtures.trade_off import OWN

from palpate.benchmark.presses import PRESSURE
from palpate.studies.tradeoff.figures import truth


def test_each_scene_has_its_errors_and_its_order():
    table = trade_off.truth()
    errors, order = truth.draw_truth(table).axes
    points = {line.get_label(): list(line.get_xdata()) for line in errors.lines if line.get_marker() in "osD"}
    assert points["over the surface, RMSE of peak"] == [pytest.approx(100 * rms) for rms, _ in OWN.values()]
    assert points["at the patch, RMS of peak"] == [pytest.approx(100 * patch) for _, patch in OWN.values()]
    (orders,) = (line for line in order.lines if line.get_marker() == "o")
    assert list(orders.get_xdata()) == list(table["order"])
    assert "liver large" in texts(errors)
    assert [line.get_xdata()[0] for line in errors.lines if line.get_color() == "#aa0000"] == [pytest.approx(0.3)]
    # the limit of another element is drawn where it was found
    named = [text.get_text() for text in truth.draw_truth(table).legends[0].get_texts()]
    checked = table.assign(other_element=[0.002] + [float("nan")] * (len(table) - 1))
    added = {text.get_text() for text in truth.draw_truth(checked).legends[0].get_texts()} - set(named)
    assert added == {"distance of the limit of linear elements, from the own error of the same samples"}


def test_the_worst_sample_and_all_orders_are_lines():
    table = trade_off.truth()
    more = table.assign(rmse_of_peak_max=3 * table["rmse_of_peak"], ratio_min=2.0, ratio_max=4.0)
    errors, order = truth.draw_truth(more).axes
    ends = [segment[-1, 0] for segment in errors.collections[0].get_segments()]
    assert ends == [pytest.approx(300 * rms) for rms, _ in OWN.values()]
    assert order.collections[0].get_segments()[0][:, 0] == pytest.approx([1, 2])
    diverging = truth.draw_truth(more.assign(ratio_min=0.5)).axes[1]  # a change that grew is shown as it is
    assert diverging.collections[0].get_segments()[0][0, 0] == pytest.approx(-1) and diverging.get_xlim()[0] < -1


def test_validation_samples_and_the_own_error_of_checked_samples_are_drawn_beside():
    table = trade_off.truth()
    more = table.assign(other_element=0.002, other_element_own=0.001, other_element_patch=0.02)
    errors = truth.draw_truth(more.assign(other_element_own_patch=0.01)).axes[0]
    crosses = [list(line.get_xdata()) for line in errors.lines if line.get_marker() == "x"]
    assert crosses[0] == [pytest.approx(250 * rms) for rms, _ in OWN.values()] and len(crosses) == 2
    joined = [part.get_segments()[0][:, 0] for part in errors.collections[-2:]]
    assert joined == [pytest.approx([0.1, 0.2]), pytest.approx([1, 2])]


def test_what_facets_change_is_drawn_where_it_was_measured():
    table = trade_off.truth()
    some = [0.05] + [float("nan")] * (len(table) - 1)
    errors = truth.draw_truth(table.assign(geometry_of_peak=some, geometry_patch_of_peak=0.08)).axes[0]
    triangles = [line.get_xdata() for line in errors.lines if line.get_marker() == "^"]
    assert triangles[0][0] == pytest.approx(5) and list(triangles[1]) == [pytest.approx(8)] * len(table)
    assert not [line for line in truth.draw_truth(table).axes[0].lines if line.get_marker() == "^"]


def test_sharpness_and_coverage_of_each_estimate_are_drawn():
    left, right = truth.draw_error_bounds(trade_off.error_bounds()).axes
    points = [line for line in left.lines if line.get_marker() == "o"]
    assert [set(line.get_ydata()) for line in points] == [{4.0}, {1.3}]
    assert all(len(line.get_xdata()) == 2 * len(OWN) for line in points)
    assert set(points[0].get_xdata()) == {0.0} and set(points[1].get_xdata()) == {0.95}
    full, hollow = ([line for line in right.lines if line.get_mfc() == kind] for kind in ("#9a9a9a", "none"))
    assert set(full[0].get_ydata()) == {96.0}
    assert np.nanmax(hollow[0].get_ydata()) == pytest.approx(20.0)
    assert "one fine residual" in texts(left.figure)


def test_only_the_contact_that_snaps_is_marked_and_the_colour_is_the_least_determinant():
    table = trade_off.limit_points()
    cylinder, liver = truth.draw_limit_points(table).axes[:2]
    thick = [[line for line in axis.lines if line.get_linewidth() == 2.5] for axis in (cylinder, liver)]
    assert thick[0] == [] and [list(line.get_xdata()) for line in thick[1]] == [[0.29, 0.31]]
    crosses = [
        [x for line in axis.lines if line.get_marker() == "x" for x in line.get_xdata()] for axis in (cylinder, liver)
    ]
    assert crosses == [[], [pytest.approx(0.31), pytest.approx(0.34)]]
    first = table[(table["body"] == "cylinder") & (table["contact"] == 0)]
    assert list(cylinder.collections[0].get_array()) == list(first["least_det"])
    assert [line.get_xdata()[0] for line in cylinder.lines if line.get_linestyle() == ":"] == [PRESSURE]
