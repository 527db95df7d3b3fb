"""The kernel is a Gaussian, and stays one where double precision ends."""

import numpy as np
import pytest

from palpate.models.enrichment.paper_enrichment import gaussian, query_weights, squared_distances


def test_values_by_hand():
    squared = squared_distances(np.array([[0.0, 0.0], [3.0, 4.0]]), np.array([[0.0, 0.0]]))
    assert squared.ravel().tolist() == [0, 25]
    assert gaussian(squared, 5.0).ravel() == pytest.approx([1, np.exp(-0.5)])


@pytest.mark.parametrize("sigma", [1e-300, 1e-200, 1e-12, 1.0, 1e12, 1e200])
def test_no_sigma_makes_a_nan(sigma):
    values = gaussian(np.array([0.0, 1e-300, 1.0, 1e300]), sigma)
    assert values[0] == 1 and np.isfinite(values).all() and (values >= 0).all()


@pytest.mark.parametrize("away", [0.0, 1.0, 1e3, 1e6])
def test_the_nearest_sample_always_has_a_weight(away):
    known = np.random.default_rng(0).normal(size=(20, 6))
    query = known[3] + away * np.ones((1, 6))
    squared = squared_distances(known, query)
    weights = query_weights(squared, 1.0)
    assert weights.max() == 1 and np.isfinite(weights).all()
    if away == 0:
        assert weights == pytest.approx(gaussian(squared, 1.0))


def test_where_squares_overflow_all_samples_are_as_far():
    with np.errstate(over="ignore"):
        squared = squared_distances(np.array([[0.0], [1.0]]), np.array([[1e200]]))
    assert query_weights(squared, 1.0).ravel().tolist() == [1.0, 1.0]
