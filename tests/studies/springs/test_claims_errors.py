"""Claims on errors are judged from the tables, and the paper's bound is said to be one that no motion meets."""

import pandas as pd
import pytest

from palpate.studies.springs.claims import presses


@pytest.fixture
def tables():
    """Errors that grow to 0.1 mm on the fitted press and 0.3 mm on another, of displacements of 0.6 mm."""
    errors = [
        ["genetic", False, 1, press, press == "top", step, *[most * step / 8] * 3, most * step / 8, 6e-4]
        for press, most in (("top", 1e-4), ("left", 3e-4))
        for step in range(1, 9)
    ]
    names = "method volume_force seed press used_in_fit step error_x_m error_y_m error_z_m most_m zero_m"
    fits = [["genetic", False, "top", True, 1e-4], ["genetic", False, "left", False, 3e-4]]
    fit_names = ["method", "volume_force", "press", "used_in_fit", "rmse_m"]
    return {
        "spring_errors": pd.DataFrame(errors, columns=names.split()),
        "spring_fit": pd.DataFrame(fits, columns=fit_names),
    }


def test_each_claim_has_its_verdict(tables):
    grown, bound, scaled, least, sign = presses(tables)
    assert [c.verdict for c in (grown, bound, scaled, least)] == [
        "confirmed", "true as a bound", "confirmed", "confirmed",
    ]  # fmt: skip
    assert bound.ours == "0.3 mm at most; without any motion 0.6 mm"
    assert scaled.ours == "top 0.1 of 0.6 mm, left 0.3 of 0.6 mm"
    assert sign.verdict == "refuted" and "further apart" in sign.ours


def test_other_errors_refute_them(tables):
    errors = tables["spring_errors"]
    errors.loc[errors["step"] == 8, ["error_x_m"]] = 0.0
    errors.loc[(errors["step"] >= 7) & (errors["press"] == "top"), "error_x_m"] = 0.0
    errors["most_m"] *= 30.0
    tables["spring_fit"]["rmse_m"] = [3e-4, 1e-4]
    assert [claim.verdict for claim in presses(tables)][:4] == ["refuted"] * 4
