"""Reduced models of contacts: what they reduce, small loads, places never prepared, the limit, and the guard."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.benchmark.accuracy import errors
from palpate.benchmark.load import Doubted, Load, Press, Refused
from palpate.bodies.material import NAMED
from palpate.effects.patch_load import patch_at, patch_shares
from palpate.errors import InputError, NotConverged
from palpate.models.contact_modes.offline import SOUND, TRIAL_RESIDUAL, Offline, bearing
from palpate.models.kinds import FEM, ContactModes
from palpate.solvers.compliance import compute_compliance

RADIUS = 0.03
SNAPSHOTS = ContactModes()


@pytest.fixture(scope="module")
def pressed(slab_case):
    """The slab under a disc, a contact, and a force that moves it by about 8 % of its size."""
    case, test, _ = slab_case
    return replace(case, radius_m=RADIUS), int(test.contact[0]), 0.75 * test.force[0]


@pytest.fixture(scope="module")
def modes_of(pressed):
    return SNAPSHOTS.prepare(pressed[0])


@pytest.fixture(scope="module")
def exact_at(pressed):
    return FEM(order=2, level=1, tolerance=1e-9).prepare(pressed[0])


def disc(case, contact):
    """Rows of the fine surface in a disc, and their shares in its mean displacement."""
    nodes, shares = patch_shares(case.body.fine, patch_at(case.body, contact, case.radius_m))
    return np.searchsorted(case.body.fine.surface, nodes), shares


def distance_to(found, expected):
    return errors(found, expected).rmse_of_peak


def test_it_answers_as_the_quadratic_elements_that_it_reduces(pressed, modes_of, exact_at):
    case, contact, force = pressed
    columns = SNAPSHOTS.having(modes="columns").prepare(case)
    for share in (1.0, 0.4):
        load = Load.at(contact, share * force)
        expected = exact_at.respond(load)
        assert distance_to(modes_of.respond(load).displacement, expected) < 0.002
        assert distance_to(columns.respond(load).displacement, expected) < 0.01


def test_a_few_presses_on_the_next_level_bring_its_answer_to_the_disc(pressed, exact_at):
    """Of two levels the coarse one is reduced."""
    case, contact, force = pressed
    body = replace(case.body, name="of two levels")
    columns = compute_compliance(body, case.radius_m, contacts=np.array([contact]), order=2)
    case = replace(case, body=body, response=columns)
    rows, _ = disc(case, contact)
    solvers = [SNAPSHOTS.having(modes=modes, nodes=1).prepare(case) for modes in ("snapshots", "finer")]
    for share in (1.0, 0.5):
        load = Load.at(contact, share * force)
        expected = exact_at.respond(load)
        peak = np.linalg.norm(expected, axis=1).max()
        found = [np.linalg.norm(each.respond(load).displacement - expected, axis=1)[rows].max() for each in solvers]
        assert found[1] < 0.6 * found[0] and found[1] < 0.005 * peak


def test_a_place_that_was_never_prepared_is_prepared_when_it_is_asked_for(pressed, modes_of, exact_at):
    case, _, force = pressed
    body = case.body
    inner = np.setdiff1d(body.fine.surface, np.arange(len(body.coarse.nodes)))
    node = int(inner[np.argmax(body.fine.nodes[inner, 0])])
    load = Load.at(node, -0.5 * np.linalg.norm(force) * body.fine.normals[node])
    found = modes_of.respond(load).displacement
    assert (node,) in modes_of.prepared
    again = SNAPSHOTS.prepare(case).respond(load).displacement
    assert np.array_equal(found, again)


def test_a_disc_is_pushed_to_where_a_force_had_it(pressed, modes_of):
    case, contact, force = pressed
    expected = modes_of.respond(Load.at(contact, force)).displacement
    rows, shares = disc(case, contact)
    found = modes_of.respond(Load((Press(contact, moved=shares @ expected[rows]),)))
    assert np.linalg.norm(found.forces[0] - force) < 0.05 * np.linalg.norm(force)
    assert distance_to(found.displacement, expected) < 0.03


def test_two_presses_are_answered_with_the_modes_of_both(pressed, modes_of, exact_at):
    case, contact, force = pressed
    other = int(np.setdiff1d(case.prepared_contacts, contact)[-1])
    inward = -0.4 * np.linalg.norm(force) * case.body.fine.normals[other]
    load = Load((Press(contact, 0.7 * force), Press(other, inward)))
    expected = exact_at.respond(load)
    apart = sum(exact_at.respond(Load((press,))) for press in load.presses)
    found = modes_of.respond(load).displacement
    assert distance_to(found, expected) < min(0.004, 0.5 * distance_to(apart, expected))


def test_the_limit_is_extrapolated_over_levels(pressed, modes_of, exact_at):
    """The linear part of the limit is that of Richardson's ratio, and what is beyond it lies further on, too."""
    case, contact, force = pressed
    limit = SNAPSHOTS.having(target="limit").prepare(case)
    small = 1e-6 * force
    fine, far = (each.prepare_contact(contact).columns @ small for each in (modes_of, limit))
    coarser = FEM(order=2, level=0, tolerance=1e-9).prepare(case)
    coarse, middle = (each.respond(Load.at(contact, small)) for each in (coarser, exact_at))
    change = (middle - coarse).ravel()
    ratio = 1.0 + change @ change / ((far - fine) @ change)
    assert 1.5 <= ratio < 10.0
    assert far == pytest.approx(middle.ravel() + change / (ratio - 1.0), abs=1e-4 * np.abs(middle).max())
    coarse, middle = (each.respond(Load.at(contact, force)) for each in (coarser, exact_at))
    expected = middle + (middle - coarse) / (ratio - 1.0)
    found = limit.respond(Load.at(contact, force)).displacement
    assert distance_to(found, expected) < min(0.004, 0.5 * distance_to(middle, expected))


def test_what_it_does_not_know_is_refused_or_told(pressed, modes_of):
    _, contact, force = pressed
    with pytest.raises(NotConverged, match=r"as far as|squeezed|residual"):
        modes_of.respond(Load.at(contact, 30.0 * force))
    with pytest.raises(NotConverged, match="residual"):
        modes_of.respond(Load.at(contact, np.array([1e200, 0.0, 0.0])))
    with pytest.raises(InputError, match="not a free surface node"):
        modes_of.respond(Load.at(int(pressed[0].body.anchors[0][0]), force))
    with pytest.raises(NotConverged, match="no force was found"):
        modes_of.respond(Load((Press(contact, moved=np.ones(3)),)))
    way = np.array([0.0, 0.0, -1e-3])
    with pytest.raises(Refused, match="same place"):
        modes_of.respond(Load((Press(contact, moved=way), Press(contact, moved=2 * way))))


@pytest.mark.slow
def test_discs_that_overlap_press_together(pressed, modes_of):
    """Two presses that one disc alone would bear are doubted where their sum is not borne, and answered far apart."""
    case, contact, _ = pressed
    nodes, free = case.body.fine.nodes, sorted(set(case.prepared_contacts.tolist()) - {contact})
    away = np.linalg.norm(nodes[free] - nodes[contact], axis=1)
    far = free[int(away.argmax())]
    assert away.max() > 2 * case.radius_m

    def borne(node, share):
        row = modes_of.prepare_contact(node).bearing[0]
        return Press(node, share * row / (row @ row))

    assert np.isfinite(modes_of.respond(Load((borne(contact, 0.3), borne(far, 0.3)))).displacement).all()
    with pytest.raises(NotConverged, match=r"1\.20 times as hard"):
        modes_of.respond(Load((borne(contact, 0.6), borne(contact, 0.6))))


def test_a_force_that_hardly_presses_gets_the_linear_answer(pressed, modes_of):
    _, contact, force = pressed
    columns = modes_of.prepare_contact(contact).columns
    linear = (columns @ force).reshape(-1, 3)
    found = 1e9 * modes_of.respond(Load.at(contact, 1e-9 * force)).displacement
    assert np.abs(found - linear).max() < 1e-8 * np.abs(linear).max()
    for share in (1e-11, 1e-16, 1e-200):
        found = modes_of.respond(Load.at(contact, share * force)).displacement
        np.testing.assert_allclose(found.ravel(), columns @ (share * force), rtol=1e-9)


def test_a_press_that_the_finer_level_bears_is_the_limit_and_one_that_it_does_not_is_lowered(slab_case):
    body, contact = slab_case[0].body, int(slab_case[1].contact[0])
    offline, other = (Offline(body, RADIUS, 0) for _ in range(2))
    assert offline.gap == 1
    shown = offline.contact(contact, "snapshots")
    hard = np.linalg.norm(shown.forces[0])
    assert bearing(offline, [contact], "snapshots")[0] == pytest.approx(-shown.normal / hard)
    other.once(("snapshots", contact), lambda: replace(shown, forces=20 * shown.forces, answers=20 * shown.answers))
    lowered = 1.0 / np.linalg.norm(bearing(other, [contact], "snapshots"))
    assert 0.9 * hard < lowered < 19 * hard
    finer = other.elements(1)
    load = finer.nodal(*other.disc(contact, 1), -lowered * shown.normal)
    moved = finer.settle(load, np.zeros_like(finer.rest), 400, TRIAL_RESIDUAL)
    assert np.linalg.norm(finer.force(moved) + load) <= TRIAL_RESIDUAL * np.linalg.norm(load)
    assert finer.least_det(moved) > 0.9 * SOUND


def test_a_press_beyond_what_is_known_to_be_borne_is_doubted_and_its_answer_kept(slab_case):
    case, contact, force = replace(slab_case[0], radius_m=RADIUS), int(slab_case[1].contact[0]), slab_case[1].force[0]
    solver, load = SNAPSHOTS.prepare(case), Load.at(contact, 0.5 * force)
    expected = solver.respond(load)
    kept = solver.prepared[contact,]
    most = 1.0 / float((kept.bearing @ load.single()[1]).max())
    solver.prepared[contact,] = kept._replace(bearing=1.2 * most * kept.bearing)
    with pytest.raises(Doubted, match="times as hard as finer elements are known to bear") as told:
        solver.respond(load)
    assert np.array_equal(told.value.answer.displacement, expected.displacement)
    solver.prepared[contact,] = kept._replace(bearing=most * kept.bearing)
    assert np.array_equal(solver.respond(load).displacement, expected.displacement)


@pytest.mark.parametrize(
    "law", [law if law == "neo_hookean" else pytest.param(law, marks=pytest.mark.slow) for law in NAMED[1:]]
)
def test_a_law_is_answered_by_its_own_elements(slab_case, law):
    case, test, _ = slab_case
    body, contact = case.body, int(test.contact[0])
    lawful = replace(case, radius_m=RADIUS, body=replace(body, material=replace(body.material, law=law)), used={})
    load = Load.at(contact, 0.6 * test.force[0])
    converged = FEM(order=2, level=1, tolerance=1e-8)
    own, other = (converged.prepare(each).respond(load) for each in (lawful, replace(case, radius_m=RADIUS)))
    found = SNAPSHOTS.prepare(lawful).respond(load).displacement
    assert distance_to(found, own) < min(0.002, 0.25 * distance_to(found, other))
