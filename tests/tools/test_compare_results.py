"""Tables of two runs are the same if they differ in times only."""

import pandas as pd
import pytest
from tools.compare_results import differences


@pytest.fixture
def runs(tmp_path):
    """Two runs' folders, each with one table."""
    made = []
    for name, took in (("one", 0.1), ("other", 0.2)):
        folder = tmp_path / name
        folder.mkdir()
        table = {"model": ["a", "b"], "rmse_m": [0.1, None], "time_s": [0.0, 1.0]}
        table |= {"seconds": took, "online_p95_s": took}
        pd.DataFrame(table).to_csv(folder / "found.csv", index=False)
        made.append(folder)
    return made


def test_times_may_differ(runs):
    assert differences(*runs) == []


@pytest.mark.parametrize("column, value", [("model", "c"), ("rmse_m", 0.1 + 1e-16 * 2), ("time_s", 0.5)])
def test_nothing_else_may(runs, column, value):
    path = runs[1] / "found.csv"
    table = pd.read_csv(path)
    table.loc[0, column] = value
    table.to_csv(path, index=False)
    assert differences(*runs) == [f"found.csv: {column}"]


def test_no_table_may_be_missing(runs):
    (runs[1] / "found.csv").unlink()
    assert differences(*runs) == ["found.csv is missing"]
    assert "has no tables" in differences(runs[1], runs[0])[0]
