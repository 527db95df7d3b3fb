"""A database survives the file, and a damaged file is named."""

from dataclasses import replace

import h5py
import numpy as np
import pytest

from palpate.benchmark.database import (
    FIELDS,
    FOLD_COLUMNS,
    asked_samples,
    deal,
    fold_sides,
    fold_table,
    read,
    read_folds,
    split,
    training_presses,
    write,
)
from palpate.errors import InputError
from palpate.run.job import write_table

ARRAYS = [name for name in FIELDS if name != "prolongation"]


@pytest.fixture
def path(db, tmp_path):
    write(db, tmp_path / "database.h5")
    return tmp_path / "database.h5"


def test_round_trip_and_what_follows_from_the_arrays(db, path):
    again = read(path)
    for name in ARRAYS:
        assert np.array_equal(getattr(again, name), getattr(db, name)), name
    assert (again.prolongation != db.prolongation).nnz == 0
    assert again.material == db.material and again.config_digest == db.config_digest
    assert list(path.parent.iterdir()) == [path]
    assert db.peaks == pytest.approx([max(np.sqrt((u**2).sum(axis=1))) for u in db.fine], rel=1e-14)
    assert db.size == pytest.approx(0.2)


def missing(file, name):
    del file[f"{FIELDS[name].group}/{name}"]


def in_millimetres(file, name):
    file[f"{FIELDS[name].group}/{name}"].attrs["unit"] = "mm"


def of_another_version(file, name):
    file.attrs[name] = 99


def without(file, name):
    del file.attrs[name]


def ending_with(value):
    def change(file, name):
        file[f"{FIELDS[name].group}/{name}"][-1] = value

    return change


@pytest.mark.parametrize(
    ("names", "change", "says"),
    [
        (list(FIELDS), missing, "is missing; delete the file"),
        (list(FIELDS), in_millimetres, "has unit mm instead of "),
        (["nodes_fine_surface", "contact_normals", "force", "fine", "residual"], ending_with(np.nan), "has a NaN or"),
        (["nodes_fine_surface", "force", "residual"], ending_with(np.inf), "has a NaN or infinite value"),
        (["format"], of_another_version, "is 99"),
        (["young_pa"], without, "is missing"),
    ],
)
def test_what_is_wrong_in_a_file_is_named(path, names, change, says):
    whole = path.read_bytes()
    for name in names:
        path.write_bytes(whole)
        with h5py.File(path, "a") as file:
            change(file, name)
        with pytest.raises(InputError, match=f"database.h5: field {name} {says}"):
            read(path)


@pytest.mark.parametrize("name", ARRAYS)
def test_a_wrong_shape_is_named(db, tmp_path, name):
    array = getattr(db, name)
    wider = np.concatenate([array, array[..., :1]], axis=-1) if array.ndim > 1 else array[:, None]
    with pytest.raises(InputError, match=f"field {name} has "):
        write(replace(db, **{name: wider}), tmp_path / "x.h5")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("name", "value", "says"),
    [
        ("triangles", 10**6, "names a node that nodes_fine_surface does not have"),
        ("contact", -1, "names a node that coarse_nodes does not have"),
        ("contact", "inner", "names a node that is not on the coarse surface"),
        ("coarse_surface", 0, "is not increasing"),
        ("fine", 0.0, "has a sample in which nothing moves"),
    ],
)
def test_what_cannot_be_is_not_written(db, tmp_path, name, value, says):
    array = getattr(db, name).copy()
    array[-1] = np.setdiff1d(np.arange(len(db.coarse_nodes)), db.coarse_surface)[0] if value == "inner" else value
    with pytest.raises(InputError, match=f"field {name} {says}"):
        write(replace(db, **{name: array}), tmp_path / "x.h5")


def test_flipped_bytes_are_noticed(path):
    with h5py.File(path) as file:
        chunk = file["samples/fine"].id.get_chunk_info(0)
    with open(path, "r+b") as file:
        file.seek(chunk.byte_offset + chunk.size // 2)
        byte = file.read(1)
        file.seek(-1, 1)
        file.write(bytes([byte[0] ^ 0xFF]))
    with pytest.raises(InputError, match="field fine is damaged"):
        read(path)


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
