"""The shipped presses, whose answer is known, give it back; what follows is drawn and said."""

from pathlib import Path

import numpy as np
import pytest

from palpate.errors import InputError
from palpate.identification.relaxation import without_time
from palpate.run.settings import complete
from palpate.studies.measured import relaxed
from palpate.studies.measured.records import presses_of
from palpate.studies.measured.settings import Settings

ROOT = Path(__file__).parents[3]
SLAB = {"files": [str(ROOT / "examples/palpation/slab_presses.csv")], "branches": [1, 2], "draws": 10}
SLAB |= {"instrument": {"kind": "sphere", "radius_m": 0.005}, "thickness_m": [0.015, 0.015]}


def entry(**more):
    return Settings.model_validate({"presses": {"slab": SLAB | more}}).presses["slab"]


@pytest.fixture(scope="module")
def found():
    given = entry()
    records = presses_of(given)
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


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"instrument": None}, "ask has elastic, and forces are known for a sphere"),
        ({"instrument": {"kind": "punch", "radius_m": 0.005}}, "ask has elastic, and forces are known for a sphere"),
        ({"thickness_m": [0.02, 0.01]}, r"thickness_m is \[0\.02, 0\.01\]: give the least and the largest"),
        ({"poisson": [0.3, 0.5]}, r"poisson\[1\] is 0.5: .* less than 0.5"),
        ({"body": "spleen", "thickness_m": None}, "body is spleen, which is not in bodies"),
        ({"columns": {"force_n": "load"}}, "lacks the column load"),
    ],
)
def test_entries_that_do_not_fit_are_refused(change, message, tmp_path):
    with pytest.raises(InputError, match=message):
        complete({"seed": 1, "bodies": {}, "measured": {"presses": {"slab": SLAB | change}}}, tmp_path / "config.yaml")
