"""Blend weights sum to 1, reproduce training samples and never break."""

import numpy as np
import pytest
from scipy.optimize import nnls

from palpate.models.enrichment.paper_enrichment import (
    LITERAL,
    WEIGHTS,
    BlendWeights,
    gaussian,
    inverse,
    normalise,
    squared_distances,
)

RANDOM = np.random.default_rng(0)
KNOWN = RANDOM.normal(size=(15, 6))
SQUARED = squared_distances(KNOWN, KNOWN)
TWICE = KNOWN[[*range(15), 4, 4, 9]]


@pytest.mark.parametrize("sigma", [0.1, 0.5, 1.0, 2.0])
@pytest.mark.parametrize("kind", ["signed", "nonnegative_b"])
def test_training_samples_reproduce_themselves(kind, sigma):
    assert BlendWeights(kind, SQUARED, sigma)(SQUARED) == pytest.approx(np.eye(15), abs=1e-8)


@pytest.mark.parametrize("kind", WEIGHTS)
def test_narrow_kernels_give_the_nearest_sample(kind):
    query = KNOWN[6:7] + 1e-3
    assert BlendWeights(kind, SQUARED, 1e-2)(squared_distances(KNOWN, query)).ravel() == pytest.approx(
        np.eye(15)[6], abs=1e-12
    )


@pytest.mark.parametrize("sigma", np.geomspace(1e-12, 1e12, 13))
@pytest.mark.parametrize("kind", WEIGHTS)
@pytest.mark.parametrize("known", [KNOWN, TWICE], ids=["distinct", "duplicates"])
def test_weights_are_finite_and_sum_to_one(kind, sigma, known):
    away = 1e6 * sigma * np.array([1.0, -1, 1, 1, -1, 1])
    queries = np.vstack([known[:3], KNOWN.mean(axis=0), KNOWN[2] + away, KNOWN[5] - away])
    squared = squared_distances(known, queries)
    weights = BlendWeights(kind, squared_distances(known, known), sigma)(squared)
    assert np.isfinite(weights).all()
    # signed weights may be as large as 1 / CANCELLED, which leaves that much less of their sum
    assert weights.sum(axis=0) == pytest.approx(np.ones(len(queries)), abs=1e-11)
    if kind != "signed":
        assert (weights >= 0).all()


def test_one_query_equals_many():
    squared = squared_distances(KNOWN, RANDOM.normal(size=(4, 6)))
    for kind in WEIGHTS:
        weights = BlendWeights(kind, SQUARED, 1.0)
        many = weights(squared)
        for i in range(4):
            assert weights(squared[:, i]) == pytest.approx(many[:, i], abs=1e-12)


def test_duplicates_share_their_weight():
    weights = BlendWeights("signed", squared_distances(TWICE, TWICE), 1.0)(squared_distances(TWICE, KNOWN))
    assert weights[[4, 15, 16], 4] == pytest.approx(np.full(3, 1 / 3), abs=1e-8)
    assert weights[[9, 17], 9] == pytest.approx(np.full(2, 1 / 2), abs=1e-8)


def test_wide_kernels_tend_to_the_mean():
    for kind in ("signed", "clipped"):
        assert BlendWeights(kind, SQUARED, 1e10)(SQUARED) == pytest.approx(np.full((15, 15), 1 / 15))


def test_the_inverse_is_one_where_there_is_one():
    phi = np.exp(-SQUARED / 2)
    assert inverse(phi) @ phi == pytest.approx(np.eye(15), abs=1e-10)


def test_clipping_changes_negative_entries_only():
    phi = np.exp(-SQUARED / 8)
    assert (inverse(phi) < 0).any()
    unit_queries = BlendWeights("clipped", SQUARED, 2.0)(SQUARED)
    assert unit_queries == pytest.approx(normalise(np.maximum(inverse(phi), 0) @ phi, phi), abs=1e-9)


def test_the_nonnegative_matrix_is_the_nearest():
    """No column of A can be moved, within a ≥ 0, to bring Φ a closer to its unit vector."""
    phi = np.exp(-SQUARED / 8)
    matrix = BlendWeights("nonnegative_a", SQUARED, 2.0)._matrix
    gradient = phi.T @ (phi @ matrix - np.eye(15))
    assert (matrix >= 0).all()
    assert gradient.min() > -1e-12
    assert np.abs(gradient[matrix > 0]).max() < 1e-12


def test_cancelling_weights_fall_back_on_the_kernel_values():
    blend = np.array([[1.0, 2.0, 0.0], [-1.0, 2.0, 0.0]])
    w = np.array([[1.0, 1.0, 0.2], [0.25, 1.0, 0.6]])
    assert normalise(blend, w) == pytest.approx(np.array([[0.8, 0.5, 0.25], [0.2, 0.5, 0.75]]))


@pytest.mark.parametrize("sigma", [1.0, 2.0])
def test_equation_four_word_for_word_normalises_w_alone(sigma):
    """With A the true inverse, a training sample would be answered by itself over the sum of its kernel values."""
    phi = gaussian(SQUARED, sigma)
    matrix = np.column_stack([nnls(phi, unit)[0] for unit in np.eye(15)])
    expected = matrix @ (phi / phi.sum(axis=0))
    assert BlendWeights(LITERAL, SQUARED, sigma)(SQUARED) == pytest.approx(expected, abs=1e-12)
    sums = expected.sum(axis=0)
    assert abs(sums - 1.0).max() > 0.1
    assert BlendWeights("nonnegative_a", SQUARED, sigma)(SQUARED) == pytest.approx(expected / sums, abs=1e-12)
