"""The force on an instrument is drawn over time and depth."""

import numpy as np
import pandas as pd
import pytest

from palpate.report import style, tables
from palpate.studies.scenes.figures import charts


@pytest.fixture
def felt() -> pd.DataFrame:
    t = np.linspace(0.0, 1.0, 21)
    depth = 0.02 * np.sin(np.pi * t) - 0.005
    force = 40.0 * depth.clip(min=0.0)
    across = dict.fromkeys(("force_x_n", "force_y_n"), np.zeros(21))
    table = pd.DataFrame({"time_s": t, **across, "force_z_n": force, "force_n": force, "depth_m": depth})
    return table.assign(scene="palpation", instrument="finger")


def test_force_and_depth_are_drawn_in_newtons_and_millimetres(felt, tmp_path):
    figure = charts.draw_contact_force(felt, scene="palpation")
    force, depth, loop = figure.axes[:3]
    assert force.lines[0].get_ydata().max() == pytest.approx(0.6)
    assert depth.lines[0].get_ydata().max() == pytest.approx(15.0)
    assert len(loop.collections[0].get_offsets()) == (felt["force_n"] > 0.0).sum()
    style.save(figure, tmp_path / "felt")


def test_each_instrument_has_a_row_and_one_without_a_depth_has_its_force(felt, tmp_path):
    plate = felt.assign(instrument="plate", depth_m=np.nan, force_n=2.0)
    other = felt.assign(scene="other", instrument="hook")
    figure = charts.draw_contact_force(pd.concat([felt, plate, other]), scene="palpation")
    titles = [axis.get_title(loc="left") for axis in figure.axes]
    assert [title for title in titles if "force on" in title] == [
        "palpation: force on the finger",
        "palpation: force on the plate, which has no depth",
    ]
    assert figure.axes[0].lines[0].get_ydata() == pytest.approx(felt["force_n"].to_numpy())
    assert figure.axes[-1].lines[0].get_ydata() == pytest.approx(2.0)
    style.save(figure, tmp_path / "felt")
    for axis in (figure.axes[0], figure.axes[-1]):
        assert axis.get_legend().get_window_extent().x0 >= axis.get_window_extent().x1


def test_a_scene_without_a_moving_instrument_has_a_note(felt, tmp_path):
    felt.iloc[:0].to_csv(tmp_path / "charts.csv", index=False)
    empty = tables.read(tmp_path / "charts.csv", rows=False)
    for table in (felt, empty):
        figure = charts.draw_contact_force(table, scene="other")
        assert figure.axes[0].texts[0].get_text() == "other: no instrument moves before the scene ends"
        style.save(figure, tmp_path / "nothing")
    style.save(charts.draw_contact_force(felt.assign(force_n=0.0), scene="palpation"), tmp_path / "untouched")
