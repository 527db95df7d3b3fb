"""The scale: found where it is there, and left alone where nothing is to be learnt."""

import numpy as np
import pytest

from palpate.models.enrichment.detail_correction import Scale, fit_scale
from palpate.models.enrichment.fitting import Training

BETA = np.array([0.4, -0.7])


@pytest.fixture
def world():
    """40 samples of 10 contacts whose detail is applied 1 + β · (ratios − 1) times; folds hold out contacts."""
    random = np.random.default_rng(0)
    contact = np.repeat(np.arange(10), 4)
    detail = 1e-3 * random.normal(size=(40, 30, 3))
    ratios = 1.0 + 0.2 * random.normal(size=(40, 2))
    peaks = random.uniform(0.01, 0.03, 40)
    empty = np.zeros((40, 0, 3))
    training = Training(empty, empty, contact, np.zeros((40, 3)), peaks, contact % 5)
    return random, ratios, detail, training


def scaled(beta, ratios, detail):
    return (1.0 + (ratios - 1.0) @ beta)[:, None, None] * detail


def test_finds_a_known_scale(world):
    _, ratios, detail, training = world
    found = fit_scale(ratios, detail, scaled(BETA, ratios, detail), training)
    assert found.beta == pytest.approx(BETA, rel=1e-5)


def test_finds_it_under_noise(world):
    random, ratios, detail, training = world
    missing = scaled(BETA, ratios, detail) + 3e-4 * random.normal(size=detail.shape)
    assert fit_scale(ratios, detail, missing, training).beta == pytest.approx(BETA, abs=0.05)


def test_counts_samples_by_relative_error(world):
    """Half the samples want another scale, but matter less since they move far more."""
    _, ratios, detail, training = world
    other = np.arange(40) % 2 == 1
    missing = scaled(BETA, ratios, detail)
    missing[other] = scaled(-BETA, ratios, detail)[other]
    training.peaks[other] = 1e3
    assert fit_scale(ratios, detail, missing, training).beta == pytest.approx(BETA, rel=1e-4)


def test_learns_nothing_from_nothing(world):
    random, ratios, detail, training = world
    assert not fit_scale(ratios, detail, detail, training).beta.any()  # the detail is right as it is
    assert not fit_scale(np.ones_like(ratios), detail, 2 * detail, training).beta.any()  # ratios say nothing
    assert not fit_scale(ratios, np.zeros_like(detail), detail, training).beta.any()  # there is no detail
    noise = random.normal(size=detail.shape)
    found = fit_scale(ratios, detail, detail + 1e-3 * noise, training)
    assert np.abs(found.beta).max() < 0.2


def test_does_not_believe_what_other_contacts_contradict(world):
    """Each fold wants the opposite of the rest: no scale generalises, so none is applied."""
    _, ratios, detail, training = world
    sign = np.where(training.contact % 2, 1.0, -1.0)
    missing = (1.0 + sign * ((ratios - 1.0) @ BETA))[:, None, None] * detail
    alternating = Training(
        *[getattr(training, n) for n in ("coarse", "fine", "contact", "force", "peaks")], training.contact % 2
    )
    assert not fit_scale(ratios, detail, missing, alternating).beta.any()


def test_bounds_are_those_of_the_samples_only_where_that_helps_at_other_contacts(world):
    """A scale that saturates at a contact of large ratios is bounded; one that goes on growing is not."""
    _, ratios, detail, training = world
    ratios = ratios.copy()
    ratios[training.contact % 5 == 0, 0] += 2.0  # a fold beyond all others
    beta = np.array([0.5, 0.0])
    growing = fit_scale(ratios, detail, scaled(beta, ratios, detail), training)
    assert growing.beta == pytest.approx(beta, abs=1e-3) and np.isinf([growing.low, growing.high]).all()
    within = np.minimum(ratios, 1.3)
    saturated = fit_scale(ratios, detail, scaled(beta, within, detail), training)
    assert np.isfinite([saturated.low, saturated.high]).all()
    assert saturated.of(np.array([9.0, 1.0])) == saturated.high < Scale(saturated.beta).of(np.array([9.0, 1.0]))
