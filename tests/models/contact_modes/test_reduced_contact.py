"""Few coordinates against all of them: full Galerkin, small loads, chosen cells, the minimum itself."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize, nnls

from palpate.bodies.material import LAWS, NAMED
from palpate.bodies.refinement import finer
from palpate.effects.patch_load import patch_at, patch_shares
from palpate.errors import NotConverged
from palpate.models.contact_modes import snapshots
from palpate.models.contact_modes.elements_at_rest import ElementsAtRest
from palpate.models.contact_modes.reduced_contact import (
    ReducedContact,
    cell_stresses,
    cells_of,
    few_of,
    is_positive,
    rings_around,
)
from palpate.models.contact_modes.snapshots import (
    SNAPSHOT_RESIDUAL,
    basis_of,
    columns_of_contact,
    linear_columns,
    orthonormal,
    press_contact,
    second_columns,
    thinned_model,
    whole_model,
)
from palpate.models.contact_modes.workshop import fitted

RADIUS, NEWTONS = 0.03, 1.0
few_laws = pytest.mark.parametrize(
    "law",
    [law if law in ("corotational", "neo_hookean") else pytest.param(law, marks=pytest.mark.slow) for law in NAMED],
)
ROUNDING = 1e-5
"""Columns that are nearly dependent, to 1e-9 of their energy, leave as much of it."""


@pytest.fixture(scope="module")
def pressed(slab):
    """Return what makes the elements of a law, and the snapshots of one contact."""

    def make(law=LAWS[0]):
        body = replace(slab, material=replace(slab.material, law=law))
        elements = ElementsAtRest(body, 0)
        disc = patch_shares(body.coarse, patch_at(body, contact(body), RADIUS), 2)
        return press_contact(columns_at(elements, disc, body.fine.normals[contact(body)]))

    return make


def columns_at(elements, disc, normal):
    return columns_of_contact(elements, *disc, normal, NEWTONS, linear_columns(elements, *disc))


def contact(body):
    """The coarse surface node that is farthest from what is held."""
    return int(body.coarse.surface[np.argmax(body.coarse.nodes[body.coarse.surface, 0])])


def answers_snapshots(model, shown, modes):
    for k, force in enumerate(shown.forces):
        moved = modes @ model.settle(force, 1e-3).q
        assert np.linalg.norm(moved - shown.answers[:, :, k]) < 0.02 * np.linalg.norm(moved)


@few_laws
def test_all_points_as_cells_are_full_galerkin(pressed, law):
    shown = pressed(law)
    elements, modes = shown.elements, basis_of([shown])
    everything = np.ones(len(elements.couples), dtype=bool)
    cells = cells_of(elements, modes, everything)
    assert cells.stiffness == pytest.approx(np.eye(modes.shape[2]), abs=ROUNDING)
    model = ReducedContact(cells, np.tensordot(modes[shown.nodes], shown.shares, (0, 0)).T, elements.law)
    found = model.settle(shown.forces[0], 1e-9)
    pull = elements.force(modes @ found.q) + elements.nodal(shown.nodes, shown.shares, shown.forces[0])
    assert found.residual <= 1e-9
    left = np.tensordot(modes, pull, ((0, 1), (0, 1)))
    assert np.linalg.norm(left) < ROUNDING * np.linalg.norm(model.loads @ shown.forces[0])


def test_averaged_cells_are_exact_for_small_loads_and_near_for_large_ones(pressed):
    shown = pressed()
    modes = basis_of([shown])
    model, thin = whole_model([shown], modes, 1), thinned_model([shown], modes, 1, 1e-3, 0)
    assert len(thin.cells.volumes) < 0.5 * len(model.cells.volumes) and (thin.cells.volumes > 0.0).all()
    for each in (model, thin):
        small = each.settle(1e-9 * shown.forces[0], 1e-3).q
        assert np.abs(small - 1e-9 * each.loads @ shown.forces[0]).max() < 1e-8 * np.abs(small).max()
        answers_snapshots(each, shown, modes)


def test_one_mean_of_elements_that_come_from_one_is_that_of_the_whole(slab):
    """Displacements that are linear in space have the same gradient everywhere, whichever elements are averaged."""
    elements = ElementsAtRest(finer(slab), 1)
    gradient = np.array([[0.1, 0.2, 0.0], [0.0, -0.3, 0.1], [0.2, 0.0, 0.4]])
    modes = (elements.rest @ gradient)[:, :, None]
    exact = rings_around(elements, np.array([0]), 0)
    cells = cells_of(elements, modes, exact, 8)
    assert len(exact) / 8 < len(cells.volumes) < 0.5 * len(exact)
    assert cells.volumes.sum() == pytest.approx(elements.volumes.sum(), rel=1e-12)
    expected = np.tile(gradient.T.ravel()[:, None], len(cells.volumes))
    assert cells.slopes[:, :, 0] == pytest.approx(expected, abs=1e-12)


def test_few_points_of_those_that_are_drawn_pull_as_the_elements_do(pressed, monkeypatch):
    """With all elements exact, cells come from what is near the disc and a quarter of the rest."""
    shown = pressed()
    modes, elements = basis_of([shown]), shown.elements
    far = 4 * np.count_nonzero(~rings_around(elements, shown.nodes, snapshots.NEAR_RINGS))
    monkeypatch.setattr(snapshots, "FEW", far // 4)
    thin = thinned_model([shown], modes, 50, 1e-3, 0)
    assert 0 < len(thin.cells.volumes) < far
    answers_snapshots(thin, shown, modes)


def test_snapshots_are_answers_however_far_a_press_turns_the_body(slab):
    """At the free edge of a thin plate four steps leave more than the load itself."""
    thin = replace(slab, levels=[replace(mesh, nodes=mesh.nodes * [1.0, 1.0, 0.3]) for mesh in slab.levels])
    elements, disc = ElementsAtRest(thin, 0), patch_shares(thin.coarse, patch_at(thin, contact(thin), RADIUS), 2)
    shown = press_contact(columns_at(elements, disc, np.array([0.0, 0.0, 1.0])))
    for k, force in enumerate(shown.forces):
        load = elements.nodal(shown.nodes, shown.shares, force)
        pull = elements.force(shown.answers[:, :, k]) + load
        assert np.linalg.norm(pull) <= SNAPSHOT_RESIDUAL * np.linalg.norm(load)


def test_the_modes_are_orthonormal_in_the_stiffness(pressed):
    shown = pressed()
    modes = basis_of([shown])
    stiff = np.stack([shown.elements.multiply(np.ascontiguousarray(m)) for m in np.moveaxis(modes, 2, 0)], axis=2)
    assert np.tensordot(modes, stiff, ((0, 1), (0, 1))) == pytest.approx(np.eye(modes.shape[2]), abs=ROUNDING)
    twice = orthonormal(shown.elements, np.dstack([shown.columns, shown.columns]))
    assert twice.shape[2] == 9


def test_second_columns_are_what_a_small_press_adds(pressed):
    """What a press moves beyond its linear response, at the rate of its square, lies in them."""
    shown = pressed()
    elements, force = shown.elements, 1e-2 * shown.forces[0]
    load = elements.nodal(shown.nodes, shown.shares, force)
    linear = shown.linear @ force
    moved = elements.settle(load, linear, 60, 1e-10)
    beyond = (moved - linear).ravel()
    columns = shown.second.reshape(len(beyond), -1)
    left = beyond - columns @ np.linalg.lstsq(columns, beyond, rcond=None)[0]
    assert np.linalg.norm(left) < 0.05 * np.linalg.norm(beyond)
    joined = second_columns(elements, shown.linear, shown.linear)[:, :, [0, 1, 2, 4, 5, 8]]
    own = second_columns(elements, shown.linear) * [2.0, 1.0, 1.0, 2.0, 1.0, 2.0]  # two of one are twice as far
    assert np.linalg.norm(joined - own) < 0.01 * np.linalg.norm(own)


def test_the_minimum_is_that_of_another_search(pressed):
    shown = pressed()
    modes = basis_of([replace(shown, found=False)])
    model, force = whole_model([shown], modes, 1), shown.forces[0]
    load = model.loads @ force

    def energy(q):
        f = (model.cells.slopes @ q).T.reshape(-1, 3, 3) + np.eye(3)
        s = np.linalg.svd(f, compute_uv=False)
        assert (np.linalg.det(f) > 0.0).all()
        strain = s - 1.0
        density = model.cells.mu * (strain**2).sum(axis=1) + 0.5 * model.cells.lam * strain.sum(axis=1) ** 2
        rest = np.eye(len(q)) - model.cells.stiffness
        return density @ model.cells.volumes + 0.5 * q @ rest @ q - load @ q

    found = minimize(energy, load, method="BFGS", options={"gtol": 1e-7 * np.linalg.norm(load)})
    assert model.settle(force, 1e-7).q == pytest.approx(found.x, abs=1e-4 * np.abs(found.x).max())


def gradient(model, q):
    slopes, volumes, *moduli = model.cells
    flat, count = slopes.reshape(-1, len(q)), len(volumes)
    stress = np.empty((9, count))
    scratch = np.empty((9, count)), stress, np.empty(count), np.empty(count, dtype=bool)
    cell_stresses(q, flat, volumes, *moduli, *model.law, *scratch)
    return stress.ravel() @ flat + model.rest @ q


@few_laws
def test_the_tangent_is_the_derivative_of_the_gradient(pressed, law):
    """At a pressed state, of points and of the few cells that are chosen, the change of geometry included."""
    shown = pressed(law)
    modes = basis_of([shown])
    for model in (whole_model([shown], modes, 1), thinned_model([shown], modes, 1, 1e-2, 0)):
        q = model.settle(shown.forces[0], 1e-3).q
        step = 1e-5 * np.linalg.norm(q)
        found, ways = model.tangent(q), step * np.eye(len(q))
        by_differences = [(gradient(model, q + way) - gradient(model, q - way)) / (2 * step) for way in ways]
        assert found == pytest.approx(np.array(by_differences), abs=1e-6 * np.abs(found).max())
        assert model.tangent(np.zeros(len(q))) == pytest.approx(np.eye(len(q)), abs=1e-9)


def test_a_matrix_is_positive_where_its_eigenvalues_are():
    draw = np.random.default_rng(0)
    for least in (0.1, 1e-6, -1e-6, -0.5):
        turn = np.linalg.qr(draw.normal(size=(7, 7)))[0]
        assert is_positive(turn @ np.diag([least, *range(1, 7)]) @ turn.T) == (least > 0.0)
    assert not is_positive(np.full((3, 3), np.nan))


def test_few_columns_replace_all_with_positive_weights():
    pulls = np.random.default_rng(0).random((12, 60))
    target = pulls.sum(axis=1)
    chosen, weights = few_of(pulls, target, 1e-8)
    assert (weights > 0.0).all() and len(chosen) <= 12
    whole = nnls(pulls, target)[1] / np.linalg.norm(target)
    assert np.linalg.norm(pulls[:, chosen] @ weights - target) <= max(whole, 1e-8) * np.linalg.norm(target) * 1.01
    fewer, _ = few_of(pulls, target, 0.05)
    assert len(fewer) < len(chosen)
    # rounding is as like what is left as anything: a column that does not pull would get a weight beyond all others
    draw = np.random.default_rng(0)
    pulls = np.hstack([draw.random((20, 40)), 1e-25 * draw.normal(size=(20, 4000))])
    target = pulls.sum(axis=1)
    chosen, weights = few_of(pulls, target, 1e-3)
    assert chosen.max() < 40 and weights.max() < 1e3
    assert np.linalg.norm(pulls[:, chosen] @ weights - target) <= 1e-3 * np.linalg.norm(target)


def test_a_body_that_keeps_its_volume_is_refused(slab):
    with pytest.raises(NotConverged, match="mean dilatation"):
        ElementsAtRest(replace(slab, material=replace(slab.material, poisson=0.49)), 0)


def test_weak_presses_are_met_as_well_as_hard_ones_and_one_that_moves_nothing_is_left_out():
    rng = np.random.default_rng(0)
    seen, truth = rng.normal(size=(8, 6)) * [1.0, 1.0, 1.0, 0.03, 0.03, 0.03], rng.normal(size=(5, 3, 8))
    wanted = truth @ seen
    left = np.linalg.norm(fitted(seen, wanted) @ seen - wanted, axis=(0, 1))
    assert left.max() <= 0.01 * np.linalg.norm(wanted[:, :, 3:], axis=(0, 1)).min()
    seen, wanted = np.diag([1.0, 2.0, 0.0]), np.ones((2, 3, 3))
    assert np.isfinite(fitted(seen, wanted)).all()
    assert fitted(seen, wanted) @ seen[:, :2] == pytest.approx(wanted[:, :, :2], rel=1e-3)
