"""Quadratic elements by L-BFGS: the answer of fem_p2, nearer to it with every iteration and from nearer starts."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.benchmark.accuracy import errors
from palpate.benchmark.load import Load
from palpate.models import fast_fem, fem
from palpate.models.model_registry import model

GRID = {
    "levels": 2, "iterations": [4, 8], "frame_iterations": [2], "finest_frame_iterations": [],
    "linear_iterations": [3], "tolerances": [1e-3],
}  # fmt: skip


@pytest.fixture(scope="module")
def pressed(slab_case):
    """The slab under a disc, a contact, and a force that moves it by several per cent of its size."""
    case, test, _ = slab_case
    return replace(case, radius_m=0.03), int(test.contact[0]), 0.7 * test.force[0]


def ask(pressed, setting, module=fast_fem, **order):
    case, contact, force = pressed
    solver = module.offline(case, **order).online(setting)
    solver.precede(Load.at(contact, force))
    return solver.respond(Load.at(contact, force))


@pytest.mark.parametrize("level", [0, 1])
def test_it_converges_to_the_answer_of_newtons_method(pressed, level):
    setting = {"level": level, "start": "rest", "tolerance": 1e-8}
    found, expected = ask(pressed, setting), ask(pressed, setting, fem, order=2)
    assert np.linalg.norm(expected, axis=1).max() > 0.03 * np.ptp(pressed[0].body.fine.nodes, axis=0).max()
    assert np.abs(found - expected).max() < 1e-6 * np.abs(expected).max()


def test_every_iteration_helps_and_so_does_a_near_start(pressed):
    end = ask(pressed, {"level": 0, "start": "rest", "tolerance": 1e-9})
    wrong = {
        (start, n): errors(ask(pressed, {"level": 0, "start": start, "iterations": n}), end).rmse_of_peak
        for start in ("rest", "linear", "frame")
        for n in (2, 4, 8, 12)
    }
    for start in ("rest", "linear", "frame"):
        assert wrong[start, 12] < 0.3 * wrong[start, 4] < wrong[start, 2]
    assert wrong["rest", 12] < 1e-3
    for n in (2, 4, 8):
        assert wrong["frame", n] < 0.3 * wrong["rest", n]
    assert wrong["linear", 2] < wrong["rest", 2]


def test_its_settings_go_from_coarse_to_fine_and_from_few_iterations_to_many(pressed):
    case = replace(pressed[0], grid={"fast_fem": GRID})
    found = fast_fem.settings(case)
    assert [s["level"] for s in found] == sorted(s["level"] for s in found)
    last = len(case.body.levels) - 1
    assert [(s["start"], s.get("iterations")) for s in found if s["level"] == last] == [
        ("linear", 3), ("rest", 4), ("rest", 8), ("rest", None),
    ]  # fmt: skip
    assert {"level": last - 1, "start": "frame", "iterations": 2} in found
    assert {s["start"] for s in fast_fem.settings(replace(case, response=None))} == {"frame", "rest"}
    made = model("fast_fem", {})
    assert made.reduces == "p2" and not made.prepared and made.needs_contacts({"start": "linear"})
