"""Bounds hold as often as they say, for contacts and not for samples, and are no larger than they must be."""

import numpy as np
import pytest

from palpate.benchmark.conformal import FEWEST, LEVEL, bound_factor, finite


def drawn(random, contacts, presses=3, spread=1.0):
    """Errors of ``presses`` at each contact, which differ less from one another than contacts do."""
    own = np.exp(spread * random.standard_normal(contacts))
    errors = own[:, None] * np.exp(0.1 * random.standard_normal((contacts, presses)))
    return errors.ravel(), np.repeat(np.arange(contacts), presses)


@pytest.mark.parametrize("known", [9, 12, 24])
def test_a_new_answer_at_a_new_contact_is_below_its_bound_nine_times_in_ten(known):
    """With n contacts the share lies between LEVEL and LEVEL + 2 / (n + 1): counted over 2000 sets of contacts."""
    random = np.random.default_rng(0)
    kept = []
    for _ in range(2000):
        errors, contact = drawn(random, known + 1)
        old = contact < known
        kept.append(errors[-1] <= bound_factor(errors[old], contact[old]))
    assert LEVEL - 0.02 <= np.mean(kept) <= LEVEL + 2 / (known + 1) + 0.02


def test_samples_are_no_contacts():
    """Thirty presses at ten contacts are no thirty contacts: their plain 90 % quantile is too small a bound."""
    random = np.random.default_rng(0)
    plain = []
    for _ in range(1000):
        errors, contact = drawn(random, 11)
        known = np.sort(errors[contact < 10])
        plain.append(errors[-1] <= known[int(np.ceil(0.9 * 31)) - 1])
    assert np.mean(plain) < LEVEL - 0.01


def test_it_is_the_weighted_quantile():
    """Nine contacts: their largest; nineteen of one sample: the eighteenth, as 18 of 20 are 0.9."""
    scores = np.arange(1.0, 20.0)
    assert bound_factor(scores[:9], np.arange(9)) == 9.0
    assert bound_factor(scores, np.arange(19)) == 18.0
    many = np.concatenate([scores, np.full(60, 5.0)])  # many samples at a contact are still one contact
    assert bound_factor(many, np.concatenate([np.arange(19), np.full(60, 4)])) == 18.0


def test_too_few_contacts_have_no_bound():
    scores = np.ones(3 * (FEWEST - 1))
    assert bound_factor(scores, np.repeat(np.arange(FEWEST - 1), 3)) == np.inf
    assert np.isnan(finite(np.inf)) and finite(2.0) == 2.0
