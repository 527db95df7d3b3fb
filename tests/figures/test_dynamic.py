"""Models in motion are drawn and told as their table has them."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from palpate.figures import style, tables
from palpate.figures.dynamic import dynamic_accuracy
from palpate.report import page as report
from palpate.report.parts import dynamic_numbers

CAPTIONS = Path(__file__).parents[2] / "workflow" / "report"


@pytest.fixture
def table():
    """Springs are fast and 4 % off, fine FEM is slow and 1 % off; the finest step of springs did not converge."""
    told = [
        ("fem_fine", "step_s=0.02", 20.0, 0.02, 0),
        ("fem_fine", "step_s=0.01", 40.0, 0.01, 0),
        ("springs", "step_s=0.002", 0.1, 0.05, 0),
        ("springs", "step_s=0.001", 0.2, 0.04, 0),
        ("springs", "step_s=0.0005", 0.4, np.nan, 1),
    ]
    rows = [
        dict.fromkeys(tables.COLUMNS["dynamic_accuracy"].split(), 1.0)
        | {"scene": scene, "model": model, "setting": setting, "real_time_factor": slower, "rmse_of_peak": error}
        | {"failures": failures, "reference_change": 0.005}
        for scene in ("liver_press", "bar_sag")
        for model, setting, slower, error, failures in told
    ]
    return pd.DataFrame(rows)


def test_a_panel_a_scene_and_failures_counted(table, tmp_path):
    figure = dynamic_accuracy.draw(table)
    assert [axis.get_title("left") for axis in figure.axes] == [
        f"{s}, 1 did not converge" for s in ("liver press", "bar sag")
    ]
    springs = figure.axes[0].lines[1]
    assert springs.get_ydata().tolist() == [5.0, 4.0]
    style.save(figure, tmp_path / "dynamic_accuracy")


def test_the_headline_is_about_what_keeps_up_with_life(table):
    said = dynamic_numbers.numbers({"dynamic_accuracy": table})["headline_dynamic"].replace("\u00a0", " ")
    assert said.count("(4 % of the peak off)") == 2
    slow = table.assign(real_time_factor=2.0)
    assert dynamic_numbers.numbers({"dynamic_accuracy": slow})["headline_dynamic"].endswith("press none; bar sag none.")


def test_the_report_has_both_beside_the_other_comparisons(table, tmp_path):
    (tmp_path / "tables").mkdir()
    (tmp_path / "figures").mkdir()
    table.to_csv(tmp_path / "tables/dynamic_accuracy.csv", index=False)
    for suffix in ("svg", "png"):
        (tmp_path / f"figures/dynamic_accuracy.{suffix}").write_text("<svg></svg>")
    report.write(tmp_path, CAPTIONS, tmp_path / "report.html", ["dynamic"], [], [])
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert '<figure id="dynamic_accuracy">' in page and 'class="finding">Least wrong' in page
