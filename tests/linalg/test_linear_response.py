"""Linear responses: several at once, loads that are zero, and a solution that was not found."""

import numpy as np
import pytest

from palpate.errors import NotConverged
from palpate.linalg.conjugate_gradients import linear_response

DIAGONAL = np.linspace(1.0, 5.0, 30).reshape(10, 3)


def multiply(x):
    return (DIAGONAL if x.ndim == 2 else DIAGONAL[:, :, None]) * x


def nothing(x):
    return x


def test_a_load_of_zero_among_others_moves_nothing():
    loads = np.random.default_rng(0).normal(size=(10, 3, 4))
    loads[:, :, 2] = 0.0
    found = linear_response(multiply, nothing, loads, 1e-10)
    assert found == pytest.approx(loads / DIAGONAL[:, :, None], abs=1e-8)
    assert not found[:, :, 2].any() and not linear_response(multiply, nothing, loads[:, :, 2], 1e-10).any()


def test_what_does_not_converge_is_an_error():
    loads = np.ones((10, 3, 2))
    loads[0, 0, 1] = np.nan
    for right in (loads, loads[:, :, 1]):
        with pytest.raises(NotConverged, match="relative residual of nan, above the tolerance"):
            linear_response(multiply, nothing, right, 1e-10)
    with pytest.raises(NotConverged, match="stopped after 1 products"):
        linear_response(lambda x: -multiply(x), nothing, loads[:, :, :1], 1e-10)
