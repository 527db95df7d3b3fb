"""Methods that games relax bodies with, under an instrument: they end where elements whose nodes are kept out do."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.touched_block import SETTLED, rmse_of_peak

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
def test_forces_are_those_of_the_equilibrium(answers, equilibrium, method):
    assert answers[method].force_n == pytest.approx(equilibrium[1], rel=OWN[method])


def test_contact_at_nodes_is_softer_than_contact_at_all_points(block, touch, answers):
    """The ball sinks between nodes: a third of the force is missing, and little of the surface."""
    whole = fem.online(block, level=0, order=1).respond(touch)
    found = answers["vertex_block_descent"]
    assert 0.60 < found.force_n / whole.force_n < 0.75
    assert rmse_of_peak(found.displacement, whole.displacement) < 0.06


def test_a_bed_bears_what_the_ball_pushes_with(block, touch):
    bed = Bed(np.array([0.048, 0.048, 0.0]), 0.1, 3e5, np.array([0.0, 0.0, -1.0]))
    body = replace(block.body, anchors=[np.empty(0, dtype=np.int64)], bed=bed)
    found = ask(replace(block, body=body), touch, "projective_dynamics", iterations=200)
    assert found.reaction_n == pytest.approx(found.force_n, rel=2e-3)


def test_settings_are_those_of_levels_that_the_body_has(block):
    grid = Families(relaxed={"xpbd": [{"level": 0}, {"level": 1}]})
    assert relaxed.settings(replace(block, grid=grid), "xpbd") == [dict(Xpbd())]
