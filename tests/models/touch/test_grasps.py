"""Models that are asked what a grasp does end where the finite elements do, whose truth is known better."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.touched_block import SETTLED, rmse_of_peak

from palpate.benchmark.measuring import measure, tables
from palpate.benchmark.model import LeftOut
from palpate.benchmark.settings import Given, TouchTruthSettings
from palpate.benchmark.touch import Touch, choose_touches, given_touches, touches_of
from palpate.benchmark.touch_measure import Touches, penetration, touch_settings
from palpate.benchmark.touch_mesh import check_by_coarse_elements
from palpate.benchmark.touch_truth import truth_of_touches
from palpate.effects.instrument import Instrument
from palpate.errors import InputError
from palpate.models import relaxed
from palpate.models.touch import fem, linear, modes
from palpate.studies.touch.settings import Families

GRASP = Instrument("grasp", 0.02)
OBLIQUE = np.array([0.6, 0.0, 0.8])
LINEAR = {"held": 0, "level": 2}


@pytest.fixture(scope="module")
def case(block):
    return replace(block, instrument=GRASP, grid=Families(linear=[LINEAR | {"discs": 8}]), kept={})


@pytest.fixture(scope="module")
def pull(case):
    top = case.body.fine.nodes.max(axis=0) * [0.5, 0.5, 1.0]
    node = int(np.linalg.norm(case.body.fine.nodes - top, axis=1).argmin())
    return Touch(GRASP, node, OBLIQUE, 0.006)


@pytest.mark.parametrize("method", SETTLED)
def test_methods_of_games_end_at_the_equilibrium_of_elements(case, pull, method):
    elements = fem.online(case, level=0, order=1).respond(pull)
    solver = relaxed.online(case, method, level=0, **SETTLED[method])
    solver.prepare(pull)
    found = solver.respond(pull)
    assert rmse_of_peak(found.displacement, elements.displacement) < 1e-3
    assert found.force_n == pytest.approx(elements.force_n, rel=5e-3)
    assert found.reaction_n == pytest.approx(found.force_n, rel=5e-3)


@pytest.mark.slow
def test_linear_responses_are_those_of_small_motions(case, pull):
    small = replace(pull, depth_m=1e-5)
    solver = linear.online(case, **LINEAR)
    solver.prepare(small)
    found, right = solver.respond(small), fem.online(case, **LINEAR).respond(small)
    assert rmse_of_peak(found.displacement, right.displacement) < 1e-3
    assert found.force_n == pytest.approx(right.force_n, rel=1e-3)


@pytest.mark.slow
def test_the_truth_of_a_grasp_judges_linear_elements(case, pull):
    truth = truth_of_touches(
        case.body, [pull], settings=TouchTruthSettings(along_radius=0.8, finest=2, most_force_error=0.05)
    )
    assert truth.believed.all() and truth.own[0, 0] < 0.01
    assert truth.force_order[0] == pytest.approx(1.0, abs=0.3)  # of the singular rim
    kind = Touches(case, [pull], truth)
    _, table = tables(kind, *measure(kind, touch_settings(case, "linear", linear.__name__), 1, 0.0))
    (row,) = table.to_dict("records")
    assert row["failures"] == 0 and row["rmse_of_peak"] < 0.02 and abs(row["force_error"]) < 0.1
    assert np.isnan(row["penetration_of_depth"]) and np.isnan(penetration(case, pull, truth.answer(0)))


def test_what_is_grasped_is_pulled(case):
    table = choose_touches(case.body, GRASP, 3, (0.1, 0.2), 1, check_by_coarse_elements(case.body, 1.0))
    ways = [touch.direction @ case.body.fine.normals[touch.node] for touch in touches_of(GRASP, table)]
    assert min(ways) > 0.7
    given = Given(body="block", at_m=[0.048, 0.048, 0.048], depths_m=[0.002])
    (touch,) = touches_of(GRASP, given_touches(case.body, GRASP, [given]))
    assert touch.direction @ [0.0, 0.0, 1.0] == pytest.approx(1.0)


def test_those_that_are_made_of_touches_say_that_they_know_no_grasp(case):
    with pytest.raises(LeftOut):
        modes.online(case, held=0, level=2)


def test_a_grasp_smaller_than_triangles_is_refused(case, pull):
    with pytest.raises(InputError, match="radius_m"):
        replace(pull, instrument=Instrument("grasp", 0.005)).patch(case.body)
