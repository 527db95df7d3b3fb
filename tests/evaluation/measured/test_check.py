"""An entry that cannot be measured is refused before anything runs, in one sentence."""

from copy import deepcopy
from pathlib import Path

import pandas as pd
import pytest

from palpate.config import complete
from palpate.errors import InputError
from palpate.schema import read_schema
from palpate.settings_file import read_settings

ROOT = Path(__file__).parents[3]
SCHEMA = read_schema(ROOT / "workflow/schemas/config.schema.yaml")


@pytest.fixture(scope="module")
def shipped() -> dict:
    """The shipped beam and its experiment, alone."""
    settings = read_settings(ROOT / "config.yaml")
    return {"bodies": {"beam": settings["bodies"]["beam"]}, "measured": settings["measured"]}


@pytest.fixture
def settings(shipped) -> dict:
    return deepcopy(shipped)


def refusal(settings: dict) -> str:
    with pytest.raises(InputError) as refused:
        complete(settings, SCHEMA, ROOT / "config.yaml")
    return str(refused.value).removeprefix(f"{ROOT}/config.yaml: ").replace(f"{ROOT}/", "")


def test_the_shipped_experiment_is_accepted_and_a_case_is_one_line(settings):
    cases = settings["measured"]["experiments"]["beam"]["cases"]
    cases["heavier"] = {"loads": [{"weight_n": 0.8, "line_m": [[0.1, 0, 0.03], [0.1, 0.03, 0.03]]}]}
    found = complete(settings, SCHEMA, ROOT / "config.yaml")["measured"]["experiments"]["beam"]
    assert found["cases"]["heavier"]["files"] == [] and found["cases"]["heavier"]["loads"][0]["radius_m"] == 0


def test_what_does_not_exist_is_named(settings):
    entry = settings["measured"]["experiments"]["beam"]
    entry["cases"]["gravity"]["files"][0] = "examples/beam/none.csv"
    assert refusal(settings).startswith(
        "measured.experiments.beam.cases.gravity.files is examples/beam/none.csv, where"
    )
    entry["body"] = "bam"
    assert refusal(settings) == "measured.experiments.beam.body is bam, which is not in bodies; did you mean beam?"


def test_levels_that_the_body_lacks_are_named(settings):
    settings["measured"]["models"] = {"fem_p2": {"levels": [2]}}
    assert "measured.models.fem_p2.levels names level 2, and the body beam has levels 0 to 2" in refusal(settings)


def test_millimetres_are_noticed(settings, tmp_path):
    entry = settings["measured"]["experiments"]["beam"]
    table = pd.read_csv(ROOT / "examples/beam/gravity_a.csv")
    table.iloc[:, 1:] *= 1000
    table.to_csv(tmp_path / "mm.csv", index=False)
    entry["cases"]["gravity"]["files"] = [str(tmp_path / "mm.csv")]
    said = refusal(settings)
    assert "see whether both are in metres" in said and "mm.csv" in said


def test_a_marker_that_a_file_lacks_is_named(settings):
    settings["measured"]["experiments"]["beam"]["markers"]["m7"] = {"at_m": [0.05, 0.015, 0.036]}
    assert "gravity_a.csv lacks the column m7_x_m" in refusal(settings)
