"""Errors by hand, and the table's columns and means."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from palpate.benchmark.accuracy import (
    OWN,
    Truth,
    errors,
    judge,
    judge_at_training,
    patch_nodes,
    read_judged,
    truth_errors,
)
from palpate.benchmark.database import fold_sides, fold_table, write
from palpate.benchmark.presses import FORCES
from palpate.benchmark.ranking import TRAINING
from palpate.bodies.body_file import save
from palpate.errors import InputError
from palpate.run.job import write_table
from palpate.stores import store
from palpate.studies.press.measure import known_presses


def test_errors_by_hand():
    reference = np.array([[3.0, 4.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]])
    predicted = reference + np.array([[0.0, 0.0, 1.0], [2.0, 0.0, 0.0], [0.0, -2.0, 0.0]])
    found = errors(predicted, reference)
    assert found.rmse_m == pytest.approx(np.sqrt((1 + 4 + 4) / 3))
    assert found.rmse_of_peak == pytest.approx(found.rmse_m / 5)
    assert found.max_of_peak == pytest.approx(2 / 5)
    assert found.p95_of_peak == pytest.approx(2 / 5)
    assert errors(reference, reference) == (0, 0, 0, 0)
    with pytest.raises(InputError, match="the reference moves nowhere"):
        errors(predicted, np.zeros((3, 3)))


def test_errors_against_the_truth_by_hand():
    truth = np.array([[3.0, 4.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0], [0.0, 2.0, 0.0]])
    predicted = truth + np.array([[0.0, 0.0, 1.0], [2.0, 0.0, 0.0], [0.0, -2.0, 0.0], [0.0, 0.0, 0.0]])
    found = truth_errors(predicted, truth, np.array([True, True, False, False]))
    assert found.rmse_of_peak == pytest.approx(np.sqrt((1 + 4 + 4) / 4) / 5)
    assert found.relative_l2 == pytest.approx(np.sqrt((1 + 4 + 4) / (25 + 1 + 4)))
    assert found.patch_rms_of_peak == pytest.approx(np.sqrt((1 + 4) / 2) / 5)  # of the whole peak, not of the patch's
    assert found.patch_max_of_peak == pytest.approx(2 / 5) == found.max_of_peak
    last = truth_errors(predicted, truth, np.array([False, False, False, True]))
    assert last.patch_rms_of_peak == last.patch_max_of_peak == 0
    nothing = truth_errors(np.zeros((4, 3)), truth, np.array([True, False, False, False]))
    assert nothing.relative_l2 == nothing.patch_max_of_peak == nothing.patch_rms_of_peak == 1


def test_the_patch_is_on_the_side_that_is_pressed(box):
    """A plate of 2 mm: a disc of 12 mm reaches its other side, whose nodes are not pressed."""
    mesh = box([10, 10, 1], [0.1, 0.1, 0.002])
    contact = int(np.argmin(np.linalg.norm(mesh.nodes - [0.05, 0.05, 0.002], axis=1)))
    nodes = mesh.nodes[mesh.surface[patch_nodes(mesh, contact, 0.012)]]
    assert len(nodes) == 5 and np.allclose(nodes[:, 2], 0.002)
    assert np.linalg.norm(nodes - mesh.nodes[contact], axis=1).max() <= 0.012
    assert mesh.surface[patch_nodes(mesh, contact, 0.0)].tolist() == [contact]


def test_errors_do_not_depend_on_axes_or_units():
    random = np.random.default_rng(0)
    reference, predicted = random.normal(size=(2, 30, 3))
    turn = np.linalg.qr(random.normal(size=(3, 3)))[0]
    here, there = errors(predicted, reference), errors(1e3 * predicted @ turn, 1e3 * reference @ turn)
    assert there.rmse_m == pytest.approx(1e3 * here.rmse_m)
    assert there[1:] == pytest.approx(here[1:])


@pytest.fixture
def all_samples(slab_case):
    """The slab's 12 samples at 6 contacts, their folds, and a truth of them in another order, 10 % larger."""
    db = slab_case[0].database
    k, order = len(db.contact), np.random.default_rng(0).permutation(len(db.contact))
    own = np.tile(np.arange(float(k))[:, None], (1, len(OWN)))
    truth = Truth(
        sample=order, displacement=1.1 * db.fine[order], levels=np.zeros((k, 3, 1, 3)),
        ratio=np.full(k, 2.8), least_det=np.full(k, 0.9), own=own[order],
        volume_change=np.zeros(k), iterations=np.ones(k, int), products=np.ones(k, int),
        rejected=np.full(k, "", dtype=object), seconds=np.arange(float(k))[order], radius_m=0.05, level=2,
        elements=1, nodes=1,
    )  # fmt: skip
    return db, fold_table(db, 1), truth


def test_every_sample_has_its_own_truth_side_and_patch(slab, all_samples):
    db, folds, truth = all_samples
    _, validation, test = fold_sides(folds, 2)
    found = judge(slab, db, folds, truth, 2, 0.05)
    assert found.numbers.tolist() == [*validation, *test] and found.split == 2
    assert found.side.tolist() == ["validation"] * len(validation) + ["test"] * len(test)
    for i, number in enumerate(found.numbers):
        assert np.allclose(found.truth[i], 1.1 * db.fine[number]) and found.own[i, 0] == found.own_seconds[i] == number
        assert np.array_equal(found.samples.force[i], db.force[number])
        assert np.array_equal(found.patch[i], patch_nodes(slab.fine, int(db.contact[number]), 0.05))
    assert found.errors(0, 1.1 * found.samples.fine[0]).max_of_peak == pytest.approx(0, abs=1e-12)
    assert found.operator_error(0, found.samples.fine[0]) == 0.0


def test_any_answer_can_be_compared_with_that_of_coarser_elements(slab, all_samples):
    """Distances are shares of the coarser answer's peak; a body of one level has no such answer."""
    db, folds, truth = all_samples
    levels = np.stack([0.5 * truth.displacement, truth.displacement, truth.displacement], axis=1)
    found = judge(slab, db, folds, replace(truth, levels=levels), 2, 0.05)
    everywhere, patch = found.from_coarser(0, 0.6 * found.truth[0])
    assert found.coarser is not None and np.allclose(found.coarser, 0.5 * found.truth)
    lengths = np.linalg.norm(found.truth[0], axis=1)
    assert everywhere == pytest.approx(0.1 * np.sqrt(np.mean(lengths**2)) / (0.5 * lengths.max()))
    assert patch == pytest.approx(0.1 * np.sqrt(np.mean(lengths[found.patch[0]] ** 2)) / (0.5 * lengths.max()))
    assert np.isnan(replace(found, coarser=None).from_coarser(0, found.truth[0])).all()


def test_what_is_not_believed_is_not_asked_for(slab, all_samples):
    db, folds, truth = all_samples
    test = fold_sides(folds, 1)[2]
    why = np.where(np.isin(truth.sample, test[:1]), "too near to an inverted element", "").astype(object)
    found = judge(slab, db, folds, replace(truth, rejected=why), 1, 0.05)
    assert found.numbers[found.side == "test"].tolist() == test[1:].tolist()
    assert np.array_equal(found.rejected.force, db.force[test[:1]]) and found.believed.all()
    assert judge(slab, db, folds, truth, 1, 0.05).rejected is None
    why = np.where(np.isin(truth.sample, test), "no limit", "").astype(object)
    found = judge(slab, db, folds, replace(truth, rejected=why), 1, 0.05)
    assert found.numbers[found.side == "test"].tolist() == test.tolist()  # where none is, the finest level serves
    assert np.array_equal(np.isnan(found.own[:, 0]), found.side == "test")  # and nothing is said of its own error
    assert np.array_equal(found.believed, found.side != "test") and found.rejected is None
    lost = truth.displacement.copy()
    lost[np.isin(truth.sample, test)] = np.nan
    some = replace(truth, rejected=why, displacement=np.where(truth.sample == test[0], lost.T, truth.displacement.T).T)
    assert judge(slab, db, folds, some, 1, 0.05).rejected.contact.tolist() == db.contact[test[:1]].tolist()
    truth = replace(truth, displacement=lost)
    with pytest.raises(InputError, match=r"slab: no test sample of split 1 has an answer on all levels; press less"):
        judge(slab, db, folds, replace(truth, rejected=why), 1, 0.05)


def test_a_case_has_no_sample_that_is_judged(slab, slab_case, slab_compliance, all_samples, tmp_path):
    db, folds, truth = all_samples
    names = ("body", "database", "samples", "truth", "compliance")
    files = {name: tmp_path / (f"{name}.csv" if name == "samples" else f"{name}.h5") for name in names}
    save(slab, files["body"])
    write(db, files["database"])
    write_table(folds, files["samples"])
    store(truth, files["truth"])
    store(slab_compliance, files["compliance"])
    case, found = read_judged(files, "large", 3, 0.05, slab_case[0].options, 1e-8)
    assert not set(case.database.contact) & set(found.samples.contact)
    assert len(case.database.contact) + len(found.numbers) == 12 and case.regime == "large" and case.radius_m == 0.05
    assert np.array_equal(case.response.contacts, slab_compliance.contacts)
    del files["compliance"]
    assert read_judged(files, "large", 3, 0.05, slab_case[0].options, 1e-8)[0].response is None


def test_a_press_of_each_training_contact_is_judged_beside_the_others(slab, all_samples):
    db, folds, truth = all_samples
    found, more = judge(slab, db, folds, truth, 2, 0.05), judge_at_training(slab, db, folds, truth, 2, 0.05)
    assert set(more.side) == {TRAINING} and found.training is None
    assert set(more.samples.contact) | set(found.samples.contact) == set(db.contact)
    assert not set(more.samples.contact) & set(found.samples.contact)
    assert len(set(more.samples.contact)) == len(more.side)
    assert np.allclose(more.truth[0], 1.1 * db.fine[more.numbers[0]])
    lost = np.where(np.isin(db.contact[truth.sample], db.contact[more.numbers]), "no limit", "").astype(object)
    nothing = replace(truth, rejected=lost, displacement=np.full_like(truth.displacement, np.nan))
    assert judge_at_training(slab, db, folds, nothing, 2, 0.05) is None


def test_the_page_shows_the_hardest_press_of_a_contact_with_the_truth_s_own_rmse(slab, all_samples, tmp_path):
    db, _, truth = all_samples
    force = np.outer(np.arange(1.0, len(truth.sample) + 1), [0.0, 0.0, -1.0])
    loads = pd.DataFrame(force, columns=FORCES).assign(sample=truth.sample, radius_m=0.05)
    loads["contact"] = db.contact[truth.sample]
    store(truth, tmp_path / "truth.h5")
    write_table(loads, tmp_path / "loads.csv")
    found = known_presses(slab, [tmp_path / "truth.h5"], [tmp_path / "loads.csv"], 3)
    assert len({each.contact for each in found}) == len(found) == 3
    for each in found:
        last = np.flatnonzero(db.contact[truth.sample] == each.contact).max()
        assert each.force[2] == force[last, 2]
        assert each.own == pytest.approx(truth.own[last, OWN.index("rmse_of_peak")])
