"""Presses between nodes are answered there without a jump, and malformed presses are refused."""

import json
from dataclasses import replace

import numpy as np
import pytest
from fixtures.stub import Stub

from palpate.benchmark.load import Answer, Doubted, Load
from palpate.benchmark.model import Solver
from palpate.errors import InputError, NotConverged
from palpate.models.kinds import FEM
from palpate.press.serve.pressed_model import MOST_PRESSES, Asked, Bounds, PressedModel, read_presses

FORCE = np.array([0.0, 0.0, -1.0])


@pytest.fixture(scope="module")
def case(slab_case):
    """The slab under a disc."""
    return replace(slab_case[0], radius_m=0.03)


@pytest.fixture(scope="module")
def corners(case) -> np.ndarray:
    return case.database.nodes_fine_surface[case.database.triangles]


@pytest.fixture(scope="module")
def way(corners) -> list[Asked]:
    """Places on a straight way over the free top of the slab, through several triangles, 0.5 mm apart."""
    middle = corners.reshape(-1, 3).mean(axis=0)[:2]
    return [_under(corners, middle + np.array([1.0, 0.4]) * shift) for shift in np.arange(0.0, 0.03, 0.0005)]


def _under(corners: np.ndarray, point: np.ndarray) -> Asked:
    """The place on the upper side that lies straight above a point of the plane."""
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    for triangle in np.flatnonzero(normals[:, 2] > 0.3 * np.linalg.norm(normals, axis=1)):
        flat = np.vstack([corners[triangle, :, :2].T, np.ones(3)])
        weights = np.linalg.solve(flat, [*point, 1.0])
        if weights.min() > -1e-9:
            weights = weights.clip(0)
            return Asked(int(triangle), weights / weights.sum(), FORCE, None)
    raise AssertionError("the way leaves the upper side")


class Nodes(Solver):
    """A model that moves every node by the force times a smooth function of where it is pressed, at nodes only."""

    def __init__(self, case, doubts=False):
        self.asked, self.nodes, self.n, self.doubts = [], case.body.fine.nodes, case.n_surface, doubts

    def share(self, place):
        return 1.0 + place @ [3.0, 2.0, 1.0]

    def respond(self, load: Load) -> Answer:
        self.asked.append([press.node for press in load.presses])
        moved = sum(self.share(self.nodes[p.node]) * (p.force if p.moved is None else p.moved) for p in load.presses)
        forces = np.array([self.share(self.nodes[p.node]) * FORCE for p in load.presses])
        answer = Answer(np.tile(moved, (self.n, 1)), forces, 0.01)
        if self.doubts:
            raise Doubted("too far", [1.0], answer)
        return answer


def test_elements_under_a_disc_at_a_node_answer_as_at_the_node(case):
    solver = FEM(order=1, level=0, tolerance=1e-9).prepare(case)
    contact = int(case.database.contact[0])
    row = int(np.searchsorted(case.body.fine.surface, contact))
    triangle, corner = (int(each[0]) for each in np.nonzero(case.database.triangles == row))
    found = PressedModel(case, solver).respond([Asked(triangle, np.eye(3)[corner], FORCE, None)])
    expected = solver.respond(Load.at(contact, FORCE))
    assert np.abs(found.displacement - expected).max() < 1e-7 * np.abs(expected).max()
    assert found.forces.tolist() == [FORCE.tolist()] and found.error is None and found.doubt == ""


def test_elements_follow_a_finger_without_a_jump_and_find_the_force_of_a_depth(case, way):
    """Of 60 steps none changes the answer by much more than the middle one, and the work of the disc moves on."""
    pressed = PressedModel(case, FEM(order=1, level=0, tolerance=1e-9).prepare(case))
    answers = np.array([pressed.respond([asked]).displacement for asked in way])
    steps = np.abs(np.diff(answers, axis=0)).max(axis=(1, 2))
    assert len({asked.triangle for asked in way}) > 1
    assert 0 < steps.max() < 3 * np.median(steps) and steps.max() < 0.1 * np.abs(answers).max()
    by_depth = pressed.respond([way[7]._replace(force=None, moved=np.array([0.0, 0.0, -0.002]))])
    again = pressed.respond([way[7]._replace(force=by_depth.forces[0])])
    assert np.abs(by_depth.displacement - again.displacement).max() < 1e-5 * np.abs(again.displacement).max()


def test_other_models_are_asked_for_the_corners_and_blended(case, way, corners):
    model = Nodes(case)
    pressed = PressedModel(case, model)
    for asked in way:
        found = pressed.respond([asked])
        share = model.share(asked.weights @ corners[asked.triangle])
        assert found.displacement == pytest.approx(np.tile(share * FORCE, (case.n_surface, 1)))
        assert found.forces[0] == pytest.approx(share * FORCE) and found.error == 0.01
    assert max(map(len, model.asked)) == 1 and len(model.asked) <= 3 * len(way)


def test_two_fingers_are_answered_together(case, way, corners):
    model = Nodes(case)
    two = [way[0], way[-1]._replace(force=2 * FORCE)]
    shares = [model.share(asked.weights @ corners[asked.triangle]) for asked in two]
    found = PressedModel(case, model).respond(two)
    assert found.displacement[0] == pytest.approx(shares[0] * FORCE + 2 * shares[1] * FORCE)
    assert found.forces.shape == (2, 3) and {len(nodes) for nodes in model.asked} == {2}


def test_a_place_that_is_held_is_refused_and_one_beside_it_is_not(case):
    held = np.isin(case.body.fine.surface[case.database.triangles], case.body.anchors[-1]).sum(axis=1)
    inside, beside = (int(np.flatnonzero(held == count)[0]) for count in (3, 1))
    model = Nodes(case)
    third = np.full(3, 1 / 3)
    with pytest.raises(InputError, match=r"the body is held there; press another place\."):
        PressedModel(case, model).respond([Asked(inside, third, FORCE, None)])
    PressedModel(case, model).respond([Asked(beside, third, FORCE, None)])
    assert len(model.asked) == 2


def test_an_answer_that_is_not_finite_is_none(case, way):
    broken = Stub(respond=lambda load: np.full((case.n_surface, 3), np.nan))
    with pytest.raises(NotConverged):
        PressedModel(case, broken).respond([way[0]])


def test_a_model_that_finds_no_force_says_so_for_a_depth(case, way):
    forceless = Stub(respond=lambda load: np.zeros((case.n_surface, 3)))
    with pytest.raises(InputError, match="finds no force for a depth"):
        PressedModel(case, forceless).respond([way[0]._replace(force=None, moved=1e-3 * FORCE)])


def test_weights_that_were_rounded_are_shares_again():
    (asked,) = read_presses(json.dumps({"presses": [GOOD | {"weights": [-1e-7, 0.3334, 0.6667]}]}).encode(), BOUNDS)
    assert asked.weights.min() >= 0 and asked.weights.sum() == pytest.approx(1, abs=1e-15)
    assert np.abs(asked.weights - [0, 1 / 3, 2 / 3]).max() < 2e-4


BOUNDS = Bounds(10, 5.0, 0.1)
GOOD = {"triangle": 3, "weights": [0.2, 0.3, 0.5], "force": [0, 0, -1.5]}


@pytest.mark.parametrize(
    "change",
    [
        {"triangle": 10}, {"triangle": -1}, {"triangle": True}, {"triangle": 10**400}, {"weights": [0.5, 0.6, 0]},
        {"weights": [-0.5, 0.5, 1]}, {"weights": [1, 0]}, {"weights": [[1], 0, 0]}, {"force": [0, 0, 5.1]},
        {"force": [1e308, 1e308, 0]}, {"force": None}, {"moved": [0, 0, 0]}, {"more": 1},
    ],
)  # fmt: skip
def test_a_press_that_is_none_is_refused(change):
    with pytest.raises(InputError, match=r"^[^\n]+\.$"):
        read_presses(json.dumps({"presses": [GOOD | change]}).encode(), BOUNDS)


def test_a_depth_that_no_body_has_is_refused():
    deep = {"triangle": 0, "weights": [1, 0, 0], "moved": [0.2, 0, 0]}
    with pytest.raises(InputError, match=r"moved of a press is larger than this body can bear; give 0\.1 at most\."):
        read_presses(json.dumps({"presses": [deep]}).encode(), BOUNDS)


@pytest.mark.parametrize(
    "body",
    [
        b"{", b"\xff\xfe", b"null", b"{}", b'{"presses": []}', b'{"presses": [1]}', b"[" * 5000,
        b'{"presses": [{"triangle": 0, "weights": [1, 0, 0], "force": [NaN, 0, 0]}]}',
        b'{"presses": [{"triangle": 0, "weights": [1, 0, 0], "force": [1e999, 0, 0]}]}',
        json.dumps({"presses": [GOOD] * (MOST_PRESSES + 1)}).encode(),
    ],
)  # fmt: skip
def test_what_is_no_list_of_presses_is_refused(body):
    with pytest.raises(InputError, match=r"^[^\n]+\.$"):
        read_presses(body, BOUNDS)
