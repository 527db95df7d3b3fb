"""Energies over time."""

import numpy as np
import pandas as pd
import pytest

from palpate.report import style
from palpate.studies.scenes.figures import charts


def test_balance_is_the_sum_minus_the_work_and_gravity_begins_at_zero(scene_results):
    table = scene_results["energy"]
    press, sag = (charts.counted(table[table["scene"] == scene]) for scene in ("press", "sag"))
    np.testing.assert_allclose(press["balance_j"], -0.5e-3 * press["time_s"], atol=1e-15)
    assert sag["gravity_j"].iloc[0] == 0 and sag["total_j"].iloc[0] == 0
    assert sag["gravity_j"].iloc[-1] == pytest.approx(-2e-3)
    assert charts.of_effects(press) == ["kinetic_j", "springs_j"]
    assert charts.of_effects(sag) == ["kinetic_j", "gravity_j", "corotational_j"]


def test_one_panel_a_scene_with_its_own_energies(scene_results, tmp_path):
    figure = charts.draw_energy(scene_results["energy"])
    press, sag = figure.axes
    assert (press.get_title(loc="left"), sag.get_title(loc="left")) == ("press", "sag")
    assert press.get_ylabel() == "energy [mJ]"
    # zero, sum, balance, kinetic, springs, outer work; zero, sum, balance, kinetic, corotational, gravity
    assert (len(press.lines), len(sag.lines)) == (6, 6)
    np.testing.assert_allclose(press.lines[2].get_ydata()[-1], -0.5)
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert "springs, corotational" in labels and "gravity" in labels and "sum − external work" in labels
    style.save(figure, tmp_path / "energy")


@pytest.mark.parametrize("count", [1, 2, 3, 4, 7])
def test_any_number_of_scenes_has_its_panels(scene_results, count):
    press = scene_results["energy"].query("scene == 'press'")
    table = pd.concat([press.assign(scene=f"scene{i}") for i in range(count)])
    assert len(charts.draw_energy(table).axes) == count


def test_a_sum_without_the_elastic_energy_is_not_shown(scene_results):
    press = scene_results["energy"].query("scene == 'press'").drop(columns="springs_j")
    assert not charts.whole(charts.counted(press))
    (axis,) = charts.draw_energy(press).axes
    assert len(axis.lines) == 3  # zero, kinetic, outer work
    assert [text.get_text() for text in axis.texts] == ["its elastic effect has no energy"]
