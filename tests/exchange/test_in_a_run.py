"""A run that names files of answers has their table and figure; its own tables are untouched."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from palpate.benchmark.engine_scores import ANSWERS
from palpate.errors import InputError
from palpate.report import tables
from palpate.run.job import write_table
from palpate.run.settings import complete
from palpate.studies.tradeoff.figures.answers import draw_answers
from palpate.studies.tradeoff.jobs import tabulate_answers


@pytest.fixture
def asked(rows_of_run, answers, tmp_path):
    """What the rule gives its job."""
    np.savez(tmp_path / "engine.npz", **answers)
    scenes = {"block_large": ("large", 0.03, [str(tmp_path / "engine.npz")])}
    place = rows_of_run / "data/block"
    files = {"body": place / "body.h5", "samples": place / "large/samples.csv"}
    files |= {name: place / f"large/{name}.h5" for name in ("database", "truth")}
    listed = {name: [str(path)] for name, path in files.items()}
    return SimpleNamespace(table=str(rows_of_run / "tables/accuracy_vs_time.csv"), **listed), scenes, 1


def test_the_table_has_the_engine_s_rows_alone(asked, tmp_path):
    found = tabulate_answers(*asked)["table"]
    assert found.columns.tolist() == ANSWERS.columns and found["engine"].tolist() == ["Elsewhere"] * 3
    assert found["hardware"].tolist() == ["a graphics card"] * 3 and (found["law"] == "corotational").all()
    write_table(found, tmp_path / "answers.csv")
    again = tables.read(tmp_path / "answers.csv")
    assert again["rmse_of_peak"].to_numpy() == pytest.approx(found["rmse_of_peak"].to_numpy())


def test_each_engine_has_a_curve_of_its_own_that_tells_its_failures(asked):
    """Three engines are three hollow curves of other colours; the first setting of each has one failure of four."""
    found = tabulate_answers(*asked)["table"]
    table = pd.concat([found.assign(engine=name) for name in ("one", "two", "three")])
    axis = draw_answers(pd.read_csv(asked[0].table), table, scene="block_large").axes[0]
    hollow = [line for line in axis.lines if line.get_markerfacecolor() == "white"]
    assert [line.get_label() for line in hollow] == [
        f"{name} (its own machine, 1 of 12 failed)" for name in ("one", "two", "three")
    ]
    assert len({line.get_color() for line in hollow}) == 3 and {len(line.get_xdata()) for line in hollow} == {3}


def test_answers_to_other_questions_stop_the_run(asked, answers, tmp_path):
    np.savez(tmp_path / "engine.npz", **answers | {"digest": np.array("0")})
    with pytest.raises(InputError, match=r"digest is of other questions than these, of block_large"):
        tabulate_answers(*asked)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"block_larg": ["a.npz"]}, r"tradeoff.answers names block_larg, which is unknown; did you mean block_large"),
        ({"block_large": ["a.npz"]}, r"tradeoff.answers.block_large is a.npz, where there is no file"),
        ({"block_large": []}, r"tradeoff.answers.block_large"),
    ],
)
def test_scenes_and_files_that_are_not_there_are_named(pressed, given, said):
    from palpate.run.settings import read_settings

    settings = read_settings(pressed.config)
    settings["tradeoff"]["answers"] = given
    with pytest.raises(InputError, match=said):
        complete(settings, pressed.config)
