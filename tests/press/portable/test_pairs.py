"""Two discs that are pushed to a depth at once, at one place and apart: what they share, and what is doubted."""

import numpy as np
import pytest
from press.portable.conftest import press_near

from palpate.press.portable.runtimes.palpate_model import APART, MISSED


@pytest.fixture(scope="module")
def top(exported):
    """A point in the middle of the slab's top, and a depth of 1 % of its size."""
    low, high = exported.nodes.min(axis=0), exported.nodes.max(axis=0)
    return np.array([*(0.5 * (low + high))[:2], high[2]]), 0.01 * float((high - low).max())


def is_answer(answer):
    """Whether nothing is doubted but the distance to the few contacts of this file."""
    return answer.doubt == "" or answer.doubt.startswith(APART)


def reached(model, presses, answer):
    """How far the discs of presses were moved [m], (k, 3)."""
    places = [model._place(press) for press in presses]
    linear, bent, _ = model._parts_of(places, answer.forces, [rest for each in answer.rest for _, rest in each])
    return np.array([place.disc @ (linear + sum(each.more for each in bent)) for place in places])


def test_two_discs_at_one_place_share_the_force_of_one(exported, top):
    press = press_near(exported, *top)
    one, two = exported.respond([press]), exported.respond([press, press])
    assert is_answer(one) and is_answer(two)
    assert two.forces[0] == pytest.approx(two.forces[1], rel=1e-6)
    total = two.forces.sum(axis=0)
    assert np.linalg.norm(total - one.forces[0]) < 0.05 * np.linalg.norm(one.forces)
    assert reached(exported, [press, press], two) == pytest.approx(np.array([press["moved"]] * 2), abs=1e-5 * top[1])


def test_two_discs_at_one_place_do_not_move_differently(exported, top):
    """They are moved by the mean, which is neither, and the answer says by how much they miss it."""
    point, depth = top
    presses = [press_near(exported, point, depth), press_near(exported, point, 3.0 * depth)]
    answer = exported.respond(presses)
    mean = np.mean([press["moved"] for press in presses], axis=0)
    assert "too near another, and misses its way by 45 %" in answer.doubt and answer.error == 1.0
    assert reached(exported, presses, answer) == pytest.approx(np.array([mean, mean]), abs=1e-5 * depth)


@pytest.mark.parametrize("radii", [0.25, 0.5, 1.0, 2.0])
def test_discs_that_are_near_are_moved_as_far_as_they_are_pushed(exported, top, radii):
    point, depth = top
    beside = point + radii * exported.radius_m * np.array([1.0, 0.0, 0.0])
    presses = [press_near(exported, each, depth) for each in (point, beside)]
    answer = exported.respond(presses)  # nearer than a radius they share the force, and miss a little of their way
    missed = np.linalg.norm(reached(exported, presses, answer) - [press["moved"] for press in presses])
    peak = np.linalg.norm(answer.displacement, axis=1).max()
    assert is_answer(answer) and missed <= MISSED * np.sqrt(2.0) * depth
    assert answer.error >= missed / peak
    assert (answer.forces[:, 2] < 0.0).all() if radii < 1.0 else missed < 1e-5 * depth
