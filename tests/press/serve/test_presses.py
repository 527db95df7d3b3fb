"""Presses as they are posted: what they are, and what is refused in one sentence."""

import json

import numpy as np
import pytest

from palpate.errors import InputError
from palpate.press.serve.presses import MOST, Bounds, read_presses

BOUNDS = Bounds(10, 5.0, 0.1)
GOOD = {"triangle": 3, "weights": [0.2, 0.3, 0.5], "force": [0, 0, -1.5]}


def test_a_force_and_a_depth_are_read():
    pushed = {"triangle": 9, "weights": [1, 0, 0], "moved": [0.05, 0, 0]}
    by_force, by_depth = read_presses(json.dumps({"presses": [GOOD, pushed]}).encode(), BOUNDS)
    assert by_force.triangle == 3 and by_force.force.tolist() == [0, 0, -1.5] and by_force.moved is None
    assert by_depth.moved.tolist() == [0.05, 0, 0] and by_depth.force is None


def test_weights_that_were_rounded_are_shares_again():
    (asked,) = read_presses(json.dumps({"presses": [GOOD | {"weights": [-1e-7, 0.3334, 0.6667]}]}).encode(), BOUNDS)
    assert asked.weights.min() >= 0 and asked.weights.sum() == pytest.approx(1, abs=1e-15)
    assert np.abs(asked.weights - [0, 1 / 3, 2 / 3]).max() < 2e-4


@pytest.mark.parametrize(
    "change",
    [
        {"triangle": 10}, {"triangle": -1}, {"triangle": 1.0}, {"triangle": True}, {"triangle": "1"},
        {"triangle": None}, {"triangle": 10**400}, {"weights": [0.5, 0.6, 0]}, {"weights": [-0.5, 0.5, 1]},
        {"weights": [1, 0]},
        {"weights": [1, 0, 0, 0]}, {"weights": "100"}, {"weights": [True, False, False]}, {"weights": [[1], 0, 0]},
        {"force": [0, 0, 5.1]}, {"force": [10**400, 0, 0]}, {"force": [1e308, 1e308, 0]}, {"force": None},
        {"force": {"x": 1}}, {"moved": [0, 0, 0]}, {"more": 1},
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
        b"", b"{", b"\xff\xfe", b"null", b"[]", b'"presses"', b"{}", b'{"presses": {}}', b'{"presses": []}',
        b'{"presses": [1]}', b'{"presses": [[]]}', b'{"presses": [], "more": 1}', b"[" * 5000,
        b'{"presses": [{"triangle": 0, "weights": [1, 0, 0], "force": [NaN, 0, 0]}]}',
        b'{"presses": [{"triangle": 0, "weights": [1, 0, 0], "force": [Infinity, 0, 0]}]}',
        b'{"presses": [{"triangle": 0, "weights": [1, 0, 0], "force": [1e999, 0, 0]}]}',
        json.dumps({"presses": [GOOD] * (MOST + 1)}).encode(),
    ],
)  # fmt: skip
def test_what_is_no_list_of_presses_is_refused(body):
    with pytest.raises(InputError, match=r"^[^\n]+\.$"):
        read_presses(body, BOUNDS)
