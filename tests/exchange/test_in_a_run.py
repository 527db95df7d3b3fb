"""A run that names files of answers has their table and figure; its own tables are untouched."""

from types import SimpleNamespace

import numpy as np
import pytest
from exchange.conftest import files_of

from palpate.benchmark.engine_scores import ANSWERS
from palpate.report import tables
from palpate.run.job import write_table
from palpate.studies.tradeoff.jobs import tabulate_answers


@pytest.fixture
def asked(rows_of_run, answers, tmp_path):
    """What the rule gives its job."""
    np.savez(tmp_path / "engine.npz", **answers)
    scenes = {"block_large": ("large", 0.03, [str(tmp_path / "engine.npz")])}
    listed = {name: [str(path)] for name, path in files_of(rows_of_run).items()}
    return SimpleNamespace(table=str(rows_of_run / "tables/accuracy_vs_time.csv"), **listed), scenes, 1


def test_the_table_has_the_engine_s_rows_alone(asked, tmp_path):
    found = tabulate_answers(*asked)["table"]
    assert found.columns.tolist() == ANSWERS.columns and found["engine"].tolist() == ["Elsewhere"] * 3
    assert found["hardware"].tolist() == ["a graphics card"] * 3 and (found["law"] == "corotational").all()
    write_table(found, tmp_path / "answers.csv")
    again = tables.read(tmp_path / "answers.csv")
    assert again["rmse_of_peak"].to_numpy() == pytest.approx(found["rmse_of_peak"].to_numpy())
