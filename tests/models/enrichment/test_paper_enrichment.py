"""Blend weights sum to 1, reproduce training samples and never break."""

import numpy as np
import pytest
from scipy.optimize import nnls

from palpate.models.enrichment.paper_enrichment import (
    LITERAL,
    WEIGHTS,
    BlendWeights,
    LinearRegressor,
    gaussian,
    inverse,
    squared_distances,
)
from palpate.models.enrichment.ridge import dual_weights
from palpate.models.enrichment.training_samples import gather

RANDOM = np.random.default_rng(0)
KNOWN = RANDOM.normal(size=(15, 6))
SQUARED = squared_distances(KNOWN, KNOWN)
TWICE = KNOWN[[*range(15), 4, 4, 9]]


@pytest.mark.parametrize("sigma", np.geomspace(1e-12, 1e12, 5))
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
    for weights in (BlendWeights(kind, SQUARED, 1.0) for kind in WEIGHTS):
        one_by_one = np.column_stack([weights(column) for column in squared.T])
        assert one_by_one == pytest.approx(weights(squared), abs=1e-12)


def test_kernel_values_that_are_denormal_are_borne():
    """By the inverse and by ridges. Of 24 000 such matrices this is the one on which numpy's eigh does not converge."""
    rng = np.random.default_rng(742)
    x = np.repeat(rng.normal(size=(12, 12)), 3, axis=0) * rng.choice([1.0, 0.8, 0.6], size=36)[:, None]
    x += rng.normal(scale=0.01, size=(36, 12))
    squared = ((x[:, None] - x) ** 2).sum(axis=-1)
    phi = np.exp(-squared / np.median(squared) * 700)
    assert phi @ inverse(phi) @ phi == pytest.approx(phi, abs=1e-10)
    assert phi @ dual_weights(phi, phi, np.array([1e-14]))[0] == pytest.approx(phi, abs=1e-10)


def test_the_inverse_is_one_where_there_is_one():
    phi = np.exp(-SQUARED / 2)
    assert inverse(phi) @ phi == pytest.approx(np.eye(15), abs=1e-10)


def test_the_nonnegative_matrix_is_the_nearest():
    """No column of A can be moved, within a ≥ 0, to bring Φ a closer to its unit vector."""
    phi = np.exp(-SQUARED / 8)
    matrix = BlendWeights("nonnegative_a", SQUARED, 2.0)._matrix
    gradient = phi.T @ (phi @ matrix - np.eye(15))
    assert (matrix >= 0).all()
    assert gradient.min() > -1e-12
    assert np.abs(gradient[matrix > 0]).max() < 1e-12


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


def test_values_by_hand():
    squared = squared_distances(np.array([[0.0, 0.0], [3.0, 4.0]]), np.array([[0.0, 0.0]]))
    assert squared.ravel().tolist() == [0, 25]
    assert gaussian(squared, 5.0).ravel() == pytest.approx([1, np.exp(-0.5)])


TRAIN = np.arange(0, 18)


@pytest.fixture(scope="module")
def training(db, settings):
    return gather(db.take(TRAIN), "paper", settings)


@pytest.mark.parametrize("features", ["unordered", "ordered"])
def test_samples_and_their_multiples_are_reproduced(db, training, features):
    """18 samples, and no feature vector is shorter than 30; those in the contact's frame depend on each other here."""
    method = LinearRegressor(training, features)
    for i in (0, 7, 17):
        found = method.predict(0.5 * db.coarse_paper[i], int(db.contact[i]), db.force[i])
        assert found == pytest.approx(0.5 * db.fine[i], abs=1e-4 * db.peaks[i])


def test_it_is_the_map_of_least_norm(db, training):
    """Against the pseudoinverse of all training samples."""
    described = db.coarse_paper[TRAIN][:, db.coarse_surface].reshape(18, -1)
    expected = np.linalg.pinv(described, rcond=1e-6) @ db.fine[TRAIN].reshape(18, -1)
    for i in (20, 23):
        asked = db.coarse_paper[i][db.coarse_surface].ravel()
        found = LinearRegressor(training, "unordered").predict(db.coarse_paper[i], int(db.contact[i]), db.force[i])
        assert found.ravel() == pytest.approx(asked @ expected, abs=1e-3 * db.peaks[i])


def test_more_samples_than_numbers_are_fitted_by_least_squares(db, settings):
    short = settings.model_copy(update={"neighbours": 2})  # six numbers for 18 samples
    method = LinearRegressor(gather(db.take(TRAIN), "paper", short), "framed")
    found = method.predict(db.coarse_paper[20], int(db.contact[20]), db.force[20])
    assert np.isfinite(found).all() and np.linalg.norm(found, axis=1).max() < 3 * db.peaks[20]
