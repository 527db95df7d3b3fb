"""Splits are exact, disjoint and repeatable."""

import numpy as np
import pytest

from palpate.benchmark.split import (
    FOLD_COLUMNS,
    asked_samples,
    deal,
    fold_sides,
    fold_table,
    read_folds,
    split,
    training_presses,
)
from palpate.errors import InputError
from palpate.run.job import write_table

CONTACT = np.repeat(np.arange(100, 135), 3)


@pytest.mark.parametrize("kind", ["samples", "contacts"])
def test_counts_are_exact_and_sides_disjoint(kind):
    train, test = split(CONTACT, 60, 45, kind, 3)
    assert (len(train), len(test)) == (60, 45)
    assert np.array_equal(np.sort(np.concatenate([train, test])), np.arange(105))
    again = split(CONTACT, 60, 45, kind, 3)
    assert np.array_equal(train, again[0]) and np.array_equal(test, again[1])
    assert not np.array_equal(test, split(CONTACT, 60, 45, kind, 4)[1])
    shared = set(CONTACT[train]) & set(CONTACT[test])
    assert bool(shared) == (kind == "samples")


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


def test_contacts_are_dealt_whole_and_evenly():
    contact = np.repeat(np.arange(100, 124), 3)[np.random.default_rng(0).permutation(72)]
    fold = deal(contact, 1)
    counts = [len(set(contact[fold == each])) for each in range(1, 6)]
    assert sorted(counts) == [4, 5, 5, 5, 5] and sum(counts) == 24
    assert all(len(set(fold[contact == each])) == 1 for each in set(contact))
    assert np.array_equal(fold, deal(contact, 1)) and not np.array_equal(fold, deal(contact, 2))
    assert set(deal(np.array([5, 5, 7, 9]), 1)) == {1, 2, 3}
    with pytest.raises(InputError, match=r"^tradeoff\.contacts: 2 contacts are too few"):
        deal(np.array([1, 1, 2, 2]), 1)


def test_every_contact_tests_once_and_chooses_once(db, tmp_path):
    write_table(fold_table(db, 1), tmp_path / "samples.csv")
    table = read_folds(tmp_path / "samples.csv")
    assert table.columns.tolist() == FOLD_COLUMNS and np.allclose(table["peak_m"], db.peaks)
    tested, chosen = [], []
    for number in range(1, table["fold"].max() + 1):
        training, validation, test = (set(table["contact"][side]) for side in fold_sides(table, number))
        assert training | validation | test == set(db.contact)
        assert not training & validation and not training & test and not validation & test
        tested, chosen = [*tested, *test], [*chosen, *validation]
    assert sorted(tested) == sorted(chosen) == sorted(set(db.contact))
    with pytest.raises(InputError, match="there is no split 6; the samples have the splits 1 to 5"):
        fold_sides(table, 6)


def test_the_truth_is_needed_of_whoever_chooses_or_tests(db):
    table = fold_table(db, 1)
    asked, tested = asked_samples(table, [1])
    _, validation, test = fold_sides(table, 1)
    assert tested.tolist() == test.tolist() and asked.tolist() == sorted([*validation, *test])
    both, tested = asked_samples(table, [1, 2])
    assert tested.tolist() == asked.tolist() and len(both) > len(asked)
    assert [each.tolist() for each in asked_samples(table, range(1, 6))] == [table["sample"].tolist()] * 2


def test_every_training_contact_has_one_press_of_all_in_turn(db):
    table = fold_table(db, 1)
    training, *_ = fold_sides(table, 2)
    found = training_presses(table, 2)
    assert sorted(db.contact[found]) == sorted(set(db.contact[training])) and set(found) <= set(training)
    contact = np.repeat([7, 3, 5, 9, 1], 3)
    table = fold_table(db.take(np.resize(np.arange(len(db.contact)), 15)), 1).assign(
        contact=contact, fold=[1] * 9 + [2] * 3 + [3] * 3
    )
    assert (training_presses(table, 2) % 3).tolist() == [2, 0, 1]  # of the contacts 7, 3 and 5 in their order
