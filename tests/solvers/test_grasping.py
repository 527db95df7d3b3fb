"""What is grasped and moved is felt as theory, the energy and the supports say."""

import numpy as np
import pytest
from skfem import Basis, ElementTetP2, ElementVector, MeshTet, condense, solve
from skfem.models.elasticity import lame_parameters, linear_elasticity

from palpate.bodies.body import nest
from palpate.bodies.material import Material
from palpate.bodies.refinement import with_midpoints
from palpate.bodies.simple_shapes import box
from palpate.errors import InputError, NotConverged
from palpate.solvers.grasping import Grasping, patch_around

YOUNG, SIZES = 3000.0, np.array([0.1, 0.04, 0.04])
OBLIQUE = np.array([3.0, 1.0, -2.0]) / np.sqrt(14.0)


def bar(poisson=0.3):
    mesh = box(SIZES.tolist(), [5, 2, 2])
    held = np.flatnonzero(mesh.nodes[:, 0] == 0.0)
    return with_midpoints(nest("bar", mesh, 0, held, Material(YOUNG, poisson, 1000.0)), 0)


def end_of(body, radius_m=0.03):
    """The patch around the middle of the free end."""
    mesh = body.levels[0]
    node = np.linalg.norm(mesh.nodes - SIZES * [1.0, 0.5, 0.5], axis=1).argmin()
    return patch_around(mesh, int(node), radius_m)


def grasped(body, radius_m=0.03):
    return Grasping(body, 0, 2, end_of(body, radius_m))


def test_a_bar_that_does_not_contract_is_as_stiff_as_hooke_says():
    """Of linear strains and ν = 0: E A δ / L, and the section keeps its shape."""
    body, area = bar(0.0), SIZES[1] * SIZES[2]
    assert end_of(body).area_m2 == pytest.approx(area, rel=1e-12)
    (state,) = grasped(body).push(np.array([1.0, 0.0, 0.0]), [0.02], 1e-9)
    assert state.force[0] == pytest.approx(YOUNG * area * 0.02 / SIZES[0], rel=1e-7)
    assert np.allclose(state.x, body.fine.nodes * [1.2, 1.0, 1.0], atol=1e-8)


def test_linear_responses_are_those_of_scikit_fem():
    """Quadratic elements of a bar with Lamé's law, of which a part of the end is moved."""
    body, problem = bar(), grasped(bar(), 0.025)
    basis = Basis(MeshTet(body.levels[0].nodes.T, body.levels[0].tetrahedra.T), ElementVector(ElementTetP2()))
    stiffness = linear_elasticity(*lame_parameters(YOUNG, 0.3)).assemble(basis)
    at, component = basis.doflocs.T, np.empty(basis.N, dtype=int)
    for i, dofs in enumerate((*basis.nodal_dofs, *basis.edge_dofs)):
        component[dofs] = i % 3
    nearest = np.linalg.norm(at[:, None] - problem.mesh.nodes, axis=2).argmin(axis=1)
    all_held = np.union1d(problem.grasped, body.anchors[1])
    shift = np.where(np.isin(nearest, problem.grasped), OBLIQUE[component], 0.0)
    moved = solve(*condense(stiffness, np.zeros(basis.N), x=shift, D=np.flatnonzero(np.isin(nearest, all_held))))
    response = problem.response(OBLIQUE)
    assert np.allclose(response[nearest, component], moved, atol=2e-5)
    force = (stiffness @ moved)[np.isin(nearest, problem.grasped)]
    felt = problem.reaction(problem.mesh.nodes + 1e-6 * response) / 1e-6
    assert felt @ OBLIQUE == pytest.approx(force @ OBLIQUE[component[np.isin(nearest, problem.grasped)]], rel=1e-4)


def test_the_force_is_the_slope_of_the_energy_and_what_the_supports_feel():
    body, way, depth, change = bar(), OBLIQUE, 0.01, 1e-5
    problem = grasped(body)
    before, state, after = problem.push(way, [depth - change, depth, depth + change], 1e-9)
    slope = (problem.energy(after.x) - problem.energy(before.x)) / (2.0 * change)
    assert state.force @ way == pytest.approx(slope, rel=1e-5)
    supports = problem.free_force(state.x)[body.anchors[1]].sum(axis=0)
    assert np.allclose(supports, state.force, atol=1e-7 * np.linalg.norm(state.force))
    moved = state.x - body.fine.nodes
    assert np.allclose(moved[problem.grasped], depth * way, atol=1e-15) and not moved[body.anchors[1]].any()


def test_it_goes_back_as_it_came():
    problem = grasped(bar())
    there, _, back, rest = problem.push(OBLIQUE, [0.01, 0.02, 0.01, 0.0], 1e-9)
    assert np.allclose(back.x, there.x, atol=1e-8) and np.allclose(rest.force, 0.0, atol=1e-6 * there.force.max())


def test_small_motions_have_the_linear_response():
    problem = grasped(bar())
    (state,) = problem.push(OBLIQUE, [1e-6], 1e-6)
    assert np.allclose(state.x - problem.mesh.nodes, 1e-6 * problem.response(OBLIQUE), atol=1e-10)


def test_finer_meshes_hold_the_same_patch():
    coarse = nest("bar", box(SIZES.tolist(), [5, 2, 2]), 2, np.array([0]), Material(YOUNG, 0.3, 1000.0))
    patch, mesh = end_of(coarse, 0.025), coarse.fine
    nodes = patch.nodes_of(mesh)
    inside = mesh.triangles[np.isin(mesh.triangles, nodes).all(axis=1)]
    assert len(nodes) > len(patch.nodes_of(coarse.coarse)) > 3
    sides = mesh.nodes[inside[:, 1:]] - mesh.nodes[inside[:, :1]]
    assert 0.5 * np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum() == pytest.approx(patch.area_m2)


def test_what_cannot_be_grasped_is_refused():
    body = bar()
    mesh = body.levels[0]
    with pytest.raises(NotConverged, match="is held"):
        Grasping(body, 0, 2, patch_around(mesh, int(body.anchors[0][0]), 0.01))
    away = patch_around(mesh, int(mesh.surface[-1]), 0.01)
    with pytest.raises(NotConverged, match="no node"):
        Grasping(body, 0, 2, type(away)(away.corners + 0.003))
    with pytest.raises(InputError, match="depth"):
        next(grasped(body).push(OBLIQUE, [0.2], 1e-6))
