"""Estimates of the errors of answers, against what is known of them."""

import numpy as np
import pytest

from palpate.benchmark.load import Load, loads_of
from palpate.models.fem_statics import Simulation, to_surface
from palpate.studies.tradeoff.error_estimates import CHEAP, COARSER, COLUMNS, EVERY, RESIDUAL, estimates


@pytest.fixture(scope="module")
def asked(slab_case, slab_judge):
    return estimates(slab_case[0], slab_judge)


def of(table, name):
    rows = table[(table["estimate"] == name) & (table["model"] == EVERY)]
    return rows.sort_values("sample").reset_index(drop=True)


def test_every_sample_has_each_estimate(asked, slab_judge):
    assert asked.columns.tolist() == COLUMNS and (asked["split"] == 1).all()
    for name in CHEAP:
        rows = of(asked, name)
        assert sorted(rows["sample"]) == sorted(slab_judge.numbers) and (rows["rms"] > 0).all()
    contacts = dict(zip(slab_judge.numbers, slab_judge.samples.contact, strict=True))
    assert [contacts[s] for s in asked["sample"]] == asked["contact"].tolist()


def test_the_linear_peak_is_over_the_size_and_the_distance_is_to_what_was_learnt_from(asked, slab_case, slab_judge):
    case, body = slab_case[0], slab_case[0].body
    i = int(np.argmin(slab_judge.numbers))
    contact, force = int(slab_judge.samples.contact[i]), slab_judge.samples.force[i]
    linear = np.tensordot(force, case.response.fine[case.response.row(contact)], 1)
    peak = np.linalg.norm(linear, axis=1).max()
    assert of(asked, "linear")["rms"][0] == pytest.approx(peak / body.fine.size)
    learnt = body.coarse.nodes[case.database.contact]
    away = np.linalg.norm(learnt - body.coarse.nodes[contact], axis=1).min()
    assert of(asked, "distance")["rms"][0] == pytest.approx(away / body.fine.size)


def test_the_residual_ranks_the_distance_from_the_fine_elements(asked, slab_case, slab_judge):
    """Coarse linear elements: one cycle on the fine residual finds most of their distance from a converged answer."""
    case = slab_case[0]
    loads = loads_of(slab_judge.samples.contact, slab_judge.samples.force)
    fine, coarse = Simulation(case, 1, 1e-8, order=2), Simulation(case, 0, case.tolerance)
    up, down = to_surface(case.body, 1, 2), to_surface(case.body, 0)
    far = []
    for load in loads:
        best, rough = up @ fine.displacement(load), down @ coarse.displacement(load)
        far.append(np.sqrt(np.mean(np.sum((rough - best) ** 2, axis=1))) / np.linalg.norm(rough, axis=1).max())
    found = asked[(asked["estimate"] == RESIDUAL) & (asked["model"] == "fem_p1")]["rms"].to_numpy()
    ratio = found / np.array(far)
    assert ratio.max() < 2 * ratio.min() and 0.3 < np.median(ratio) < 3.0


def test_a_second_answer_is_timed_and_has_no_value_of_its_own(asked):
    rows = asked[asked["estimate"] == COARSER]
    assert 0 < len(rows) <= 6 and (rows["seconds"] > 0).all() and rows[["rms", "patch"]].isna().all(axis=None)
    assert set(rows["model"]) == {EVERY}


def test_a_cycle_leads_towards_the_answer_and_a_converged_one_has_no_residual(slab_case, slab_judge):
    """From nine tenths of a converged answer to a small load, one cycle finds most of what lacks, node by node."""
    load = Load.at(slab_judge.samples.contact[0], slab_judge.samples.force[0])
    fine = Simulation(slab_case[0], 1, 1e-10, order=2)
    moved = fine.displacement(load)
    left, rest = (np.abs(fine.correction(load, u)).max() for u in (moved, np.zeros_like(moved)))
    assert left < 1e-7 * rest and rest > 0.1 * np.abs(moved).max()
    load, fine = load.times(1e-3), Simulation(slab_case[0], 1, 1e-10, order=2)
    moved = fine.displacement(load)
    lacks = 0.1 * moved
    left = np.linalg.norm(fine.correction(load, 0.9 * moved) - lacks) / np.linalg.norm(lacks)
    assert left < 0.5
