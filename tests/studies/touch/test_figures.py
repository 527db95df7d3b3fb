"""Three panels, a curve for each model, and the bands that say what an error means."""

import pytest
from fixtures.drawn import texts
from matplotlib.colors import same_color

from palpate.report.model_looks import look
from palpate.report.work_precision import OWN_COLOUR
from palpate.studies.touch.figures import draw_touch_precision

SCENE = "liver_sphere_8mm"


def bands(axis) -> list[tuple[str, float, float]]:
    """Return colour and ends of the bands across an axis."""
    spans = [
        (patch.get_facecolor(), patch.get_extents().transformed(axis.transData.inverted())) for patch in axis.patches
    ]
    return [(colour, box.y0, box.y1) for colour, box in spans]


@pytest.fixture
def figure(touch):
    return draw_touch_precision(touch, scene=SCENE)


def test_each_kind_of_error_has_a_panel_with_the_truths_own(figure):
    surface, dent, force, _ = figure.axes
    assert [axis.get_ylabel().split(",")[0] for axis in (surface, dent)] == [
        "error over the surface",
        "error in the dent",
    ]
    for axis, own in ((surface, 0.1), (dent, 0.2), (force, 0.4)):
        [(_, low, high)] = [band for band in bands(axis) if same_color(band[0], OWN_COLOUR)]
        assert high == pytest.approx(own) and low < own
    assert texts(figure).count("grey: below the error of the truth itself, 0.4\u00a0%") == 1


def test_a_curve_joins_the_settings_of_a_model_and_failures_are_hollow(figure):
    surface, _, force, _ = figure.axes
    refined = [line for line in surface.lines if same_color(line.get_color(), look("fem_local").colour)]
    assert refined[0].get_xdata() == pytest.approx([2000, 9000]) and refined[0].get_ydata() == pytest.approx([0.6, 0.2])
    linear = [
        line for line in surface.lines if line.get_marker() == look("linear").marker and len(line.get_xdata()) == 1
    ]
    hollow = [line.get_markerfacecolor() for line in linear if line.get_xdata()[0] == pytest.approx(0.2)]
    assert hollow == ["white"]
    xpbd = look("xpbd").colour
    assert not [line for line in force.lines if same_color(line.get_color(), xpbd) and len(line.get_xdata())]
    words = " ".join(texts(figure))
    assert "no force is told by: XPBD" in words and "shape matching (clusters=one) on 4 of 4" in words
    assert {"1 ms", "16.7 ms", "100 ms", "liver under a sphere of 8 mm"} <= set(texts(figure))


def test_a_scene_without_a_truth_is_drawn(touch):
    touch[["rmse_of_peak", "patch_rms_of_peak", "force_error_size"]] = float("nan")
    assert texts(draw_touch_precision(touch, scene=SCENE)).count("the error of the truth itself is not known") == 3
