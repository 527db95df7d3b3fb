"""The coarse mesh's answer is that of its stiffness, and meets the depths it is given."""

import numpy as np
import pytest

from palpate.bodies.settings import Box, Plane
from palpate.effects.patch_load import nodal_load
from palpate.press import coarse_rival
from palpate.solvers.equilibrium import Equilibrium
from palpate.studies.press.measure import place_of, trial_presses

RADIUS_M = 0.06


@pytest.fixture(scope="module")
def bar():
    held = Plane(axis="x", side="min", depth_m=0.001)
    shape = Box(sizes_m=[0.2, 0.05, 0.05], divisions=[8, 3, 3], refinements=1, young_pa=3000, poisson=0.3, anchors=held)
    return shape.make("bar")


@pytest.fixture(scope="module")
def answer(bar):
    return coarse_rival.coarse_answer(bar, RADIUS_M)


def test_it_is_what_the_coarse_mesh_answers(bar, answer):
    node = int(np.argmax(bar.coarse.nodes @ [1.0, 0.2, 0.2]))
    solve, force = Equilibrium(bar, 0).linear_solver(1e-10), np.array([0.02, 0.01, -0.05])
    expected = bar.prolongation @ solve(nodal_load(bar, 0, node, force, RADIUS_M))
    found = answer.respond([place_of(bar, node) | {"force": force}]).displacement
    # pressure is lumped to nodes here, and integrated there
    difference = np.linalg.norm(found - expected[bar.fine.surface], axis=1).max()
    assert difference < 0.03 * np.linalg.norm(expected, axis=1).max()


def test_forces_and_depths_agree(bar, answer):
    first, second = trial_presses(bar, 2, 0.004)
    found = answer.respond([first, second])
    forced = [by_force(press, force) for press, force in zip([first, second], found.forces, strict=True)]
    np.testing.assert_allclose(answer.respond(forced).displacement, found.displacement, atol=1e-8)
    # a press by force beside one by depth: the disc still goes where it is pushed
    np.testing.assert_allclose(answer.respond([forced[0], second]).displacement, found.displacement, atol=1e-8)
    apart = [answer.respond([press]).displacement for press in forced]
    np.testing.assert_allclose(sum(apart), found.displacement, atol=1e-8)


def by_force(press, force):
    return {"triangle": press["triangle"], "weights": press["weights"], "force": force}


def test_what_is_held_stays(bar, answer):
    (press,) = trial_presses(bar, 1, 0.01)
    moved = answer.respond([press]).displacement
    held = np.isin(bar.fine.surface, bar.anchors[-1])
    assert held.any() and np.abs(moved[held]).max() == 0.0 and np.linalg.norm(moved, axis=1).max() > 0.005


def test_a_large_body_goes_without(bar, monkeypatch):
    monkeypatch.setattr(coarse_rival, "MOST_SURFACE_NODES", 10)
    assert coarse_rival.coarse_answer(bar, RADIUS_M) is None
