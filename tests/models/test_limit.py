"""The limit of ever finer levels: what it brings answers nearer to, who is charged for it, and whom it refuses."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.stub import Stub

from palpate.benchmark.accuracy import errors
from palpate.benchmark.load import Answer, Doubted, Load, Press, Refused, displacement_of
from palpate.benchmark.model import LIMIT, Case
from palpate.benchmark.richardson import limit
from palpate.bodies.body import nest
from palpate.bodies.refinement import finer
from palpate.errors import InputError
from palpate.models.fem_statics import Simulation
from palpate.models.kinds import FEM, FastFEM, LinearFEM, WarpedCompliance
from palpate.models.limit import ToLimit, limit_columns
from palpate.solvers.compliance import compute_compliance
from palpate.solvers.equilibrium import FastEquilibrium

RADIUS_M = 0.04
FAST = FastFEM(level=1, iterations=30)
COARSER = [FEM(order=order, level=0, tolerance=1e-6) for order in (1, 2)]


@pytest.fixture(scope="module")
def case(box, soft):
    """A box of 24 coarse elements, refined once and held at one end, with two contacts on its top."""
    mesh = box([2, 2, 1], [0.2, 0.1, 0.1])
    body = nest("box", mesh, 1, np.flatnonzero(mesh.nodes[:, 0] == 0.0), soft)
    top = np.flatnonzero((mesh.nodes[:, 2] == 0.1) & (mesh.nodes[:, 0] > 0.0) & (mesh.nodes[:, 1] == 0.05))
    plain = Case.untrained(body, "large", RADIUS_M, 1, 1e-8)
    return replace(plain, response=compute_compliance(body, RADIUS_M, contacts=top, order=2))


@pytest.fixture(scope="module")
def load(case):
    """An oblique press in the middle of the top."""
    return Load.at(case.prepared_contacts[0], np.array([0.02, 0.04, -0.12]))


def answered(case, model, load):
    return displacement_of(model.prepare(case).respond(load))


def surface(case, level, load):
    """The converged answer of quadratic elements of a level, which may be finer than the body's."""
    whole = replace(case, body=finer(case.body, max(0, level - 1)))
    moved = Simulation(whole, level, 1e-6, order=2, solver=FastEquilibrium).displacement(load)
    return moved[case.body.fine.surface]


@pytest.fixture(scope="module")
def truth(case, load):
    """Of levels beyond those that the models know."""
    return limit(np.array([surface(case, level, load) for level in (1, 2, 3)]))


@pytest.mark.parametrize("model", [FAST, *COARSER])
def test_answers_of_elements_come_three_times_as_near_to_the_limit(case, load, truth, model):
    found = (answered(case, each, load) for each in (model, model.having(target=LIMIT)))
    own, brought = (errors(answer, truth).rmse_of_peak for answer in found)
    assert brought < own / 3.0


@pytest.mark.parametrize("model", [FAST, LinearFEM(), WarpedCompliance()])
def test_to_the_first_order_all_have_the_same_limit(case, load, model):
    contact, force = load.single()
    expected = np.tensordot(force, limit_columns(case)[case.response.row(contact)], 1)
    found = 1e6 * answered(case, model.having(target=LIMIT), load.times(1e-6))
    assert np.abs(found - expected).max() < 1e-4 * np.abs(expected).max()


def test_its_columns_are_made_once_and_charged_to_each(case):
    fresh = replace(case, used={}, kept=type(case.kept)())
    for first in (True, False):
        fresh.used.clear()
        limit_columns(fresh)
        assert ("limit columns" in fresh.used) != first and "compliance" in fresh.used
    assert fresh.used["limit columns"] > 0.0


def test_doubts_and_forces_are_kept(case, load):
    """What is answered, doubted or not, moves by the same amount."""
    moved = np.zeros((case.n_surface, 3))

    def doubt(load):
        raise Doubted("no", [1.0], Answer(moved, error=0.5))

    sure, unsure = (
        ToLimit(case, Stub(respond=each), 0 * case.response.fine) for each in (lambda load: Answer(moved), doubt)
    )
    with pytest.raises(Doubted, match="no") as raised:
        unsure.respond(load)
    assert raised.value.answer.error == 0.5
    assert np.array_equal(raised.value.answer.displacement, sure.respond(load).displacement)
    assert np.abs(sure.respond(load).displacement).max() > 0.0


def test_what_it_cannot_bring_there_it_refuses(case, load):
    solver = FAST.having(target=LIMIT).prepare(case)
    node, force = load.single()
    with pytest.raises(Refused, match="not a depth"):
        solver.respond(Load((Press(node, moved=np.array([0.0, 0.0, -0.01])),)))
    other = np.setdiff1d(case.body.coarse.surface, [*case.prepared_contacts, *case.body.anchors[0]])[0]
    with pytest.raises(InputError, match="not one of the contacts that are prepared"):
        solver.respond(Load.at(int(other), force))
    assert FAST.having(target=LIMIT).needs_contacts and not FAST.needs_contacts
    single = replace(case.body, levels=case.body.levels[:1])
    with pytest.raises(Refused, match="one level"):
        limit_columns(replace(case, body=single))
