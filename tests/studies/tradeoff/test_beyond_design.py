"""Presses that models were not made for: what is asked, and how answers to it are told apart."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.judged_slab import *  # noqa: F403
from fixtures.stub import Stub, made_up

from palpate.benchmark.load import Answer, Doubted
from palpate.errors import NotConverged
from palpate.models import fem
from palpate.studies.tradeoff.general_loads import BEYOND_COLUMNS, measure_beyond, presses_beyond


@pytest.fixture(scope="module")
def asked(slab_case, slab_judge):
    case = replace(slab_case[0], radius_m=0.03, response=None, used={})
    return case, presses_beyond(case, slab_judge, 2)


def test_the_hardest_press_of_each_contact_is_asked_in_six_ways(asked, slab_judge):
    case, presses = asked
    assert len(presses) == 12
    for designed, *others in (presses[:6], presses[6:]):
        (node, force), side = designed.load.single(), slab_judge.side == "test"
        size = np.linalg.norm(slab_judge.samples.force[side & (slab_judge.samples.contact == node)], axis=1).max()
        assert np.linalg.norm(force) == pytest.approx(size)
        normal = case.body.coarse.normals[node]
        found = [press.load.single()[1] for press in others]
        assert found[2] == pytest.approx(3.0 * force)
        assert found[3] @ normal == pytest.approx(0.0, abs=1e-12) and found[4] == pytest.approx(size * normal)


def test_their_answers_are_the_converged_ones_or_none(asked):
    case, presses = asked
    operator = fem.Fem(case, {"level": 1, "start": "rest", "tolerance": 1e-8}, 2)
    sound = [press for press in presses if press.truth is not None]
    assert len(sound) >= 8
    for press in sound[:2] + sound[-1:]:
        expected = operator.respond(press.load)
        assert np.abs(press.truth - expected).max() < 0.005 * np.abs(expected).max()


def test_answers_are_right_wrong_or_doubted_with_or_without_need(asked):
    """A made-up model that is right, says so or not, wrong, says so or not, or has no answer."""
    case, presses = asked
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
    model = made_up(lambda case: [{"kind": "made"}], lambda case, setting: solver, "made.py")
    table = measure_beyond(case, "made", model, "made", made)
    assert list(table) == BEYOND_COLUMNS
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
    assert measure_beyond(case, "made", model, "other", made).empty
