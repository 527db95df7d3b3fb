"""Splits are exact, disjoint and repeatable."""

import numpy as np
import pytest

from palpate.benchmark.split import split
from palpate.errors import InputError

CONTACT = np.repeat(np.arange(100, 135), 3)


@pytest.mark.parametrize("kind", ["samples", "contacts"])
def test_counts_are_exact_and_sides_disjoint(kind):
    train, test = split(CONTACT, 60, 45, kind, 3)
    assert (len(train), len(test)) == (60, 45)
    assert np.array_equal(np.sort(np.concatenate([train, test])), np.arange(105))
    again = split(CONTACT, 60, 45, kind, 3)
    assert np.array_equal(train, again[0]) and np.array_equal(test, again[1])
    assert not np.array_equal(test, split(CONTACT, 60, 45, kind, 4)[1])


def test_contacts_are_held_out_whole():
    train, test = split(CONTACT, 60, 45, "contacts", 0)
    assert not set(CONTACT[train]) & set(CONTACT[test])


def test_samples_share_contacts():
    train, test = split(CONTACT, 60, 45, "samples", 0)
    assert set(CONTACT[train]) & set(CONTACT[test])


def test_contacts_with_unequal_counts_add_up():
    contact = np.repeat([4, 7, 9, 11, 12], [5, 3, 3, 2, 1])
    for seed in range(10):
        train, test = split(contact, 7, 7, "contacts", seed)
        assert len(test) == 7 and not set(contact[train]) & set(contact[test])


@pytest.mark.parametrize(
    ("train", "test", "kind", "says"),
    [
        (105, 0, "samples", "must both be at least 1"),
        (0, 105, "contacts", "must both be at least 1"),
        (60, 40, "samples", "must add up to the 105 samples"),
        (61, 44, "contacts", "no set of whole contacts has 44 test samples"),
        (60, 45, "nodes", "kind 'nodes' is unknown"),
    ],
)
def test_what_does_not_fit_is_refused(train, test, kind, says):
    with pytest.raises(InputError, match=says):
        split(CONTACT, train, test, kind, 0)
