"""The shipped presses, whose answer is known, give it back; what follows is drawn and said."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from fixtures.drawn import texts
from fixtures.material import page

from palpate.errors import InputError
from palpate.identification.relaxation import without_time
from palpate.run.settings import complete
from palpate.studies.measured import pressed, relaxed
from palpate.studies.measured.figures.presses import draw_presses
from palpate.studies.measured.figures.relaxation import draw_relaxation
from palpate.studies.measured.settings import Settings

ROOT = Path(__file__).parents[3]
SLAB = {"files": [str(ROOT / "examples/palpation/slab_presses.csv")], "branches": [1, 2], "draws": 10}
SLAB |= {"instrument": {"kind": "sphere", "radius_m": 0.005}, "thickness_m": [0.015, 0.015]}


def entry(**more):
    return Settings.model_validate({"presses": {"slab": SLAB | more}}).presses["slab"]


@pytest.fixture(scope="module")
def found():
    given = entry()
    records = pressed.records_of(given)
    return relaxed.identify_relaxation("slab", records, given, 1), records


def test_the_branches_that_the_slab_was_made_with_are_within_their_intervals(found):
    rows = found[0][0]["relaxation"]
    chosen = rows[rows["chosen"]]
    for i, (share, time) in enumerate(zip([0.3, 0.2], [0.4, 4.0], strict=True)):
        row = chosen.iloc[i]
        assert row["share_low"] < share < row["share_high"] and row["time_low_s"] < time < row["time_high_s"]
    assert found[0][0]["relaxation_presses"]["branches"].median() == 2


def test_errors_are_those_of_the_noise(found):
    errors = found[0][0]["relaxation_errors"]
    medians = errors[errors["left_out"].eq("depth")].groupby("model")["error"].median()
    assert 0.01 < medians["2 branches"] < medians["1 branch"] < 0.05 < medians["no relaxation"]


def test_what_is_relaxed_has_the_force_of_the_slab(found):
    """The layer's exact force, of 4 kPa, up to the strength of each place and its offset: 5 % and 2 % of force."""
    from fixtures.indented_layer import indented, sphere

    (_, kernel), records = found
    exact = np.array([indented(sphere(0.005), c, 4000.0, 0.45, 0.015) for c in np.linspace(0.0012, 0.0032, 12)])
    ratios = []
    for press in without_time(records, kernel).presses:
        ratios.append(press.force_n[-1] / np.interp(press.depth_m[-1] + 5e-5, *exact.T))
    assert np.median(ratios) == pytest.approx(1.0, abs=0.06)


def test_relaxation_is_drawn_and_said(found):
    tables = found[0][0]
    shown = [tables[f"relaxation{part}"] for part in ("_curves", "_errors", "_presses", "_trends")]
    words = texts(draw_relaxation(*shown, scene="slab"))
    assert "left out: the deeper half" in words and "2 branches" in words
    said = " ".join(page("measured", tables).split())
    assert "8 presses fall to 69 % of their largest force" in said
    assert "2 branches predict the deeper half within" in said


def test_presses_are_drawn_and_said():
    curves = pd.DataFrame(
        [["slab", "all", f"p{k}", "", 0.01 * k, 0.0, d, k * d, k * d, 0.9 * k * d, 1.1 * k * d]
         for k in (1, 2, 3) for d in (0.0, 0.001, 0.002)], columns=pressed.PRESS_CURVES.columns)  # fmt: skip
    told = [["slab", "all", way, model, "p1", error, 0.0] for way in ("place", "depth")
            for model, error in (("neo_hookean", 0.1), ("power_law", 0.2), ("neighbour", 0.05))]  # fmt: skip
    predictions = pd.DataFrame(told, columns=pressed.PRESS_PREDICTIONS.columns)
    rows = [["slab", "all", "neo_hookean", True, "young_pa", "Pa", 3500.0, 4000.0, 4500.0, True, False, False, 0, 0],
            ["slab", "all", "neo_hookean", True, "poisson", "1", 0.3, 0.4, 0.49, False, True, True, 0, 0],
            ["slab", "all", "neo_hookean", True, "place_scatter", "1", np.nan, 0.05, *6 * [np.nan]],
            ["slab", "all", "neo_hookean", True, "exponent_excess", "1", -0.1, 0, 0.1, True, *4 * [0]]]  # fmt: skip
    tables = {"presses": pd.DataFrame(rows, columns=pressed.PRESSES.columns)}
    tables |= {"press_curves": curves, "press_predictions": predictions}
    words = texts(draw_presses(curves, predictions, scene="slab"))
    assert "the nearest place (floor)" in words and "3 of 3 presses" in words
    said = " ".join(page("measured", tables).split())
    assert "E is 4 kPa (3.5 kPa to 4.5 kPa) under neo hookean; poisson cannot be told from these presses" in said
    assert "Places left out: neo hookean misses force by 10 % (power law 20 %, the nearest place (floor) 5 %)" in said


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"instrument": None}, "ask has elastic, and instrument is null"),
        ({"instrument": {"kind": "punch", "radius_m": 0.005}}, "instrument is a punch; forces are known for a sphere"),
        ({"thickness_m": [0.02, 0.01]}, r"thickness_m is \[0\.02, 0\.01\]; give the least and the largest"),
        ({"poisson": [0.3, 0.5]}, "poisson or sticking out of range"),
        ({"body": "spleen"}, "body is spleen, which is not in bodies"),
        ({"files": ["nothing.csv"]}, r"nothing\.csv"),
        ({"columns": {"force_n": "load"}}, "lacks the column load"),
        ({"instrument": {"kind": "sphere", "radius_m": 0.5}}, "the ball has a radius of 0.5 m"),
    ],
)
def test_entries_that_do_not_fit_are_refused(change, message, tmp_path):
    with pytest.raises(InputError, match=message):
        complete({"seed": 1, "bodies": {}, "measured": {"presses": {"slab": SLAB | change}}}, tmp_path / "config.yaml")
