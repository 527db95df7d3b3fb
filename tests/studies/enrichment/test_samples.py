"""Paper 1's samples: loads as deep as asked, sides as the split has them, and the table's columns and means."""

import warnings

import numpy as np
import pytest
from fixtures.known_deformations import *  # noqa: F403

from palpate.benchmark.accuracy import errors
from palpate.benchmark.database import SPLITS, sample_table, split
from palpate.benchmark.presses import LOAD_COLUMNS, samples_in
from palpate.benchmark.static_responses import press
from palpate.errors import InputError
from palpate.models.interpolation import Interpolation
from palpate.run.job import write_table
from palpate.studies.enrichment.samples import (
    ENRICHMENT_ACCURACY,
    SAMPLE_COLUMNS,
    accuracy_rows,
    choose_loads,
    read_samples,
    sample_errors,
    sides,
)

MAGNITUDES = [0.5, 1.0]


@pytest.fixture(scope="module")
def pick_loads(slab, slab_compliance):
    def loads(count=8, peak=0.05, magnitudes=MAGNITUDES, seed=1, radius=0.0):
        return choose_loads(slab, slab_compliance, magnitudes, peak, radius, count, seed)

    return loads


def test_as_many_as_asked_and_contact_by_contact_as_the_seed_decides(pick_loads):
    loads = pick_loads()
    assert list(loads.columns) == LOAD_COLUMNS
    assert loads["sample"].tolist() == list(range(8))
    contacts = loads["contact"].to_numpy().reshape(-1, len(MAGNITUDES))
    assert (contacts == contacts[:, :1]).all() and len(np.unique(contacts)) == 4
    assert set(pick_loads(radius=0.02)["radius_m"]) == {0.02}
    assert pick_loads().equals(loads) and pick_loads(seed=2)["contact"].tolist() != loads["contact"].tolist()


def test_contacts_can_be_pressed_and_are_pressed_inward(slab, slab_compliance, pick_loads):
    beside = {n for element in slab.coarse.tetrahedra if np.isin(element, slab.anchors[0]).any() for n in element}
    able = [n for n in slab_compliance.contacts if n not in beside]
    loads = pick_loads(count=len(able), magnitudes=[1.0])
    assert sorted(loads["contact"]) == able
    for sample in samples_in(loads):
        contact, force = sample.load.single()
        assert force @ slab.fine.normals[contact] == pytest.approx(-np.linalg.norm(force), rel=1e-12)


@pytest.mark.parametrize("peak", [0.02, 0.15])
def test_peaks_are_as_deep_as_asked(slab, slab_compliance, pick_loads, peak):
    """On the coarse mesh, corrected by how much softer the fine one is for small loads; and on the fine, nearly."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # of forces that are found nothing is said
        loads = pick_loads(peak=peak)
    wanted = peak * slab.fine.size * np.tile(MAGNITUDES, 4)
    reached = [np.linalg.norm(press(slab, k, loads, 1e-6).displacement, axis=2).max(axis=1) for k in (0, 1)]
    softer = []
    for sample in samples_in(loads):
        contact, force = sample.load.single()
        row = slab_compliance.row(contact)
        linear = [np.tensordot(force, c[row], 1) for c in (slab_compliance.fine, slab_compliance.coarse)]
        fine, coarse = (np.linalg.norm(u, axis=1).max() for u in linear)
        softer.append(fine / coarse)
    assert np.min(softer) > 1.0
    assert np.abs(reached[0] * softer / wanted - 1.0).max() < 0.025
    assert np.abs(reached[1] / wanted - 1.0).max() < (0.1 if peak < 0.1 else 0.35)


def test_counts_that_cannot_be_are_refused(pick_loads):
    with pytest.raises(InputError, match=r"^bodies\.slab: train \+ test is 7, which 2 magnitudes do not divide; .*\.$"):
        pick_loads(count=7)
    with pytest.raises(InputError, match=r"^bodies\.slab: 500 contacts are asked for and \d+ can be pressed; .*\.$"):
        pick_loads(count=1000)


@pytest.fixture
def side_table(db):
    return sample_table(db, 18, 6, 1)


def test_a_row_has_contact_peak_and_sides_and_is_the_same_when_read_again(db, side_table, tmp_path):
    assert side_table.columns.tolist() == SAMPLE_COLUMNS and side_table["sample"].tolist() == list(range(24))
    assert np.array_equal(side_table["contact"], db.contact) and np.array_equal(side_table["peak_m"], db.peaks)
    for kind in SPLITS:
        expected = split(db.contact, 18, 6, kind, 1)
        assert [side.tolist() for side in sides(side_table, kind)] == [side.tolist() for side in expected]
    write_table(side_table, tmp_path / "samples.csv")
    again = read_samples(tmp_path / "samples.csv")
    assert again.equals(side_table.astype(again.dtypes))
    with pytest.raises(InputError, match=r"nothing\.csv is missing"):
        read_samples(tmp_path / "nothing.csv")


class Nothing:
    """Predicts that nothing moves."""

    sigma_m = 0.25

    def predict(self, coarse, contact, force):
        return np.zeros((722, 3))


def test_rows_are_made_of_sample_errors(db):
    test = np.array([3, 8, 14])
    labels = {"body": "cylinder", "regime": "small", "split": "contacts"}
    methods = {"nothing": Nothing(), "interpolation": Interpolation(db)}
    table = accuracy_rows(db, methods, "live", test, labels)
    assert table.columns.tolist() == ENRICHMENT_ACCURACY.columns
    assert table["method"].tolist() == ["nothing", "interpolation"]
    nothing = table.iloc[0]
    assert (nothing[list(labels)] == list(labels.values())).all()
    assert nothing["protocol"] == "live" and nothing["samples"] == 3
    assert nothing["sigma_m"] == 0.25 and np.isnan(table["sigma_m"].iloc[1])
    rmse = [np.sqrt((db.fine[i] ** 2).sum(axis=1).mean()) for i in test]
    assert nothing["rmse_m"] == pytest.approx(np.mean(rmse))
    assert nothing["rmse_of_peak"] == pytest.approx(np.mean(rmse / db.peaks[test]))
    assert nothing["max_of_peak"] == pytest.approx(1)
    found = sample_errors(db, Interpolation(db), "paper", test)
    assert found["sample"].tolist() == [3, 8, 14]
    expected = errors(db.prolongation @ db.coarse_paper[8], db.fine[8])
    assert found.iloc[1]["rmse_m"] == pytest.approx(expected.rmse_m, rel=1e-12)
    row = accuracy_rows(db, methods, "paper", test, labels).iloc[1]
    assert row["p95_of_peak"] == pytest.approx(found["p95_of_peak"].mean())
    assert row["max_of_peak"] == pytest.approx(found["max_of_peak"].max())
