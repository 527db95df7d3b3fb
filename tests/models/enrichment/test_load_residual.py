"""The residual of stored responses: found where it is there, left out where samples contradict each other."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.benchmark.model import FitOptions
from palpate.models.enrichment.features import Ordered
from palpate.models.enrichment.fitting import gather
from palpate.models.linear_fem import LinearFem
from palpate.models.warped_compliance import LoadResidual, WarpedResponse, turn

OPTIONS = FitOptions(10, {"min": 0.1, "max": 100, "count": 7}, 3, "samples", 1)


@pytest.fixture(scope="module")
def pressed(slab_case):
    """The slab's case with 60 loads at its six training contacts."""
    case = slab_case[0]
    random = np.random.default_rng(0)
    contact = np.repeat(np.unique(case.database.contact), 10)
    force = 0.3 * random.normal(size=(len(contact), 3))
    db = case.database.take(np.zeros(len(contact), dtype=int))
    return case, replace(db, contact=contact, force=force)


def learnt(case, db, base, rows, options=OPTIONS):
    return LoadResidual(db, case.response, base).learn(gather(db, rows, "live", options), options)


def errors(method, db, rows):
    found = [method.respond(int(db.contact[i]), db.force[i]) - db.fine[i] for i in rows]
    return np.array([np.sqrt(np.mean(np.sum(e**2, axis=1))) for e in found]) / db.peaks[rows]


def world(case, db, base, residual):
    """The same samples with fine responses of ``base`` and a residual(contact, force), which turns with the nodes."""
    fine = []
    for contact, force in zip(db.contact.tolist(), db.force, strict=True):
        answer, spins = base.answer(contact, force)
        extra = residual(contact, force)
        fine.append(answer + (extra if spins is None else turn(spins, extra)))
    return replace(db, fine=np.array(fine))


@pytest.mark.parametrize("warped", [False, True])
def test_a_residual_of_the_second_order_is_found_in_axes_that_turn(pressed, warped):
    """Of the linear response of the whole surface: squares of the displacements, different at each node."""
    case, db = pressed
    base = WarpedResponse(db, case.response) if warped else LinearFem(case.response)
    mode = np.random.default_rng(1).normal(size=(3, case.n_surface, 3))

    def residual(contact, force):
        moved = np.tensordot(force, case.response.fine[case.response.row(contact)], 1).mean(axis=0)
        return 20.0 * np.tensordot(moved * np.linalg.norm(moved), mode, 1)

    db = world(case, db, base, residual)
    train, test = np.arange(60)[np.arange(60) % 6 != 0], np.arange(0, 60, 6)
    method = learnt(case, db, base, train)
    plain = LoadResidual(db, case.response, base)
    assert errors(method, db, test).mean() < 0.25 * errors(plain, db, test).mean()
    assert method.kind == "response"


def test_what_is_alike_at_all_contacts_is_learnt_from_the_force(pressed):
    """Contacts held out: a residual that each contact has in its own axes, in its order of the nodes."""
    case, db = pressed
    views, base = Ordered(db, 1, framed=True), LinearFem(case.response)
    mode = np.random.default_rng(1).normal(size=(3, 3 * case.n_surface))

    def residual(contact, force):
        view = views.view(contact)
        local = view.frame.T @ force
        return view.from_slots(0.02 * np.linalg.norm(local) * local @ mode)

    db = world(case, db, base, residual)
    train, test = np.arange(50), np.arange(50, 60)
    method = learnt(case, db, base, train, replace(OPTIONS, split="contacts"))
    assert method.kind == "force"
    assert errors(method, db, test).mean() < 0.2 * errors(LoadResidual(db, case.response, base), db, test).mean()


def test_it_is_exact_to_the_first_order(pressed):
    case, db = pressed
    base = LinearFem(case.response)
    db = world(case, db, base, lambda contact, force: np.full((case.n_surface, 3), 0.05 * force @ force))
    method, contact, force = learnt(case, db, base, np.arange(60)), int(db.contact[0]), db.force[0]
    assert method.kind
    off = [
        np.abs(method.respond(contact, f * force) - base.answer(contact, f * force)[0]).max() / f for f in (1e-2, 1e-3)
    ]
    assert off[0] / off[1] == pytest.approx(10.0, rel=0.3)


def test_nothing_much_is_learnt_from_what_samples_left_out_contradict(pressed):
    """Of noise, which is different in each sample."""
    case, db = pressed
    base, random = LinearFem(case.response), np.random.default_rng(2)
    db = world(case, db, base, lambda contact, force: 0.01 * random.normal(size=(case.n_surface, 3)))
    train, test = np.arange(60)[np.arange(60) % 6 != 0], np.arange(0, 60, 6)
    method, plain = learnt(case, db, base, train), LoadResidual(db, case.response, base)
    assert errors(method, db, test) == pytest.approx(errors(plain, db, test), rel=0.01)


def test_nothing_at_all_is_learnt_where_the_base_is_right(pressed):
    case, db = pressed
    base = LinearFem(case.response)
    db = world(case, db, base, lambda contact, force: np.zeros((case.n_surface, 3)))
    assert learnt(case, db, base, np.arange(60)).kind == ""
