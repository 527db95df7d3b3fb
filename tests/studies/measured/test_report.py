"""The part about a measured body follows from its table."""

import pytest
from fixtures.material import failures, numbers, page


def text(table):
    return " ".join(page("measured", {"measured": table}).split())


def test_the_finding_is_about_what_was_not_fitted(measured_table):
    assert (
        "Beam: fitted to gravity alone, quadratic elements predict other places and frequencies within 5 %, all within "
        "the measurement's uncertainty."
    ) in text(measured_table)
    assert "within 5 %, 1 of 2 beyond the" in text(measured_table.assign(uncertainty=0.02))
    assert "could be tested on." in text(measured_table[measured_table["calibrated"] == "no"])


def test_errors_are_compared(measured_table):
    (found,) = numbers("measured", {"measured": measured_table})["experiments"]
    (given,), (finest,) = (list(found[name].itertuples()) for name in ("given", "finest"))
    assert (given.of, round(given.error, 3)) == ("quadratic elements (P2), 1701 nodes", 0.01)
    assert (finest.case, round(finest.error, 3)) == ("load", -0.05)
    (stepped,) = found["stepped"].itertuples()
    assert (stepped.predicted, stepped.measured) == pytest.approx((0.04717, 0.053)) and len(found["laws"]) == 1
    assert "0.047 for 0.053 (gravity, steps of 2 ms)" in text(measured_table)


def test_a_model_without_an_answer_has_failed(measured_table):
    assert failures("measured", {"measured": measured_table}) == []
    failed = failures("measured", {"measured": measured_table.assign(message="stopped")})
    assert failed[0] == ("quadratic elements (P2), 1701 nodes", "beam, gravity", "stopped")
