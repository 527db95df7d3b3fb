"""Displacements that jump across a cut: against elements on meshes that conform, and against all unknowns at once."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.cut_cases import answer, hook
from scipy import sparse
from scipy.sparse.linalg import spsolve

from palpate.benchmark.cut_truth import pull_errors
from palpate.benchmark.load import Refused
from palpate.bodies.body import nest
from palpate.bodies.cutting.cut import blade
from palpate.bodies.mesh import TetMesh
from palpate.bodies.refinement import QUADRATURE_POINTS
from palpate.bodies.simple_shapes import box
from palpate.effects.elements import shape_gradients
from palpate.effects.linear_elements import LinearElements
from palpate.linalg.block_pattern import hold
from palpate.models.cut import elements, enriched
from palpate.models.cut.enriched import Enriched, assembled, integrals

ORDERS = [1, 2]


@pytest.fixture(scope="module")
def small(opening):
    """A pull whose answer is linear, on a mesh that is coarse."""
    mesh = box([0.1, 0.1, 0.04], [4, 4, 2])
    body = nest("slab", mesh, 1, np.flatnonzero(mesh.nodes[:, 2] == 0.0), opening.body.material)
    return replace(
        opening, body=body, hooks=[hook(body, [0.05, 0.05 + y, 0.04], [0.0, 1e-4 * y, 1e-6]) for y in (0.025, -0.025)]
    )


@pytest.fixture(scope="module")
def right(small):
    return answer(elements.online(small, level=1, way=elements.CONFORM))


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize(
    "at", [pytest.param(0.05, marks=pytest.mark.slow), 0.05 + 1e-9, pytest.param(0.0537, marks=pytest.mark.slow)]
)
def test_a_bar_that_is_severed_follows_its_hook_without_a_force(severed, at, order):
    """Up to how ψ varies where the front is far away: the patch is a disc."""
    case = severed(at)
    found, shift = answer(Enriched(case, level=0, order=order)), case.hooks[0].shift_m
    along = case.body.fine.nodes[case.body.fine.surface][:, 0]
    right = np.where(along[:, None] > at + 1e-8, shift, 0.0)
    off = np.abs(found.displacement - right)[np.abs(along - at) > 1e-8]
    assert off.max() < 2e-3 * np.linalg.norm(shift)
    assert abs(found.force[0]) < 1e-5


@pytest.mark.parametrize(
    ("order", "surface", "wide", "force"),
    [(1, 0.06, 0.4, 0.6), pytest.param(2, 0.01, 0.1, 0.1, marks=pytest.mark.slow)],
)
def test_lips_open_as_on_a_mesh_that_conforms(small, right, order, surface, wide, force):
    errors = pull_errors(answer(Enriched(small, level=0, order=order)), right)
    assert errors[0] < surface and errors[1] < wide and errors[2] < force


def test_a_cut_without_area_changes_no_answer(slab, opening):
    path = np.array([[0.031, 0.0523, 0.04], [0.0672, 0.0416, 0.04]])
    model = Enriched(opening, level=0, order=1)
    model.cut([blade(slab.fine, path, np.array([0.0, 0.0, -1.0]), 0.0)])
    found = model.pull()
    assert not found.opening.any()
    node = np.linalg.norm(slab.coarse.nodes - [0.05, 0.05, 0.04], axis=1).argmin()
    assert np.linalg.norm(found.displacement[slab.fine.surface == node]) > 1e-5
    model.cut(opening.cuts)
    model.cut([blade(slab.fine, path, np.array([0.0, 0.0, -1.0]), 0.0)])
    again = model.pull()
    assert np.array_equal(again.displacement, found.displacement) and np.array_equal(again.force, found.force)


def test_the_compliance_answers_as_all_unknowns_at_once(opening):
    model = Enriched(opening, level=0, order=1)
    found = answer(model)
    mesh, coupling = model._mesh, model._coupling.astype(float)
    matrix = LinearElements(mesh, opening.body.tissue(0).materials[0]).stiffness(mesh.nodes)
    full = sparse.csr_array(matrix)
    hooked = [each.patch.nodes_of(mesh) for each in opening.hooks]
    held = np.isin(np.arange(len(mesh.nodes)), np.concatenate([np.flatnonzero(mesh.nodes[:, 2] == 0.0), *hooked]))
    given = np.zeros_like(mesh.nodes)
    for each, nodes in zip(opening.hooks, hooked, strict=True):
        given[nodes] = each.shift_m
    hold(matrix.indptr, matrix.indices, matrix.data, held)
    order = np.argsort(model._nodes.ravel())
    number = np.zeros(len(mesh.nodes), dtype=int)
    number[model._nodes.ravel()[order]] = mesh.tetrahedra.ravel()[order]
    rows = (3 * number[model._around][:, None] + np.arange(3)).ravel()
    border = np.zeros((3 * len(mesh.nodes), coupling.shape[1]))
    border[rows] = coupling
    load = -full @ given.ravel(), -border.T @ given.ravel()
    free = ~np.repeat(held, 3)
    load[0][~free] = 0.0
    among = model.opening_stiffness
    bordered = sparse.block_array(
        [[sparse.csr_array(matrix), sparse.csr_array(border * free[:, None])], [border.T * free, among]]
    )
    solved = spsolve(bordered.tocsc(), np.concatenate(load))
    x = given + solved[: given.size].reshape(-1, 3)
    force = full @ x.ravel() + border @ solved[given.size :]
    on = [
        force.reshape(-1, 3)[nodes].sum(axis=0) @ each.shift_m / np.linalg.norm(each.shift_m)
        for each, nodes in zip(opening.hooks, hooked, strict=True)
    ]
    assert found.force == pytest.approx(on, rel=1e-4)
    jumps = solved[given.size :].reshape(-1, 3)
    seen = opening.parted(model._linear @ x + model._jumps @ jumps)
    assert np.allclose(found.displacement, seen[0], rtol=0.0, atol=1e-5 * np.abs(seen[0]).max())
    assert np.allclose(found.opening, seen[1], rtol=0.0, atol=1e-5 * np.abs(seen[1]).max())


def test_integrals_are_those_of_the_energy():
    """One element, in which the front ends: the energy of a jump by differences of the displacement at many points."""
    corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.1, 0.0], [0.2, 1.1, 0.1], [0.0, 0.2, 0.9]])
    gradients = shape_gradients(TetMesh(corners, np.arange(4)[None]))[0]

    def across(x):
        return np.abs(x[..., 0] + 2.0)

    def within(x):
        return 0.4 - x[..., 2]

    values = np.column_stack([across(corners), within(corners)])
    volume = abs(np.linalg.det(corners[1:] - corners[0])) / 6.0
    moments, products = integrals(
        corners[None], np.zeros(1, dtype=int), values[None], values.T[None] @ gradients, np.array([volume]), np.ones(1),
        corners[:1], gradients, QUADRATURE_POINTS,
    )  # fmt: skip
    rng = np.random.default_rng(1)
    jumps, nodes = rng.normal(size=(4, 3)), rng.normal(size=(4, 3))
    mu, lam, step = 1.7, 0.9, 1e-6

    def shapes(x):
        return np.eye(4)[0] + (x - corners[0]) @ gradients[0].T

    def opened(x):
        r = np.hypot(across(x), within(x))
        return (np.sqrt(0.5 * (r + within(x))) * shapes(x)) @ jumps

    coupling, stiffness = assembled(
        moments, products, np.tile(np.eye(4), (4, 1, 1)), gradients, np.array([[mu], [lam]]), np.arange(4)[None],
        np.arange(4)[None], 4, 4,
    )  # fmt: skip
    energies = np.zeros(2)
    base = nodes.T @ gradients[0]
    for point in QUADRATURE_POINTS @ corners:
        steep = np.column_stack([(opened(point + e) - opened(point - e)) / (2.0 * step) for e in step * np.eye(3)])
        stress = lam * np.trace(steep) * np.eye(3) + mu * (steep + steep.T)
        energies += 0.25 * volume * np.array([(stress * steep).sum(), (stress * base).sum()])
    assert jumps.ravel() @ stiffness @ jumps.ravel() == pytest.approx(energies[0], rel=1e-6)
    assert nodes.ravel() @ coupling @ jumps.ravel() == pytest.approx(energies[1], rel=1e-6)


def test_what_it_cannot_follow_is_refused(opening, monkeypatch):
    with pytest.raises(Refused, match="one cut"):
        Enriched(opening, level=0, order=1).cut([*opening.cuts, *opening.cuts])
    monkeypatch.setattr(enriched, "LARGEST", 100)
    with pytest.raises(Refused, match="the compliance of"):
        Enriched(opening, level=0, order=1)
