"""Methods that games move bodies with, under an instrument; forces of springs and shapes are calibrated by elements."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from fixtures.touched_block import SETTLED as RELAXED
from fixtures.touched_block import block_of, mirrored, reflection, rmse_of_peak, touch_at

from palpate.benchmark.model import LeftOut
from palpate.bodies.supports import Bed
from palpate.errors import InputError
from palpate.models import relaxed, shape_matching
from palpate.models.springs import mass_spring as springs
from palpate.models.touch import fem
from palpate.models.touch.pushing import calibration, force_scale

SETTLED = {"level": 0, "iterations": 60}, {"level": 0, "mode": "linear", "clusters": "cubes", "steps": 160}
MODELS = {
    "springs": (partial(springs.online, volume=False), SETTLED[0]),
    "springs_volume": (partial(springs.online, volume=True), SETTLED[0]),
    "shape_matching": (shape_matching.online, SETTLED[1]),
}
ALL = MODELS | {name: (partial(relaxed.online, method=name), {"level": 0} | RELAXED[name]) for name in RELAXED}
OWN = {"springs": 1e-3, "springs_volume": 1e-3, "shape_matching": 0.02}
OWN |= {"xpbd": 6e-3, "projective_dynamics": 2e-3, "vertex_block_descent": 2e-3}
"""How far the force may be from what the supports feel: particles bounce, and penalties let nodes in a little."""


@pytest.fixture(scope="module")
def solvers(calibrated):
    return {name: online(calibrated, **setting) for name, (online, setting) in ALL.items()}


WITHIN = {"springs": 0.04, "springs_volume": 0.04, "shape_matching": 0.12} | dict.fromkeys(RELAXED, 1e-3)


@pytest.mark.parametrize(("model", "within"), WITHIN.items())
def test_they_move_as_elements_do_whose_nodes_are_kept_out(solvers, touch, equilibrium, model, within):
    """Within some of the peak, however stiff they are: the depth is given."""
    assert rmse_of_peak(solvers[model].respond(touch).displacement, equilibrium[0]) < within


@pytest.mark.parametrize("model", MODELS)
def test_calibrated_forces_are_those_of_elements_within_a_third(solvers, block, touch, model):
    right = fem.online(block, level=0, order=1).respond(touch)
    assert solvers[model].respond(touch).force_n == pytest.approx(right.force_n, rel=0.33)


@pytest.mark.parametrize("model", ALL)
def test_the_force_that_each_reports_is_what_the_supports_feel(solvers, touch, model):
    found = solvers[model].respond(touch)
    assert found.reaction_n == pytest.approx(found.force_n, rel=OWN[model])


@pytest.mark.parametrize("model", MODELS)
def test_forces_fit_the_calibrating_touches(calibrated, solvers, model):
    """No other factor fits them better."""
    touches, right = zip(*calibration(calibrated), strict=True)
    assert force_scale([solvers[model].respond(each) for each in touches], right) == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("model", ALL)
def test_a_mirrored_touch_has_the_mirrored_answer(solvers, block, touch, model):
    found, other = solvers[model].respond(touch), solvers[model].respond(mirrored(touch))
    assert other.force_n == pytest.approx(found.force_n, rel=OWN[model])
    assert rmse_of_peak(other.displacement, found.displacement[reflection(block)] * [-1.0, 1.0, 1.0]) < 2e-3


@pytest.mark.parametrize("model", ALL)
def test_what_touches_no_node_moves_nothing(model):
    """The tip is between two nodes of the coarse level, and less deep than the ball is higher at them."""
    case, (online, setting) = block_of([4, 4, 2], 1), ALL[model]
    felt = touch_at(case, (0.5, 0.5), 0.01, (0.0, 0.0, -1.0))
    right = fem.online(case, level=0, order=1).respond(felt)
    solver = online(replace(case, kept={"calibration": [(felt, right)]}), **setting)
    found = solver.respond(touch_at(case, (0.5, 0.375), 1e-3, (0.0, 0.0, -1.0)))
    assert not found.displacement.any() and found.force_n == 0.0
    assert found.reaction_n == 0.0 and found.area_m2 == 0.0


@pytest.mark.parametrize("model", MODELS)
def test_bodies_that_they_cannot_hold_are_refused(calibrated, model):
    online, setting = MODELS[model]
    loose = replace(calibrated.body, anchors=[np.empty(0, dtype=np.int64)])
    with pytest.raises(InputError, match="nothing is held"):
        online(replace(calibrated, body=loose), **setting)
    bed = Bed(np.array([0.05, 0.05, 0.0]), 0.1, 3e5, np.array([0.0, 0.0, -1.0]))
    with pytest.raises(LeftOut):
        online(replace(calibrated, body=replace(loose, bed=bed)), **setting)
