"""Cross-validation holds out what the split holds out, and measures the error on the body."""

import numpy as np
import pytest

from palpate.models.enrichment.training_samples import convinces, gather


def test_folds_hold_out_whole_contacts(db, settings):
    fold = gather(db, "paper", settings.model_copy(update={"split": "contacts"})).fold
    for contact in np.unique(db.contact):
        assert len(set(fold[db.contact == contact])) == 1
    assert len(set(fold)) == 5


def test_scores_are_relative_errors_of_held_out_samples(db, settings):
    """A candidate that always answers with the first known sample, scored by hand."""
    training = gather(db, "paper", settings)

    def first(known, asked):
        weights = np.zeros((1, len(known), len(asked)))
        weights[:, 0] = 1
        return weights

    fine = db.fine.reshape(24, -1)
    guesses = db.fine[[np.flatnonzero(training.fold != fold)[0] for fold in training.fold]]
    by_hand = np.sqrt(np.mean(np.sum((guesses - db.fine) ** 2, axis=2), axis=1)) / db.peaks
    assert training.errors(fine @ fine.T, first) == pytest.approx(by_hand[None], rel=1e-8)


def test_a_gain_convinces_if_the_folds_agree_on_it():
    fold, plain = np.repeat(np.arange(5), 8), np.full(40, 0.05)
    assert convinces(plain - 1e-3, plain, fold)
    assert not convinces(plain, plain, fold) and not convinces(plain + 1e-3, plain, fold)
    one = plain - np.where(fold == 2, 0.02, 0.0)  # all of it at one place
    assert not convinces(one + 1e-9, plain, fold)
    unsure = np.random.default_rng(0).normal(size=40)
    unsure = np.array([unsure[fold == part].mean() for part in range(5)])[fold]
    assert not convinces(plain - 1e-3 * (unsure - unsure.mean() + 0.3 * unsure.std()), plain, fold)
    assert convinces(plain - 1e-3 * (unsure - unsure.mean() + unsure.std()), plain, fold)
