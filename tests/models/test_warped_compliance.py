"""Stored linear responses, and warped ones: rotations are exact, and turn with the body as they must."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.known_deformations import *  # noqa: F403
from scipy.spatial.transform import Rotation

from palpate.benchmark.accuracy import errors
from palpate.benchmark.settings import FitOptions, Widths
from palpate.bodies.mesh import TetMesh
from palpate.errors import InputError
from palpate.models.enrichment.features import Ordered
from palpate.models.enrichment.training_samples import gather
from palpate.models.warped_compliance import LoadResidual
from palpate.models.warped_response import LinearFem, NodalSpins, WarpedResponse, turn, warp
from palpate.solvers.compliance import Compliance

FORCE = np.array([0.1, 0.2, -0.4])


@pytest.fixture(scope="module")
def turns():
    """Rotation vectors, among them none, one of 1e-5 on either side of the series, and more than half a turn."""
    random = np.random.default_rng(0).normal(size=(20, 3))
    random[0] = 0.0
    random[1] *= 0.99e-4 / np.linalg.norm(random[1])
    random[2] *= 1.01e-4 / np.linalg.norm(random[2])
    random[3] *= 4.0 / np.linalg.norm(random[3])
    return random


def test_vectors_are_turned_and_a_warp_is_the_mean_of_the_rotations_on_the_way(turns):
    vectors = np.random.default_rng(1).normal(size=turns.shape)
    assert np.abs(turn(turns, vectors) - Rotation.from_rotvec(turns).apply(vectors)).max() < 1e-14
    points, weights = np.polynomial.legendre.leggauss(20)
    on_the_way = [Rotation.from_rotvec((p + 1) / 2 * turns).apply(vectors) for p in points]
    assert np.abs(warp(turns, vectors) - np.tensordot(weights / 2, on_the_way, 1)).max() < 1e-13


def test_spins_of_a_linear_field_are_half_its_curl(db):
    """Also at the surface, and whatever is stretched or sheared."""
    gradient = np.random.default_rng(0).normal(size=(3, 3))
    expected = 0.5 * np.array(
        [gradient[2, 1] - gradient[1, 2], gradient[0, 2] - gradient[2, 0], gradient[1, 0] - gradient[0, 1]]
    )
    found = NodalSpins(TetMesh(db.coarse_nodes, db.coarse_tetrahedra)).of(db.coarse_nodes @ gradient.T)
    assert np.abs(found - expected).max() < 1e-12


def test_small_loads_are_linear_and_the_rest_is_of_second_order(slab_case):
    case, test, _ = slab_case
    linear, warped = LinearFem(case.response), WarpedResponse(case.meshes, case.response)
    contact, off = int(test.contact[0]), []
    for factor in (1e-3, 1e-4):
        expected = linear.answer(contact, factor * FORCE)[0]
        off.append(np.abs(warped.answer(contact, factor * FORCE)[0] - expected).max() / np.abs(expected).max())
    assert off[0] / off[1] == pytest.approx(10.0, rel=0.05)


def test_a_turned_body_answers_turned(slab_case, rotation):
    """Turning the rest shape, its stored responses and the force turns the answer and the rotations."""
    case, test, _ = slab_case
    db, response, q = case.meshes, case.response, rotation(0.7)
    turned = [np.einsum("ij,cjnk,lk->cinl", q, getattr(response, name), q) for name in ("fine", "restricted", "coarse")]
    there = WarpedResponse(replace(db, coarse_nodes=db.coarse_nodes @ q.T), Compliance(response.contacts, *turned))
    here, contact = WarpedResponse(db, response), int(test.contact[0])
    for found, expected in zip(there.answer(contact, q @ FORCE), here.answer(contact, FORCE), strict=True):
        assert np.abs(found - expected @ q.T).max() < 1e-12


def test_the_force_turns_back_with_its_contact(slab_case):
    """Where the contact alone turns, by a right angle about z, the body answers the force as seen from there."""
    case, test, _ = slab_case
    method, contact = WarpedResponse(case.meshes, case.response), int(test.contact[0])
    row = case.response.row(contact)
    method._spins[row] = 0.0
    force = np.array([1.0, 0.0, 0.0])
    method._spins[row, 0, contact] = [0.0, 0.0, np.pi / 2]
    found = method.answer(contact, force)[0]
    assert np.abs(found - LinearFem(case.response).answer(contact, np.array([0.0, -1.0, 0.0]))[0]).max() < 1e-12


def test_under_small_loads_each_node_is_turned_by_half_its_rotation(slab_case):
    """A displacement grows with the load, and so does its rotation: on the way there it was half as large."""
    case, test, _ = slab_case
    contact, force = int(test.contact[0]), 1e-3 * FORCE
    answer, turns = WarpedResponse(case.meshes, case.response).answer(contact, force)
    row = case.response.row(contact)
    there = NodalSpins(TetMesh(case.meshes.coarse_nodes, case.meshes.coarse_tetrahedra))
    back = -there.of(np.tensordot(force, case.response.restricted[row], 1))[contact]
    local = LinearFem(case.response).answer(contact, force + np.cross(back, force))[0]
    beyond = answer - local
    assert np.abs(beyond - 0.5 * np.cross(turns, local)).max() < 0.05 * np.abs(beyond).max()


def test_the_linear_rival_is_the_compliance_times_the_force(slab_compliance):
    method, row = LinearFem(slab_compliance), 11
    contact, force = int(slab_compliance.contacts[row]), np.array([0.3, -0.2, 0.5])
    x, y, z = slab_compliance.fine[row]
    expected = 0.3 * x - 0.2 * y + 0.5 * z
    for coarse in (slab_compliance.coarse[row, 0], np.full_like(slab_compliance.coarse[row, 0], np.nan)):
        assert np.abs(method.predict(coarse, contact, force) - expected).max() < 1e-15
    with pytest.raises(InputError, match="contact 0 is not a free"):
        method.predict(coarse, 0, force)


OPTIONS = FitOptions(neighbours=10, sigma_relative=Widths(min=0.1, max=100, count=7), folds=3, split="samples", seed=1)


@pytest.fixture(scope="module")
def pressed(slab_case):
    """The slab's case with 60 loads at its six training contacts."""
    case = slab_case[0]
    random = np.random.default_rng(0)
    contact = np.repeat(np.unique(case.database.contact), 10)
    force = 0.3 * random.normal(size=(len(contact), 3))
    db = case.database.take(np.zeros(len(contact), dtype=int))
    return case, replace(db, contact=contact, force=force)


TRAIN, TEST = np.arange(60)[np.arange(60) % 6 != 0], np.arange(0, 60, 6)


def taught(pressed, base, residual, train=TRAIN, options=OPTIONS):
    """Samples of ``base`` and a residual(contact, force) that turns with the nodes; who learns them, who does not."""
    case, db = pressed
    fine = []
    for contact, force in zip(db.contact.tolist(), db.force, strict=True):
        answer, spins = base.answer(contact, force)
        extra = residual(contact, force)
        fine.append(answer + (extra if spins is None else turn(spins, extra)))
    db = replace(db, fine=np.array(fine))
    method, plain = (LoadResidual(db, case.response, base) for _ in range(2))
    return db, method.learn(gather(db.take(train), "live", options)), plain


def errors_of(method, db, rows):
    return np.array([errors(method.respond(int(db.contact[i]), db.force[i]), db.fine[i]).rmse_of_peak for i in rows])


@pytest.mark.parametrize("warped", [False, True])
def test_a_residual_of_the_second_order_is_found_in_axes_that_turn(pressed, warped):
    """Of the linear response of the whole surface: squares of the displacements, different at each node."""
    case, db = pressed
    base = WarpedResponse(db, case.response) if warped else LinearFem(case.response)
    mode = np.random.default_rng(1).normal(size=(3, case.n_surface, 3))

    def residual(contact, force):
        moved = np.tensordot(force, case.response.fine[case.response.row(contact)], 1).mean(axis=0)
        return 20.0 * np.tensordot(moved * np.linalg.norm(moved), mode, 1)

    db, method, plain = taught(pressed, base, residual)
    assert errors_of(method, db, TEST).mean() < 0.25 * errors_of(plain, db, TEST).mean()
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

    db, method, plain = taught(pressed, base, residual, np.arange(50), OPTIONS.but(split="contacts"))
    assert method.kind == "force"
    assert errors_of(method, db, range(50, 60)).mean() < 0.2 * errors_of(plain, db, range(50, 60)).mean()


def test_it_is_exact_to_the_first_order(pressed):
    base, shape = LinearFem(pressed[0].response), (pressed[0].n_surface, 3)
    db, method, plain = taught(
        pressed, base, lambda contact, force: np.full(shape, 0.05 * force @ force), np.arange(60)
    )
    assert method.kind
    asked = [(int(db.contact[0]), factor * db.force[0]) for factor in (1e-2, 1e-3)]
    off = [np.abs(method.respond(*a) - plain.respond(*a)).max() / np.linalg.norm(a[1]) for a in asked]
    assert off[0] / off[1] == pytest.approx(10.0, rel=0.3)
