"""Bounds hold as often as they say, for contacts and not for samples, and are no larger than they must be."""

import numpy as np
import pytest

from palpate.benchmark.conformal import DRAWS, FEWEST, LEVEL, Draws, bound_factor, bounds, finite


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


def test_too_few_contacts_have_no_bound_and_are_not_tried():
    scores = np.ones(3 * (FEWEST - 1))
    assert bound_factor(scores, np.repeat(np.arange(FEWEST - 1), 3)) == np.inf
    assert bound_factor(np.empty(0), np.empty(0, dtype=int)) == np.inf
    assert np.isnan(finite(np.inf)) and finite(2.0) == 2.0
    tried = Draws(np.repeat(np.arange(FEWEST), 3)).coverage(np.ones(27), np.ones(27))
    assert np.isnan(tried).all()


def test_coverage_is_that_of_contacts_that_were_held_out():
    """Of ten contacts the one of the largest scores is missed when it is held out, whatever else happens."""
    random = np.random.default_rng(1)
    errors, contact = drawn(random, 10)
    found = Draws(contact).coverage(errors, np.ones(30))
    assert found.coverage_of_contacts == pytest.approx(0.9, abs=3 * np.sqrt(0.09 / DRAWS))
    assert 0.9 - 0.06 <= found.coverage <= 0.97 + 0.02
    assert Draws(contact).coverage(errors, np.ones(30)) == found  # seeded


def test_an_estimate_that_knows_the_error_is_sharper():
    random = np.random.default_rng(2)
    errors, contact = drawn(random, 24)
    draws = Draws(contact)
    flat, knowing = (draws.coverage(errors, estimate) for estimate in (np.ones(72), 7.0 * errors))
    assert knowing.sharpness == pytest.approx(1.0) and knowing.coverage == 1.0
    assert flat.sharpness > 2.0 and 0.8 < flat.coverage < 1.0


@pytest.mark.parametrize(("contacts", "known"), [(10, 9), (19, 9), (20, 19), (24, 19), (29, 19), (48, 39)])
def test_so_many_contacts_calibrate_that_no_more_than_a_tenth_is_left_over(contacts, known):
    """One sample a contact, all different: of 9 the largest of 9 is the bound, of 19 the second largest."""
    scores = np.random.default_rng(3).permutation(np.arange(1.0, contacts + 1))
    draws = Draws(np.arange(contacts))
    found = draws.coverage(scores, np.ones(contacts))
    assert found.coverage == pytest.approx(0.9, abs=0.03) == found.coverage_of_contacts
    assert (~draws._tried).sum(axis=1).tolist() == [known] * DRAWS


def test_rows_of_which_other_contacts_are_known_have_the_bounds_that_they_have_alone():
    random = np.random.default_rng(4)
    errors, contact = random.random((5, 36)), np.repeat(np.arange(12), 3)
    errors[1, contact < 2] = errors[3, contact < 2] = errors[2, contact < 4] = np.nan
    alone = [bound_factor(row[np.isfinite(row)], contact[np.isfinite(row)]) for row in errors]
    assert bounds(errors, contact).tolist() == alone and np.isinf(alone[2]) and np.isfinite(alone[1])
