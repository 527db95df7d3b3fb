"""Few coordinates against all of them: full Galerkin, small loads, chosen cells, the minimum itself."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import nnls

from palpate.bodies.material import LAWS, NAMED
from palpate.bodies.refinement import finer
from palpate.effects.patch_load import patch_at, patch_shares
from palpate.errors import NotConverged
from palpate.models.contact_modes.elements_at_rest import ElementsAtRest
from palpate.models.contact_modes.offline import penalised_fit
from palpate.models.contact_modes.snapshots import (
    NEAR_RINGS,
    SNAPSHOT_RESIDUAL,
    basis_of,
    carried,
    columns_of_contact,
    contact_energy,
    linear_columns,
    press_contact,
)
from palpate.models.reduced import cholesky, cubature
from palpate.models.reduced.basis import bending_loads, independent, orthonormal, products
from palpate.models.reduced.cubature import points_and_means, rings_around, sparse_weights
from palpate.models.reduced.cubature_points import elastic, scratch_of
from palpate.models.reduced.energy import ReducedEnergy

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
    points = points_and_means(elements, modes, everything)
    assert points.stiffness == pytest.approx(np.eye(modes.shape[2]), abs=ROUNDING)
    model = ReducedEnergy(points, carried(shown.nodes, shown.shares, modes), elements.law)
    found = model.settle(shown.forces[0], 1e-9)
    pull = elements.force(modes @ found.q) + elements.nodal(shown.nodes, shown.shares, shown.forces[0])
    assert found.residual <= 1e-9
    left = np.tensordot(modes, pull, ((0, 1), (0, 1)))
    assert np.linalg.norm(left) < ROUNDING * np.linalg.norm(model.loads @ shown.forces[0])


def test_few_averaged_cells_are_exact_for_small_loads_and_near_for_large_ones(pressed):
    shown = pressed()
    modes = basis_of([shown])
    thin = contact_energy([shown], modes, 1, 1e-3, 0)
    whole = points_and_means(shown.elements, modes, rings_around(shown.elements, shown.nodes, 1))
    assert len(thin.points.volumes) < 0.5 * len(whole.volumes) and (thin.points.volumes > 0.0).all()
    small = thin.settle(1e-9 * shown.forces[0], 1e-3).q
    assert np.abs(small - 1e-9 * thin.loads @ shown.forces[0]).max() < 1e-8 * np.abs(small).max()
    answers_snapshots(thin, shown, modes)


def test_one_mean_of_elements_that_come_from_one_is_that_of_the_whole(slab):
    """Displacements that are linear in space have the same gradient everywhere, whichever elements are averaged."""
    elements = ElementsAtRest(finer(slab), 1)
    gradient = np.array([[0.1, 0.2, 0.0], [0.0, -0.3, 0.1], [0.2, 0.0, 0.4]])
    modes = (elements.rest @ gradient)[:, :, None]
    exact = rings_around(elements, np.array([0]), 0)
    points = points_and_means(elements, modes, exact, 8)
    assert len(exact) / 8 < len(points.volumes) < 0.5 * len(exact)
    assert points.volumes.sum() == pytest.approx(elements.volumes.sum(), rel=1e-12)
    expected = np.tile(gradient.T.ravel()[:, None], len(points.volumes))
    assert points.slopes[:, :, 0] == pytest.approx(expected, abs=1e-12)


def test_few_points_of_those_that_are_drawn_pull_as_the_elements_do(pressed, monkeypatch):
    """With all elements exact, cells come from what is near the disc and a quarter of the rest."""
    shown = pressed()
    modes, elements = basis_of([shown]), shown.elements
    far = 4 * np.count_nonzero(~rings_around(elements, shown.nodes, NEAR_RINGS))
    monkeypatch.setattr(cubature, "FEW", far // 4)
    thin = contact_energy([shown], modes, 50, 1e-3, 0)
    assert 0 < len(thin.points.volumes) < far
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
    square = products(modes, shown.elements.multiply(np.ascontiguousarray(modes)))
    assert square == pytest.approx(np.eye(modes.shape[2]), abs=ROUNDING)
    twice = orthonormal(shown.elements, np.dstack([shown.columns, shown.columns]))
    assert twice.shape[2] == 9


def test_fewer_modes_hold_what_they_can_and_twins_make_none():
    columns = np.random.default_rng(0).normal(size=(8, 3, 6)) * [3.0, 1.0, 1.0, 1.0, 0.1, 0.1]
    square = products(columns, columns)
    size = square.diagonal()
    held = np.sum((independent(square)[:, -2:].T @ square) ** 2 / size)
    assert held == pytest.approx(np.linalg.eigvalsh(square / np.sqrt(np.outer(size, size)))[-2:].sum(), rel=1e-8)
    assert independent(np.tile(square, (2, 2))).shape == (12, 6)


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
    joined = bending_loads(elements, shown.linear, shown.linear)[:, :, [0, 1, 2, 4, 5, 8]]
    own = bending_loads(elements, shown.linear)
    assert np.linalg.norm(joined - own) < 0.01 * np.linalg.norm(own)


def gradient(model, q):
    return elastic(q, model.body, scratch_of(model.body))[1]


@few_laws
def test_the_tangent_is_the_derivative_of_the_gradient(pressed, law):
    """At a pressed state, of points and of the few cells that are chosen, the change of geometry included."""
    shown = pressed(law)
    modes = basis_of([shown])
    points = points_and_means(shown.elements, modes, np.ones(len(shown.elements.couples), dtype=bool))
    whole = ReducedEnergy(points, carried(shown.nodes, shown.shares, modes), shown.elements.law)
    for model in (whole, contact_energy([shown], modes, 1, 1e-2, 0)):
        q = model.settle(shown.forces[0], 1e-3).q
        step = 1e-5 * np.linalg.norm(q)
        found, ways = model.tangent(q), step * np.eye(len(q))
        by_differences = [(gradient(model, q + way) - gradient(model, q - way)) / (2 * step) for way in ways]
        assert found == pytest.approx(np.array(by_differences), abs=1e-6 * np.abs(found).max())
        assert model.tangent(np.zeros(len(q))) == pytest.approx(np.eye(len(q)), abs=1e-9)


def test_a_matrix_is_factored_where_its_eigenvalues_are_positive():
    draw = np.random.default_rng(0)
    for least in (0.1, 1e-6, -1e-6, -0.5):
        turn = np.linalg.qr(draw.normal(size=(7, 7)))[0]
        matrix, x = turn @ np.diag([least, *range(1, 7)]) @ turn.T, draw.normal(size=7)
        factored, found = matrix.copy(), matrix @ x
        assert cholesky.factor(factored) == (least > 0.0)
        if least > 0.0:
            cholesky.solve(factored, found)
            assert found == pytest.approx(x, rel=1e-8)
    assert not cholesky.factor(np.full((3, 3), np.nan))


def test_few_rows_replace_all_with_positive_weights():
    pulls = np.random.default_rng(0).random((60, 12))
    target = pulls.sum(axis=0)
    chosen, weights = sparse_weights(pulls, target, 1e-8)
    assert (weights > 0.0).all() and len(chosen) <= 12
    whole = nnls(pulls.T, target)[1] / np.linalg.norm(target)
    assert np.linalg.norm(weights @ pulls[chosen] - target) <= max(whole, 1e-8) * np.linalg.norm(target) * 1.01
    fewer, _ = sparse_weights(pulls, target, 0.05)
    assert len(fewer) < len(chosen)
    # rounding is as like what is left as anything: a row that does not pull would get a weight beyond all others
    draw = np.random.default_rng(0)
    pulls = np.vstack([draw.random((40, 20)), 1e-25 * draw.normal(size=(4000, 20))])
    target = pulls.sum(axis=0)
    chosen, weights = sparse_weights(pulls, target, 1e-3)
    assert chosen.max() < 40 and weights.max() < 1e3
    assert np.linalg.norm(weights @ pulls[chosen] - target) <= 1e-3 * np.linalg.norm(target)


def test_a_body_that_keeps_its_volume_is_refused(slab):
    with pytest.raises(NotConverged, match="mean dilatation"):
        ElementsAtRest(replace(slab, material=replace(slab.material, poisson=0.49)), 0)


def test_weak_presses_are_met_as_well_as_hard_ones_and_one_that_moves_nothing_is_left_out():
    rng = np.random.default_rng(0)
    seen, truth = rng.normal(size=(8, 6)) * [1.0, 1.0, 1.0, 0.03, 0.03, 0.03], rng.normal(size=(5, 3, 8))
    wanted = truth @ seen
    left = np.linalg.norm(penalised_fit(seen, wanted) @ seen - wanted, axis=(0, 1))
    assert left.max() <= 0.01 * np.linalg.norm(wanted[:, :, 3:], axis=(0, 1)).min()
    seen, wanted = np.diag([1.0, 2.0, 0.0]), np.ones((2, 3, 3))
    assert np.isfinite(penalised_fit(seen, wanted)).all()
    assert penalised_fit(seen, wanted) @ seen[:, :2] == pytest.approx(wanted[:, :, :2], rel=1e-3)
