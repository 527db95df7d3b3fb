"""Contacts are dealt whole and evenly, and every contact tests once and chooses once."""

import numpy as np
import pytest

from palpate.benchmark.split import (
    FOLD_COLUMNS,
    asked_samples,
    deal,
    fold_sides,
    fold_table,
    read_folds,
    training_presses,
)
from palpate.errors import InputError
from palpate.run.job import write_table


def test_contacts_are_dealt_whole_and_evenly():
    contact = np.repeat(np.arange(100, 124), 3)[np.random.default_rng(0).permutation(72)]
    fold = deal(contact, 1)
    counts = [len(set(contact[fold == each])) for each in range(1, 6)]
    assert sorted(counts) == [4, 5, 5, 5, 5] and sum(counts) == 24
    assert all(len(set(fold[contact == each])) == 1 for each in set(contact))
    assert np.array_equal(fold, deal(contact, 1)) and not np.array_equal(fold, deal(contact, 2))
    assert set(deal(np.array([5, 5, 7, 9]), 1)) == {1, 2, 3}


def test_too_few_contacts_are_refused():
    with pytest.raises(InputError, match=r"^tradeoff\.contacts: 2 contacts are too few"):
        deal(np.array([1, 1, 2, 2]), 1)


def test_every_contact_tests_once_and_chooses_once(db, tmp_path):
    write_table(fold_table(db, 1), tmp_path / "samples.csv")
    table = read_folds(tmp_path / "samples.csv")
    assert table.columns.tolist() == FOLD_COLUMNS and np.allclose(table["peak_m"], db.peaks)
    tested, chosen = [], []
    for split in range(1, table["fold"].max() + 1):
        training, validation, test = (set(table["contact"][side]) for side in fold_sides(table, split))
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
