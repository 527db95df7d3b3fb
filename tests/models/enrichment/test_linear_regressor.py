"""The linear regressor is exact on what is linear, and blind to where a press is if its features are."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.models.enrichment.fitting import Fitting
from palpate.models.enrichment.paper_enrichment import LinearRegressor, fit_linear

TRAIN = np.arange(0, 18)


@pytest.fixture(scope="module")
def fitting(db, settings):
    return Fitting.of(db, TRAIN, "paper", settings)


@pytest.mark.parametrize("features", ["unordered", "ordered"])
def test_samples_and_their_multiples_are_reproduced(db, fitting, features):
    """18 samples, and no feature vector is shorter than 30; those in the contact's frame depend on each other here."""
    method = fit_linear(fitting, features)
    for i in (0, 7, 17):
        found = method.predict(0.5 * db.coarse_paper[i], int(db.contact[i]), db.force[i])
        assert found == pytest.approx(0.5 * db.fine[i], abs=1e-4 * db.peaks[i])


def test_it_is_the_map_of_least_norm(db, fitting):
    """Against the pseudoinverse of all training samples."""
    described = db.coarse_paper[TRAIN][:, db.coarse_surface].reshape(18, -1)
    expected = np.linalg.pinv(described, rcond=1e-6) @ db.fine[TRAIN].reshape(18, -1)
    for i in (20, 23):
        asked = db.coarse_paper[i][db.coarse_surface].ravel()
        found = LinearRegressor(fitting, "unordered").predict(db.coarse_paper[i], int(db.contact[i]), db.force[i])
        assert found.ravel() == pytest.approx(asked @ expected, abs=1e-3 * db.peaks[i])


def test_more_samples_than_numbers_are_fitted_by_least_squares(db, settings):
    short = replace(settings, neighbours=2)  # six numbers for 18 samples
    fitting = Fitting.of(db, TRAIN, "paper", short)
    found = fit_linear(fitting, "framed").predict(db.coarse_paper[20], int(db.contact[20]), db.force[20])
    assert np.isfinite(found).all() and np.linalg.norm(found, axis=1).max() < 3 * db.peaks[20]
