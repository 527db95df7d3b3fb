"""Linear responses to unit forces: reciprocal, right, and the same when read again."""

import numpy as np
import pytest
from fixtures.bodies import LIVER
from fixtures.direct import direct
from scipy import sparse

from palpate.bodies.contacts import kept_contacts
from palpate.bodies.make_body import make_body
from palpate.bodies.refinement import finer
from palpate.effects.linear_elements import LinearElements
from palpate.effects.patch_load import nodal_load, patch_at, patch_shares
from palpate.effects.quadratic_elements import QuadraticElements
from palpate.errors import InputError, NotConverged
from palpate.solvers import pushed_discs
from palpate.solvers.compliance import compute_compliance
from palpate.solvers.equilibrium import Equilibrium
from palpate.solvers.pushed_discs import Pushed, push


def pressed(body, level, contact, axis, radius_m):
    """The linear response to a unit force, by scipy's direct solver."""
    mesh, load = body.levels[level], nodal_load(body, level, int(contact), np.eye(3)[axis], radius_m)
    return direct(LinearElements(mesh, body.material).stiffness(mesh.nodes), body.anchors[level], load)


def test_every_free_surface_node_has_its_row(slab, slab_compliance):
    free = [n for n in slab.coarse.surface if n not in slab.anchors[0]]
    assert slab_compliance.contacts.tolist() == free
    assert [slab_compliance.row(n) for n in free] == list(range(len(free)))
    inner = np.setdiff1d(np.arange(len(slab.coarse.nodes)), slab.coarse.surface)
    for node in (slab.anchors[0][0], inner[0], len(slab.coarse.nodes), -1):
        with pytest.raises(InputError, match=f"contact {node} is not a free surface node"):
            slab_compliance.row(node)


def test_reciprocity(slab_compliance):
    """Betti: node i moves along a under a force at j along b as j moves along b under one at i along a."""
    contacts = slab_compliance.contacts
    for responses in (slab_compliance.restricted, slab_compliance.coarse):
        matrix = responses[:, :, contacts].reshape(3 * len(contacts), -1)
        assert np.abs(matrix - matrix.T).max() < 1e-8 * np.abs(matrix).max()
        assert np.linalg.eigvalsh(matrix)[0] > 0.0


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_responses_are_those_of_both_meshes(slab, slab_compliance, axis):
    fine, coarse = (pressed(slab, level, slab_compliance.contacts[17], axis, 0.0) for level in (1, 0))
    expected = {"fine": fine[slab.fine.surface], "restricted": fine[: len(slab.coarse.nodes)], "coarse": coarse}
    for name, response in expected.items():
        found, whole = getattr(slab_compliance, name)[17, axis], coarse if name == "coarse" else fine
        assert np.abs(found - response).max() < 1e-8 * np.abs(whole).max()


def test_a_disc_is_softer_pressed_than_a_point(slab, slab_compliance):
    spread = compute_compliance(slab, 0.04, progress=lambda contacts: contacts[:1])
    contact = slab_compliance.contacts[0]
    for axis in range(3):
        assert 0 < spread.restricted[0, axis, contact, axis] < slab_compliance.restricted[0, axis, contact, axis]
    expected = pressed(slab, 1, contact, 2, 0.04)[slab.fine.surface]
    assert np.abs(spread.fine[0, 2] - expected).max() < 1e-8 * np.abs(expected).max()


def test_means_of_discs_are_symmetric(slab):
    """By Maxwell and Betti, a disc moves under a force at another as that one would under a force here."""
    means = compute_compliance(slab, 0.03, contacts=3, order=2).means
    assert means.shape == (3, 3, 3, 3)
    assert np.abs(means - means.transpose(1, 0, 3, 2)).max() < 1e-6 * np.abs(means).max()
    assert np.linalg.eigvalsh(means.transpose(0, 3, 1, 2).reshape(9, 9)).min() > 0.0


def test_a_count_leaves_out_rows_and_changes_none(slab, slab_compliance):
    few = compute_compliance(slab, 0.0, contacts=5)
    assert len(few.contacts) == 5
    rows = [slab_compliance.row(contact) for contact in few.contacts]
    for name in ("fine", "restricted", "coarse"):
        of_all = getattr(slab_compliance, name)[rows]
        assert np.abs(getattr(few, name) - of_all).max() < 1e-7 * np.abs(of_all).max()  # beside others, solved at once
    same = compute_compliance(slab, 0.0, contacts=few.contacts)
    assert np.array_equal(same.contacts, few.contacts) and np.array_equal(same.fine, few.fine)
    missing = np.setdiff1d(slab_compliance.contacts, few.contacts)[0]
    with pytest.raises(
        InputError, match=rf"^contact {missing} is not .* one of the contacts that are prepared; choose"
    ):
        few.row(missing)


def test_quadratic_compliance_is_that_of_ten_node_elements(slab):
    """At the nodes of the fine level; the coarse mesh's own response stays that of linear elements."""
    chosen, radius = kept_contacts(slab, 2), 0.03
    quadratic, linear = (compute_compliance(slab, radius, contacts=chosen, order=order) for order in (2, 1))
    assert np.array_equal(quadratic.coarse, linear.coarse)
    body, n_coarse = finer(slab), len(slab.coarse.nodes)
    matrix = QuadraticElements(slab.fine, slab.material).stiffness(body.fine.nodes)
    for axis in (0, 2):
        load = nodal_load(body, 1, int(chosen[1]), np.eye(3)[axis], radius, 2)
        expected = direct(matrix, body.anchors[-1], load)
        assert np.abs(quadratic.fine[1, axis] - expected[slab.fine.surface]).max() < 1e-8 * np.abs(expected).max()
        assert np.abs(quadratic.restricted[1, axis] - expected[:n_coarse]).max() < 1e-8 * np.abs(expected).max()


RADIUS_M, SNAPS = 0.012, 7


@pytest.fixture(scope="module")
def liver():
    """The coarse liver of quadratic elements, the weights of a disc where it snaps under a force, and the way in."""
    body = make_body("liver", LIVER.but(refinements=1))
    problem = Equilibrium(body, 0, 2)
    nodes, shares = patch_shares(body.coarse, patch_at(body, SNAPS, RADIUS_M), 2)
    weights = sparse.csr_array((shares, (np.zeros(len(nodes), int), nodes)), (1, len(problem.mesh.nodes)))
    return problem, weights, -body.fine.normals[SNAPS]


@pytest.mark.slow
def test_a_disc_goes_on_where_a_force_would_make_the_body_snap(liver):
    """The force rises, falls and rises again with the depth; forces from rest reach the first branch only."""
    problem, weights, inward = liver
    forces, nothing = [], np.zeros_like(problem.mesh.nodes)
    for depth in (0.01, 0.02, 0.025, 0.03):
        solution, found = push(problem, nothing, weights, depth * inward[None], 1e-8)
        assert np.abs(weights @ (solution.x - problem.mesh.nodes) - depth * inward).max() < 1e-12
        nodal = weights.T @ found
        problem.carry(nodal)
        assert np.linalg.norm(problem.force(solution.x)) < 1e-7 * np.linalg.norm(nodal)
        other = problem.solve(nodal, 1e-8).x
        same = np.abs(solution.x - other).max() < 1e-5 * np.abs(solution.x - problem.mesh.nodes).max()
        assert same == (depth < 0.0225)
        forces.append(float(found[0] @ inward))
    assert forces[0] < forces[1] < forces[2] > forces[3]


def test_the_way_is_gone_in_parts_where_it_cannot_be_gone_at_once(liver, monkeypatch):
    problem, weights, inward = liver
    nothing = np.zeros_like(problem.mesh.nodes)
    whole, force = push(problem, nothing, weights, 0.015 * inward[None], 1e-8)
    minimise, begun = pushed_discs.minimise_by_newton, []

    def stubborn(pushed, x, scale, tolerance, *rest, **named):
        depth = float(np.linalg.norm(weights @ (x - problem.mesh.nodes)))
        if depth > 0.006 + (begun[-1] if begun else 0.0):
            raise NotConverged("too far", [1.0])
        begun.append(depth)
        return minimise(pushed, x, scale, tolerance, *rest, **named)

    monkeypatch.setattr(pushed_discs, "minimise_by_newton", stubborn)
    parts, again = push(problem, nothing, weights, 0.015 * inward[None], 1e-8)
    assert len(set(np.round(begun, 6))) == 4 and np.abs(parts.x - whole.x).max() < 1e-7
    assert np.allclose(again, force, rtol=1e-5)
    begun.clear()
    with pytest.raises(NotConverged, match=r"too far, at 2% of the way in steps of 1\.6%"):
        push(problem, nothing, weights, 1.0 * inward[None], 1e-8)


def test_products_and_steps_stay_on_the_subspace(liver):
    problem, weights, inward = liver
    pushed, field = Pushed(problem, weights), np.random.default_rng(0).normal(size=problem.mesh.nodes.shape)
    x = pushed.begin(problem.mesh.nodes, 0.005 * inward[None])
    assert np.abs(pushed.means(x - problem.mesh.nodes) - 0.005 * inward).max() < 1e-15
    multiply, precondition = pushed.linearise(x)
    assert np.abs(weights @ precondition(field)).max() < 1e-10 * np.abs(weights @ problem.linearise(x)[1](field)).max()
    for part in (pushed.force(x), multiply(field)):
        assert np.abs(weights @ part).max() < 1e-12 * np.abs(part).max()


def test_two_discs_at_one_place_and_one_that_nothing_carries_are_refused(liver):
    problem, weights, _ = liver
    with pytest.raises(InputError, match="same place"):
        Pushed(problem, sparse.vstack([weights, weights]).tocsr())
    with pytest.raises(InputError, match="nothing gives"):
        Pushed(problem, sparse.csr_array(weights.shape))
