"""Methods that games relax bodies with, under an instrument: they end where elements whose nodes are kept out do."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.touched_block import SETTLED, block_of, mirrored, reflection, rmse_of_peak, touch_at

from palpate.benchmark.settings import Xpbd
from palpate.bodies.supports import Bed
from palpate.models import relaxed
from palpate.models.touch import fem
from palpate.studies.touch.settings import Families

OWN = {"xpbd": 6e-3, "projective_dynamics": 2e-3, "vertex_block_descent": 2e-3}
"""How far forces may be from those at equilibrium: steps of XPBD end beside it, penalties let nodes in a little."""


@pytest.fixture(scope="module")
def answers(block, touch):
    return {name: ask(block, touch, name) for name in SETTLED}


def ask(case, touch, method, **changed):
    return relaxed.online(case, method, level=0, **SETTLED[method] | changed).respond(touch)


@pytest.mark.parametrize("method", SETTLED)
def test_each_ends_at_the_equilibrium(answers, equilibrium, touch, method):
    found, (moved, forces) = answers[method], equilibrium
    assert rmse_of_peak(found.displacement, moved) < 1e-3
    assert found.force_n == pytest.approx(forces, rel=OWN[method])


@pytest.mark.parametrize("method", SETTLED)
def test_the_force_that_it_reports_is_what_the_supports_feel(answers, method):
    assert answers[method].reaction_n == pytest.approx(answers[method].force_n, rel=OWN[method])


def test_contact_at_nodes_is_softer_than_contact_at_all_points(block, touch, answers):
    """The ball sinks between nodes: a third of the force is missing, and little of the surface."""
    whole = fem.online(block, level=0, order=1).respond(touch)
    found = answers["vertex_block_descent"]
    assert 0.60 < found.force_n / whole.force_n < 0.75
    assert rmse_of_peak(found.displacement, whole.displacement) < 0.06


@pytest.mark.parametrize("method", SETTLED)
def test_what_touches_no_node_moves_nothing(method):
    """The tip is between two nodes of the coarse level, and less deep than the ball is higher at them."""
    case = block_of([4, 4, 2], 1)
    found = ask(case, touch_at(case, (0.5, 0.375), 1e-3, (0.0, 0.0, -1.0)), method)
    assert not found.displacement.any() and found.force_n == 0.0
    assert found.reaction_n == 0.0 and found.area_m2 == 0.0


@pytest.mark.parametrize("method", SETTLED)
def test_a_mirrored_touch_has_the_mirrored_answer(block, touch, method, answers):
    """Of contact without friction, whatever the order in which nodes or elements are relaxed."""
    found = ask(block, mirrored(touch), method)
    assert found.force_n == pytest.approx(answers[method].force_n, rel=OWN[method])
    mirror = answers[method].displacement[reflection(block)] * [-1.0, 1.0, 1.0]
    assert rmse_of_peak(found.displacement, mirror) < 1e-3


def test_a_bed_bears_what_the_ball_pushes_with(block, touch):
    bed = Bed(np.array([0.048, 0.048, 0.0]), 0.1, 3e5, np.array([0.0, 0.0, -1.0]))
    body = replace(block.body, anchors=[np.empty(0, dtype=np.int64)], bed=bed)
    found = ask(replace(block, body=body), touch, "projective_dynamics", iterations=200)
    assert found.reaction_n == pytest.approx(found.force_n, rel=2e-3)


def test_settings_are_those_of_levels_that_the_body_has(block):
    grid = Families(relaxed={"xpbd": [{"level": 0}, {"level": 1}]})
    assert relaxed.settings(replace(block, grid=grid), "xpbd") == [dict(Xpbd())]
