"""One table of the samples serves everybody: contacts, peaks and both splits, and the tables that are published."""

import numpy as np
import pytest

from palpate.benchmark.split import (
    SAMPLE_COLUMNS,
    SPLITS,
    read_samples,
    sample_peaks,
    sample_table,
    sides,
    split,
    split_counts,
)
from palpate.errors import InputError
from palpate.run.job import write_table


@pytest.fixture
def table(db):
    return sample_table(db, 18, 6, 1)


def test_a_row_has_contact_peak_and_sides(db, table):
    assert table.columns.tolist() == SAMPLE_COLUMNS and table["sample"].tolist() == list(range(24))
    assert np.array_equal(table["contact"], db.contact) and np.array_equal(table["peak_m"], db.peaks)
    for kind in SPLITS:
        expected = split(db.contact, 18, 6, kind, 1)
        assert [side.tolist() for side in sides(table, kind)] == [side.tolist() for side in expected]


def test_contacts_are_held_out_whole(table):
    train, test = (table.loc[side] for side in sides(table, "contacts"))
    assert not set(train["contact"]) & set(test["contact"])


def test_it_is_the_same_when_read_again(table, tmp_path):
    write_table(table, tmp_path / "samples.csv")
    again = read_samples(tmp_path / "samples.csv")
    assert again.equals(table.astype(again.dtypes))
    with pytest.raises(InputError, match=r"nothing\.csv is missing"):
        read_samples(tmp_path / "nothing.csv")


def test_published_tables(table):
    tables = {("beam", "small"): table, ("beam", "large"): table.iloc[::-1]}
    peaks = sample_peaks(tables)
    assert peaks.columns.tolist() == ["body", "regime", "sample", "peak_m"] and len(peaks) == 48
    assert peaks.iloc[24].tolist() == ["beam", "large", 23, table["peak_m"][23]]
    counts = split_counts(tables)
    assert counts.columns.tolist() == ["body", "regime", "split", "train", "test"]
    assert counts.to_numpy().tolist() == [["beam", r, kind, 18, 6] for r in ("small", "large") for kind in SPLITS]
