"""The part about a measured body follows from its table."""

import pytest
from fixtures.material import numbers


def test_errors_are_compared(measured_table):
    (found,) = numbers("measured", {"measured": measured_table})["experiments"]
    (given,), (finest,) = (list(found[name].itertuples()) for name in ("given", "finest"))
    assert (given.of, round(given.error, 3)) == ("quadratic elements (P2), 1701 nodes", 0.01)
    assert (finest.case, round(finest.error, 3)) == ("load", -0.05)
    (stepped,) = found["stepped"].itertuples()
    assert (stepped.predicted, stepped.measured) == pytest.approx((0.04717, 0.053)) and len(found["laws"]) == 1
