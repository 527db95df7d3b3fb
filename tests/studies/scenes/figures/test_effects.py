"""What effects cost, and what leaving them out costs."""

import matplotlib.text
import numpy as np

from palpate.report import style
from palpate.studies.scenes.figures import charts


def texts(axis):
    """What is written into a panel."""
    return [t.get_text().replace("\u00a0", " ") for t in axis.findobj(matplotlib.text.Annotation)]


def test_a_bar_an_effect_and_a_dot_where_it_could_be_left_out(scene_results, tmp_path):
    figure = charts.draw_effects(scene_results["effects"])
    press, press_error, sag, sag_error = figure.axes
    np.testing.assert_allclose([bar.get_width() for bar in press.patches], [0.75, 0.05, 0.2])
    assert texts(press) == ["750 µs, 75 %", "50 µs, 5 %", "200 µs, 20 %"]
    assert texts(press_error) == ["–", "100 %", "< 0.001 %"]
    assert texts(sag_error) == ["–", "100 %", "4000 %", "–"]
    assert [t.get_text() for t in sag.get_yticklabels()] == ["corotational", "gravity", "held", "integrator"]
    low, high = press_error.get_xlim()
    assert (low, high) == sag_error.get_xlim()
    assert high > 4000
    style.save(figure, tmp_path / "effects")


def test_no_error_is_off_the_axis(scene_results):
    effects = scene_results["effects"].assign(error_if_left_out=1e-9)
    for axis in charts.draw_effects(effects).axes[1::2]:
        dots = [line.get_xdata()[0] for line in axis.lines if line.get_marker() == "o"]
        assert dots and min(dots) >= axis.get_xlim()[0]
