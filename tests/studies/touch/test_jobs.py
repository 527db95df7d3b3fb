"""Tables of touches: own errors of truths, means without a sign, and bounds."""

import numpy as np
import pandas as pd
import pytest

from palpate.benchmark.conformal import FEWEST
from palpate.benchmark.ranking import OWN_ERROR, TRUTH
from palpate.benchmark.touch import TouchErrors, TouchTruth
from palpate.benchmark.touch_measure import TOUCH, Touches
from palpate.studies.touch.jobs import (
    BOUNDED,
    TOUCH_FORCES,
    touch_force_rows,
    touch_table,
    touch_truth_row,
)

OWN = np.array([0.001, 0.002, 0.003, 0.004, 0.005, 0.006, 0.007])
LABELS = {"scene": "liver_sphere_8mm", "body": "liver", "instrument": "sphere", "radius_m": 0.008}


def truth() -> TouchTruth:
    """Three touches, the own errors of the second twice those of the first, the third rejected."""
    arrays = {name: np.arange(1.0, 4.0) for name in TouchTruth.__dataclass_fields__}
    arrays |= {"own": np.outer([1, 2, np.nan], OWN), "force": np.array([[0.5, 1], [1, 2], [np.nan, np.nan]])}
    return TouchTruth(**arrays | {"rejected": np.array(["", "", "no answer on a mesh (why)"], dtype=object)})


def touches() -> pd.DataFrame:
    table = {"sample": [0, 1, 2], "node": [5, 6, 7], "direction_x": 0.0, "direction_y": 0.0, "direction_z": -1.0}
    return pd.DataFrame(table | {"depth_m": [0.002, 0.003, 0.004], "asked_m": [0.002, 0.003 / 0.7, 0.004]})


def test_each_touch_has_its_force_and_place():
    rows = TOUCH_FORCES.frame(touch_force_rows(LABELS, touches(), truth(), np.arange(9.0).reshape(3, 3)))
    assert list(rows) == TOUCH_FORCES.columns and list(rows["x_m"]) == [0.0, 3.0, 6.0]
    assert list(rows["force_n"][:2]) == [1.0, 2.0] and list(rows["force_before_n"][:2]) == [0.5, 1.0]
    assert rows["force_error"][1] == pytest.approx(2 * OWN[TouchErrors._fields.index("force_error")])


def test_own_errors_are_those_of_touches_that_are_believed():
    row = touch_truth_row(LABELS | {"edge_m": 0.0, "length_m": 0.0}, touches(), truth())
    assert (row["samples"], row["rejected"], row["lowered"]) == (2, 1, 1)
    assert row["why_rejected"] == "1 no answer on a mesh"
    for name in ("rmse_of_peak", "patch_rms_of_peak", "force_error", "stiffness_error"):
        own = OWN[TouchErrors._fields.index(name)]
        assert row[name] == pytest.approx(1.5 * own) and row[f"{name}_max"] == pytest.approx(2 * own)
    assert row["area_error"] == pytest.approx(1.5 * OWN[-1])
    assert (row["depth_max_m"], row["force_min_n"], row["force_max_n"]) == (0.003, 1, 2)
    assert (row["order"], row["least_det"], row["nodes"], row["seconds"]) == (1.5, 1, 3, 2)


def rows(count: int, failed=()) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Answers of one setting whose force errs by ± 1, 2, ... per cent, and of the truth, which errs by 0.1 %."""
    signs = np.where(np.arange(count) % 2, -0.01, 0.01) * np.arange(1, count + 1)
    both = []
    for model, setting, errors in ((TRUTH, OWN_ERROR, np.full(count, 0.001)), ("fem", "level=1", signs)):
        part = pd.DataFrame(LABELS | {"model": model, "setting": setting}, index=range(count))
        part = part.reindex(columns=Touches.columns_of_questions(LABELS)).assign(sample=range(count), failure="")
        both.append(part.assign(**{name: errors for name in TouchErrors._fields}))
    both[1].loc[list(failed), "failure"] = "lost"
    named = {"model": TRUTH, "setting": OWN_ERROR}, {"model": "fem", "setting": "level=1"}
    return TOUCH.frame(LABELS | name for name in named), pd.concat(both)


def test_means_have_no_sign_and_bounds_the_own_error():
    own, fem = touch_table(*rows(FEWEST)).to_dict("records")
    assert fem["force_error_size"] == pytest.approx(0.01 * np.arange(1, FEWEST + 1).mean())
    assert fem["force_error_bound"] == pytest.approx(0.01 * FEWEST + 0.001)  # of nine, the worst
    assert own["force_error_bound"] == pytest.approx(0.001) == own["force_error_size"]


def test_bounds_are_tried_on_touches_that_they_were_not_found_on():
    few, many = (touch_table(*rows(count)).iloc[1]["force_error_coverage"] for count in (FEWEST, 30))
    assert np.isnan(few) and 0.8 < many < 1.0


def test_there_is_no_bound_of_few_touches_or_after_a_failure():
    for asked in (rows(FEWEST - 1), rows(FEWEST, failed=[2])):
        fem = touch_table(*asked).iloc[1]
        assert fem[[f"{name}_bound" for name in BOUNDED]].isna().all() and np.isfinite(fem["force_error_size"])
