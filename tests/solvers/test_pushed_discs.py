"""Discs that are pushed so far: minima of the energy where the discs are, on either side of a limit point."""

import numpy as np
import pytest
from scipy import sparse

from palpate.bodies.make_body import make_body
from palpate.effects.patch_load import patch_at, patch_shares
from palpate.errors import InputError, NotConverged
from palpate.solvers import pushed_discs
from palpate.solvers.equilibrium import Equilibrium
from palpate.solvers.pushed_discs import Pushed, push

RADIUS_M, SNAPS = 0.012, 7
LIVER = {"kind": "liver", "length_m": 0.2, "refinements": 1, "young_pa": 3000.0, "poisson": 0.3}
LIVER |= {"density_kg_m3": 1000.0, "anchors": {"sphere": {"center_m": [-0.03, 0.05, 0.03], "radius_m": 0.04}}}


@pytest.fixture(scope="module")
def liver():
    """The coarse liver of quadratic elements, the weights of a disc where it snaps under a force, and the way in."""
    body = make_body("liver", LIVER)
    problem = Equilibrium(body, 0, 2)
    nodes, shares = patch_shares(body.coarse, patch_at(body, SNAPS, RADIUS_M), 2)
    weights = sparse.csr_array((shares, (np.zeros(len(nodes), int), nodes)), (1, len(problem.mesh.nodes)))
    return problem, weights, -body.fine.normals[SNAPS]


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
    minimise, begun = pushed_discs.minimise, []

    def stubborn(pushed, x, scale, tolerance, *rest, **named):
        depth = float(np.linalg.norm(weights @ (x - problem.mesh.nodes)))
        if depth > 0.006 + (begun[-1] if begun else 0.0):
            raise NotConverged("too far", [1.0])
        begun.append(depth)
        return minimise(pushed, x, scale, tolerance, *rest, **named)

    monkeypatch.setattr(pushed_discs, "minimise", stubborn)
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
