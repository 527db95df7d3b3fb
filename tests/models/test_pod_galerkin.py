"""One reduced model for all contacts: full Galerkin, small forces, weights, samples, two presses, refusals, guard."""

from dataclasses import replace
from time import perf_counter

import numpy as np
import pytest
from scipy.optimize import minimize

from palpate.benchmark.accuracy import errors
from palpate.benchmark.load import Load, Press, Refused, loads_of
from palpate.errors import InputError, NotConverged
from palpate.models.contact_modes.offline import Offline
from palpate.models.kinds import FEM, PODGalerkin
from palpate.studies.tradeoff.settings import Families

RADIUS_M = 0.03
MODEL = PODGalerkin(modes=100, thinned=0.01)


@pytest.fixture(scope="module")
def case(slab_case):
    """The slab with presses of a disc as samples, by quadratic elements on its last level but one."""
    plain = replace(slab_case[0], radius_m=RADIUS_M)
    db = plain.database.take(np.arange(12))
    elements = FEM(order=2, level=0, tolerance=1e-9).prepare(plain)
    fine = np.array([elements.respond(load) for load in loads_of(db.contact, 0.5 * db.force)])
    return replace(plain, database=replace(db, force=0.5 * db.force, fine=fine))


@pytest.fixture(scope="module")
def solver(case):
    return MODEL.prepare(case)


def load_of(case, row=0):
    return Load.at(int(case.database.contact[row]), case.database.force[row])


@pytest.mark.slow
def test_all_points_are_full_galerkin(case):
    """The elements' own energy, minimised over the same modes by another search, has the same minimum."""
    solver = PODGalerkin(modes=5, thinned=0.0, nodes=1).prepare(case)
    elements, load = Offline(case.body, RADIUS_M, 0).elements(0), load_of(case, 3)
    modes, pull = solver._modes, load.presses[0].force @ solver._pull(load.presses[0].node)
    assert modes.shape[2] == 5

    def slope(q):
        return -np.tensordot(modes, elements.force(modes @ q), ((0, 1), (0, 1))) - pull

    def energy(q):
        return elements._equilibrium.energy(elements.rest + modes @ q) - float(pull @ q)

    found = minimize(energy, pull, jac=slope, method="BFGS", options={"gtol": 1e-7 * np.linalg.norm(pull)})
    expected = (solver._surface @ found.x).reshape(-1, 3)
    assert errors(solver.respond(load), expected).rmse_of_peak < 2e-3


def test_few_cells_answer_as_all_do_with_weights_that_are_not_negative(case, solver):
    whole = MODEL.having(thinned=0.0).prepare(case)
    assert (solver._reduced.points.volumes > 0.0).all()
    assert len(solver._reduced.points.volumes) < 0.05 * len(whole._reduced.points.volumes)
    for row in (0, 5):
        load = load_of(case, row).times(0.7)
        assert errors(solver.respond(load), whole.respond(load)).rmse_of_peak < 0.01


def test_small_presses_are_linear_and_add_up_and_a_place_never_pressed_is_answered(case, solver):
    (node, force), body = load_of(case).single(), case.body
    linear = (solver._surface @ (force @ solver._pull(node))).reshape(-1, 3)
    found = 1e9 * solver.respond(Load.at(node, 1e-9 * force))
    assert np.abs(found - linear).max() < 1e-8 * np.abs(linear).max()
    inner = np.setdiff1d(body.fine.surface, np.concatenate([np.arange(len(body.coarse.nodes)), body.anchors[-1]]))
    presses = [Press(int(node), 1e-9 * case.database.force[0]) for node in (inner[0], case.database.contact[0])]
    one, two, both = (solver.respond(Load(tuple(each))) for each in (presses[:1], presses[1:], presses))
    assert np.abs(one + two - both).max() < 1e-6 * np.abs(both).max() and np.abs(one).max() > 0.0


def test_what_it_cannot_do_it_refuses(case, solver):
    node, force = load_of(case).single()
    with pytest.raises(InputError, match="not a free surface node"):
        solver.respond(Load.at(int(case.body.anchors[0][0]), force))
    with pytest.raises(Refused, match="depth"):
        solver.respond(Load((Press(node, moved=np.ones(3)),)))
    told = r"beyond what the modes are made of|as far as any sample|stopped at a residual"
    with pytest.raises(NotConverged, match=told):
        solver.respond(Load.at(node, 100.0 * force))


def test_settings_have_at_most_as_many_modes_as_samples_and_charge_them(case):
    tried = MODEL.tried(case, Families(pod_galerkin={"modes": [4, 100], "tolerances": [0.1, 0.01]}))
    assert [(each.modes, each.thinned) for each in tried] == [(4, 0.01), (12, 0.1), (12, 0.01)]
    fresh = replace(case, used={})
    MODEL.prepare(fresh)
    assert set(fresh.used) - {"buckling"} == {"training", "volumes"}  # whoever makes that one has waited for it
    assert 0.0 < fresh.used["volumes"] < perf_counter()  # a duration, and not a time of that clock
