"""Methods that relax nodes under an instrument: they end where elements whose nodes are kept out do.

Springs and shapes have forces that are calibrated by those of elements.
"""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from fixtures.touched_block import SETTLED, block_of, mirrored, reflection, rmse_of_peak, touch_at

from palpate.benchmark.model import LeftOut
from palpate.benchmark.settings import Xpbd
from palpate.bodies.supports import Bed
from palpate.errors import InputError
from palpate.models import relaxed, shape_matching
from palpate.models.springs import mass_spring as springs
from palpate.models.touch import fem
from palpate.models.touch.pushing import calibration, force_scale
from palpate.studies.touch.settings import Families

CALIBRATED = {
    "springs": partial(springs.online, level=0, iterations=60, volume=False),
    "springs_volume": partial(springs.online, level=0, iterations=60, volume=True),
    "shape_matching": partial(shape_matching.online, level=0, mode="linear", clusters="cubes", steps=160),
}
RELAXED = {name: partial(relaxed.online, method=name, level=0, **asked) for name, asked in SETTLED.items()}
MODELS = CALIBRATED | RELAXED
MOVED = {"springs": 0.04, "springs_volume": 0.04, "shape_matching": 0.12}
"""How far displacements may be from those at equilibrium, over the peak, for 1e-3 of the relaxed elements."""
OWN = {"springs": 1e-3, "springs_volume": 1e-3, "shape_matching": 0.02, "xpbd": 6e-3}
"""How far a force may be from what the supports feel, for 2e-3 of others: particles of shapes bounce, steps of XPBD end
beside the equilibrium, penalties let nodes in a little."""
models = pytest.mark.parametrize("model", MODELS)


@pytest.fixture(scope="module")
def solvers(calibrated):
    return {name: online(calibrated) for name, online in MODELS.items()}


@pytest.fixture(scope="module")
def answers(solvers, touch):
    return {name: solver.respond(touch) for name, solver in solvers.items()}


@pytest.fixture(scope="module")
def whole(block, touch):
    """The answer of elements with contact at all points."""
    return fem.online(block, level=0, order=1).respond(touch)


@models
def test_each_ends_at_the_equilibrium(answers, equilibrium, model):
    """However stiff springs and shapes are: the depth is given."""
    assert rmse_of_peak(answers[model].displacement, equilibrium[0]) < MOVED.get(model, 1e-3)


@pytest.mark.parametrize("model", RELAXED)
def test_relaxed_elements_find_the_force_at_equilibrium(answers, equilibrium, model):
    assert answers[model].force_n == pytest.approx(equilibrium[1], rel=OWN.get(model, 2e-3))


@models
def test_the_force_that_each_reports_is_what_the_supports_feel(answers, model):
    assert answers[model].reaction_n == pytest.approx(answers[model].force_n, rel=OWN.get(model, 2e-3))


@models
def test_a_mirrored_touch_has_the_mirrored_answer(solvers, answers, block, touch, model):
    """Of contact without friction, whatever the order in which nodes or elements are relaxed."""
    found, other = answers[model], solvers[model].respond(mirrored(touch))
    assert other.force_n == pytest.approx(found.force_n, rel=OWN.get(model, 2e-3))
    assert rmse_of_peak(other.displacement, found.displacement[reflection(block)] * [-1.0, 1.0, 1.0]) < 2e-3


@models
def test_what_touches_no_node_moves_nothing(model):
    """The tip is between two nodes of the coarse level, and less deep than the ball is higher at them."""
    case = block_of([4, 4, 2], 1)
    felt = touch_at(case, (0.5, 0.5), 0.01, (0.0, 0.0, -1.0))
    right = fem.online(case, level=0, order=1).respond(felt)
    solver = MODELS[model](replace(case, kept={"calibration": [(felt, right)]}))
    found = solver.respond(touch_at(case, (0.5, 0.375), 1e-3, (0.0, 0.0, -1.0)))
    assert not found.displacement.any() and found.force_n == 0.0
    assert found.reaction_n == 0.0 and found.area_m2 == 0.0


@pytest.mark.parametrize("model", CALIBRATED)
def test_calibrated_forces_are_those_of_elements_within_a_third(calibrated, solvers, answers, whole, model):
    """No other factor fits the calibrating touches better."""
    assert answers[model].force_n == pytest.approx(whole.force_n, rel=0.33)
    touches, right = zip(*calibration(calibrated), strict=True)
    assert force_scale([solvers[model].respond(each) for each in touches], right) == pytest.approx(1.0, abs=1e-6)


def test_contact_at_nodes_is_softer_than_contact_at_all_points(answers, whole):
    """The ball sinks between nodes: a third of the force is missing, and little of the surface."""
    found = answers["vertex_block_descent"]
    assert 0.60 < found.force_n / whole.force_n < 0.75
    assert rmse_of_peak(found.displacement, whole.displacement) < 0.06


BED = Bed(np.array([0.048, 0.048, 0.0]), 0.1, 3e5, np.array([0.0, 0.0, -1.0]))


@pytest.mark.parametrize("model", CALIBRATED)
def test_bodies_that_they_cannot_hold_are_refused(calibrated, model):
    loose = replace(calibrated.body, anchors=[np.empty(0, dtype=np.int64)])
    with pytest.raises(InputError, match="nothing is held"):
        MODELS[model](replace(calibrated, body=loose))
    with pytest.raises(LeftOut):
        MODELS[model](replace(calibrated, body=replace(loose, bed=BED)))


def test_a_bed_bears_what_the_ball_pushes_with(block, touch):
    body = replace(block.body, anchors=[np.empty(0, dtype=np.int64)], bed=BED)
    solver = RELAXED["projective_dynamics"](replace(block, body=body), iterations=200)
    found = solver.respond(touch)
    assert found.reaction_n == pytest.approx(found.force_n, rel=2e-3)


def test_settings_are_those_of_levels_that_the_body_has(block):
    grid = Families(relaxed={"xpbd": [{"level": 0}, {"level": 1}]})
    assert relaxed.settings(replace(block, grid=grid), "xpbd") == [dict(Xpbd())]
