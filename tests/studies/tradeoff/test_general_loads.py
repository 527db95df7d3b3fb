"""Loads that models were not prepared or made for: what is asked, the right answers, and what is measured."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.stub import Stub, made_up

from palpate.benchmark.load import DEPTH, LOADS, NEW, PREPARED, TWO, Answer, Doubted
from palpate.bodies.contacts import contacts_of, places_between
from palpate.bodies.refinement import finer
from palpate.effects.patch_load import patch_at, spread
from palpate.errors import InputError, NotConverged
from palpate.models.kinds import FEM
from palpate.solvers.compliance import compute_compliance
from palpate.solvers.equilibrium import Equilibrium, FastEquilibrium
from palpate.studies.tradeoff.general_loads import (
    ANY_LOAD,
    BEYOND_DESIGN,
    measure_any,
    measure_beyond,
    presses_beyond,
    questions,
)

RADIUS_M = 0.02


@pytest.fixture(scope="module")
def asked(slab_case, slab_judge):
    """The slab under discs, with prepared contacts; and two questions of each kind."""
    response = compute_compliance(slab_case[0].body, RADIUS_M, contacts=contacts_of(slab_case[0].body)[::2], order=2)
    case = replace(slab_case[0], radius_m=RADIUS_M, response=response, used={})
    return case, questions(case, slab_judge, 2, 1e-8)


def operator(case, presses):
    """Return the fine operator's answer on the surface, and the mean displacement of each disc, by another way."""
    whole = finer(case.body)
    problem = Equilibrium(whole, 1, 2)
    discs = [
        spread(case.body.fine, patch_at(case.body, node, RADIUS_M), np.array([1.0, 0, 0]), 2) for node, _ in presses
    ]
    load = sum(disc[:, :1] * force for disc, (_, force) in zip(discs, presses, strict=True))
    moved = problem.solve(load, 1e-9).x - problem.mesh.nodes
    return moved[case.body.fine.surface], np.array([disc[:, 0] @ moved for disc in discs])


def test_questions_of_each_kind_have_the_operators_answer(asked, slab_judge):
    case, found = asked
    assert [question.kind for question in found] == [kind for kind in LOADS for _ in range(2)]
    for question in found:
        nodes = [press.node for press in question.load.presses]
        if question.kind == PREPARED:  # known from the samples, which here are of another operator
            assert any(np.array_equal(question.truth, fine) for fine in slab_judge.samples.fine)
            continue
        exact, ways = operator(case, list(zip(nodes, question.forces, strict=True)))
        assert np.abs(question.truth - exact).max() < 1e-6 * np.abs(exact).max()
        if question.kind == DEPTH:
            assert np.allclose([press.moved for press in question.load.presses], ways, rtol=1e-5)
        assert (question.patch.sum() >= len(nodes)) and len(nodes) == (2 if question.kind == TWO else 1)
    between = [question.load.presses[0].node for question in found if question.kind == NEW]
    assert len(set(between)) == 2 and min(between) >= len(case.body.coarse.nodes)
    (_, first), (_, second) = found[4].load.forces()
    sample = slab_judge.samples.force
    assert any(np.allclose(first, 0.7 * force) for force in sample) and not np.allclose(first, second)


def test_places_between_are_far_from_what_is_known_and_from_anchors(slab):
    known = contacts_of(slab)
    nodes = places_between(slab, 5, known)
    fine = slab.fine.nodes
    able = np.setdiff1d(slab.fine.surface, np.arange(len(slab.coarse.nodes)))

    def gap(node):
        return np.linalg.norm(fine[known] - fine[node], axis=1).min()

    elements = slab.coarse.tetrahedra
    beside = np.unique(elements[np.isin(elements, slab.anchors[0]).any(axis=1)])
    free = [n for n in able if not np.isin(slab.prolongation[[n]].indices, beside).any()]
    assert gap(nodes[0]) == pytest.approx(max(map(gap, free)), rel=1e-12) and set(nodes) <= set(free)
    assert len(set(places_between(slab, 10**6, known))) == len(free)


def test_a_load_without_a_sound_answer_is_left_out(asked, slab_judge, monkeypatch):
    case, _ = asked
    monkeypatch.setattr(FastEquilibrium, "least_det", lambda self, x: -0.1)
    assert [q.kind for q in questions(case, slab_judge, 2, 1e-6)] == [PREPARED] * 2


def test_the_operator_itself_is_right_and_a_linear_one_is_told_what_it_lacks(asked, grid):
    case, found = asked
    table = measure_any(case, "fem_p2", FEM(order=2).tried(case, grid), "level=1", found[2:], 5, 0.01)
    assert list(table.columns) == ANY_LOAD.columns and list(table["kind"]) == [NEW, TWO, DEPTH]
    assert (table["rmse_of_peak"] < 1e-3).all() and (table[["refused", "failures"]] == 0).all(axis=None)
    assert table["force_error"].iloc[-1] < 1e-3 and table["force_error"].iloc[:-1].isna().all()
    coarse = measure_any(case, "fem_p1", FEM(order=1).tried(case, grid), "level=0, start=rest, tol", found[2:], 5, 0.01)
    assert (coarse.groupby("kind")["rmse_of_peak"].min() > 0.01).all()
    assert (coarse["rmse_of_peak_most"] >= coarse["rmse_of_peak"]).all() and (coarse["online_median_s"] > 0).all()
    assert (coarse["online_max_s"] > 0).all()


def test_refusals_are_counted_apart_from_failures(asked):
    case, found = asked

    def respond(load):
        node, _ = load.single()
        if node >= len(case.body.coarse.nodes):
            raise InputError(f"contact {node} is not prepared.")
        raise NotConverged("lost", [1.0])

    made = made_up([{}], lambda case, setting: Stub(memory_mb=1.0, respond=respond))
    rows = measure_any(case, "mine", made, "", found, 5, 0.01).set_index("kind")
    assert rows["refused"].to_dict() == {PREPARED: 0, NEW: 2, TWO: 2, DEPTH: 2}
    assert rows["failures"].to_dict() == {PREPARED: 2, NEW: 0, TWO: 0, DEPTH: 0}
    assert rows.loc[TWO, "failure"] == "one press at a time is answered, and not several"
    assert "is not prepared" in rows.loc[NEW, "failure"] and np.isnan(rows.loc[NEW, "rmse_of_peak"])


def test_a_model_that_says_that_it_does_not_know_has_not_failed(asked):
    """Its doubts are counted apart, their answers are in no mean, and only contacts that it answers count."""
    case, found = asked
    doubted = next(question for question in found if question.kind == TWO)

    def respond(load):
        answer = Answer(np.zeros((case.n_surface, 3)))
        if load is doubted.load:
            raise Doubted("too far", [0.1], answer)
        return answer

    made = made_up([{}], lambda case, setting: Stub(memory_mb=1.0, respond=respond))
    rows = measure_any(case, "mine", made, "", found, 5, 0.01).set_index("kind")
    assert rows["doubted"].to_dict() == {PREPARED: 0, NEW: 0, TWO: 1, DEPTH: 0} and (rows["failures"] == 0).all()
    assert rows.loc[TWO, "failure"] == "too far" and rows.loc[TWO, "contacts"] == rows.loc[NEW, "contacts"] - 1 == 1
    other = [question for question in found if question.kind == TWO][1]
    peak = np.linalg.norm(other.truth, axis=1)
    assert rows.loc[TWO, "rmse_of_peak"] == pytest.approx(np.sqrt(np.mean(peak**2)) / peak.max())


def test_what_is_prepared_for_a_press_is_timed_apart_and_once(asked):
    case, found = asked
    nodes = []

    def respond(load):
        if len(load.presses) == 2:
            raise NotConverged("lost", [1.0])
        return Answer(np.zeros((case.n_surface, 3)), np.zeros((1, 3)))

    def prepare_nodes(together):
        nodes.append(together)
        return float(sum(together))

    solver = Stub(memory_mb=1.0, respond=respond, prepare_nodes=prepare_nodes)
    made = made_up([{"n": 1}, {"n": 2}], lambda case, setting: solver)
    table = measure_any(case, "mine", made, "n=2", found, 6, 0.01)
    assert list(table["setting"]) == ["n=2"] * 4
    wanted = [tuple(press.node for press in question.load.presses) for question in found]
    assert nodes == list(dict.fromkeys(wanted))  # once, whichever kind of load asks first
    rows = table.set_index("kind")
    assert rows["failures"].to_dict() == {PREPARED: 0, NEW: 0, TWO: 2, DEPTH: 0} and rows.loc[TWO, "failure"] == "lost"
    assert (rows.drop(TWO)["preparation_s"] > 0).all()
    assert rows.loc[DEPTH, "preparation_s"] == rows.loc[PREPARED, "preparation_s"]  # of the same places
    assert rows.loc[DEPTH, "force_error"] == 1.0 and 0.0 < rows.loc[NEW, "rmse_of_peak"] < 1.0


@pytest.fixture(scope="module")
def beyond(slab_case, slab_judge):
    """The slab under larger discs; and two contacts, each pressed in six ways."""
    case = replace(slab_case[0], radius_m=0.03, response=None, used={})
    return case, presses_beyond(case, slab_judge, 2)


def test_the_hardest_press_of_each_contact_is_asked_in_six_ways(beyond, slab_judge):
    case, presses = beyond
    assert len(presses) == 12
    for designed, *others in (presses[:6], presses[6:]):
        (node, force), side = designed.load.single(), slab_judge.side == "test"
        size = np.linalg.norm(slab_judge.samples.force[side & (slab_judge.samples.contact == node)], axis=1).max()
        assert np.linalg.norm(force) == pytest.approx(size)
        normal = case.body.coarse.normals[node]
        found = [press.load.single()[1] for press in others]
        assert found[2] == pytest.approx(3.0 * force)
        assert found[3] @ normal == pytest.approx(0.0, abs=1e-12) and found[4] == pytest.approx(size * normal)


def test_their_answers_are_the_converged_ones_or_none(beyond):
    case, presses = beyond
    operator = FEM(order=2, level=1, tolerance=1e-8).prepare(case)
    sound = [press for press in presses if press.truth is not None]
    assert len(sound) >= 8
    for press in sound[:2] + sound[-1:]:
        expected = operator.respond(press.load)
        assert np.abs(press.truth - expected).max() < 0.005 * np.abs(expected).max()


def test_answers_are_right_wrong_or_doubted_with_or_without_need(beyond):
    """A made-up model that is right, says so or not, wrong, says so or not, or has no answer."""
    case, presses = beyond
    sound = next(press for press in presses if press.truth is not None)
    ways = ["right", "wrong", "doubts the right", "doubts the wrong", "none", "unsound"]
    made = [sound._replace(kind=way, truth=None if way == "unsound" else sound.truth) for way in ways]
    answers = iter(ways)

    def respond(load):
        way = next(answers)
        moved = sound.truth if "right" in way or way == "unsound" else 1.2 * sound.truth
        if way == "none":
            raise NotConverged("nothing", [1.0])
        if "doubts" in way:
            raise Doubted("far", [0.0], Answer(moved))
        return moved

    solver = Stub(respond=respond, memory_mb=0.0)
    model_of_ways = made_up([{"kind": "made"}], lambda case, setting: solver, place="made.py")
    table = measure_beyond(case, "made", model_of_ways, "made", made)
    assert list(table) == BEYOND_DESIGN.columns
    found = table.set_index("kind")[["unsound", "right", "doubted", "needless", "wrong"]]
    expected = {
        "right": [0, 1, 0, 0, 0],
        "wrong": [0, 0, 0, 0, 1],
        "doubts the right": [0, 0, 1, 1, 0],
        "doubts the wrong": [0, 0, 1, 0, 0],
        "none": [0, 0, 1, 0, 0],
        "unsound": [1, 0, 0, 0, 1],
    }
    assert {kind: row.tolist() for kind, row in found.iterrows()} == expected
    assert table["rmse_most"].iloc[1] > 0.01
    assert measure_beyond(case, "made", model_of_ways, "other", made).empty
