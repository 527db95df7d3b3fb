"""Limits of made-up series are found, with the ratio as it is, and the doubt covers what a scalar ratio misses."""

import numpy as np
import pytest

from palpate.benchmark.truth import doubt, limit, ratio


@pytest.fixture
def parts():
    """A limit (30, 3) and two shapes of error."""
    return np.random.default_rng(0).normal(size=(3, 30, 3))


@pytest.mark.parametrize("rate", [1.5, 2.0, 2.8, 4.0, 8.0])
def test_a_geometric_series_has_its_limit_and_no_doubt(parts, rate):
    truth, wrong, _ = parts
    levels = np.array([truth + wrong / rate**k for k in range(4)])
    assert ratio(levels) == pytest.approx(rate)  # not clipped, whatever it is
    assert np.allclose(limit(levels), truth) and np.allclose(limit(levels[:3]), truth)
    assert np.abs(doubt(levels)).max() < 1e-12 and np.abs(doubt(levels[:3])).max() < 1e-12


def test_a_diverging_series_shows_in_its_ratio(parts):
    truth, wrong, _ = parts
    assert ratio(np.array([truth, truth + wrong, truth + 3 * wrong])) == pytest.approx(0.5)
    assert np.isnan(ratio(np.array([truth] * 3)))
    assert np.array_equal(limit(np.array([truth] * 3)), truth) and not doubt(np.array([truth] * 3)).any()


@pytest.mark.parametrize("count", [3, 4])
def test_the_doubt_is_about_as_large_as_the_error_of_the_limit(parts, count):
    """Two shapes of error that fall at different rates, as those of an edge and of a smooth part do."""
    truth, edge, smooth = parts
    levels = np.array([truth + edge / 2.6**k + 0.5 * smooth / 5.0**k for k in range(count)])
    error, said = np.linalg.norm(limit(levels) - truth), np.linalg.norm(doubt(levels))
    assert error < said < 6 * error
