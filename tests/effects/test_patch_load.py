"""Loads: the whole force arrives, on every level with the same virtual work."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from palpate.bodies.body import nest
from palpate.bodies.refinement import quadratic_gradients, refine
from palpate.bodies.refinement import ten_nodes as ten_nodes_enclosed_volume
from palpate.bodies.simple_shapes import cylinder
from palpate.bodies.surface_quadrature import enclosed_volume, triangle_shapes
from palpate.effects.elements import shape_gradients
from palpate.effects.patch_load import Patch, nodal_load, patch_at, patch_shares
from palpate.effects.push import disc, placed
from palpate.effects.settings import Load

FORCE = np.array([0.3, -1.2, 0.5])


@pytest.fixture(scope="module")
def body(soft):
    """The cylinder with layers that grow thicker along it, so that nodes differ in area."""
    mesh = cylinder(0.2, 0.03)
    mesh.nodes[:, 2] = 0.2 * (mesh.nodes[:, 2] / 0.2) ** 1.3
    return nest("beam", mesh, 2, np.arange(19), soft)


@pytest.fixture(scope="module")
def contact(body):
    """In the middle of the side."""
    return int(np.argmin(np.linalg.norm(body.coarse.nodes - [0.03, 0.0, 0.1], axis=1)))


@pytest.mark.parametrize("radius", [0.0, 0.02])
def test_levels_do_the_same_work_on_a_coarse_displacement(body, contact, radius):
    displacement = np.random.default_rng(0).normal(size=body.coarse.nodes.shape)
    work = np.vdot(nodal_load(body, 0, contact, FORCE, radius), displacement)
    for level, prolongation in enumerate(body.prolongations, start=1):
        displacement = prolongation @ displacement
        assert np.vdot(nodal_load(body, level, contact, FORCE, radius), displacement) == pytest.approx(work, rel=1e-12)


def test_without_a_radius_the_node_alone_is_loaded(body, contact):
    for order in (1, 2):
        for level in range(2):
            load = nodal_load(body, level, contact, FORCE, 0.0, order)
            assert np.array_equal(np.flatnonzero(load.any(axis=1)), [contact])
            assert np.array_equal(load[contact], FORCE)


def subdivided(mesh, patch, order, depth=7):
    """The same integral by brute force: the middles of 4^depth parts of each triangle."""
    n = 2**depth
    i, j = np.divmod(np.arange(n * n), n)
    low, high = i + j < n, i + j < n - 1
    parts = np.concatenate(
        [np.column_stack([i + 1 / 3, j + 1 / 3])[low], np.column_stack([i + 2 / 3, j + 2 / 3])[high]]
    )
    places = np.column_stack([1 - parts.sum(axis=1) / n, parts / n])
    ten = ten_nodes(mesh) if order == 2 else mesh.triangles
    total = np.zeros(len(mesh.nodes) + len(mesh.edges))
    for corners, numbers in zip(mesh.nodes[mesh.triangles], ten, strict=True):
        area = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        if area @ patch.normal > 1e-12 * np.linalg.norm(area):
            squared = ((places @ corners - patch.center_m) ** 2).sum(axis=1)
            pressure = np.clip(1 - squared / patch.radius_m**2, 0, None) * np.linalg.norm(area)
            total[numbers] += pressure @ triangle_shapes(places, order) / len(places)
    return total / total.sum()


def ten_nodes(mesh):
    """The six nodes of each boundary triangle, found by where they are in the finer mesh."""
    finer = refine(mesh)[0].nodes
    corners = mesh.nodes[mesh.triangles]
    places = [(corners[:, a] + corners[:, b]) / 2 for a, b in ((0, 1), (0, 2), (1, 2))]
    return np.hstack([mesh.triangles, *(cKDTree(finer).query(p)[1][:, None] for p in places)])


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("radius", [0.006, 0.012, 0.03, 0.08])
def test_the_integral_is_exact(body, contact, order, radius):
    """Around a node, and around a point within a facet that is not a node, off the surface and oblique to it."""
    mesh = body.coarse
    around = patch_at(body, contact, radius)
    normal, away = np.array([0.9, 0.3, 0.1]), np.array([-0.002, 0.004, 0.005])
    for patch in (around, Patch(around.center_m + away, normal / np.linalg.norm(normal), radius)):
        expected = subdivided(mesh, patch, order)
        found = np.zeros_like(expected)
        nodes, shares = patch_shares(mesh, patch, order)
        found[nodes] = shares
        assert shares.sum() == pytest.approx(1.0, abs=1e-14)
        assert np.abs(found - expected).max() < 1e-4 * expected.max()


def test_a_disc_on_a_plane_has_the_moments_of_its_pressure(box, soft):
    """∫ (1 − d²/r²) is π r²/2, and of d² times it π r⁴/6; so the mean of d² is r²/3."""
    body = nest("box", box([4, 4, 2], [0.2, 0.2, 0.1], jitter=0.2), 1, np.arange(3), soft)
    above = np.array([0.093, 0.108, 0.1])
    for radius in (0.01, 0.06):
        nodes, shares = patch_shares(body.coarse, Patch(above, np.array([0.0, 0.0, 1.0]), radius), 2)
        away = refine(body.coarse)[0].nodes[nodes] - above
        assert shares @ away == pytest.approx(0.0, abs=1e-15)
        assert shares @ (away**2).sum(axis=1) == pytest.approx(radius**2 / 3, rel=1e-12)


def test_the_back_of_a_thin_body_is_not_pressed(box, soft):
    body = nest("plate", box([8, 8, 1], [0.2, 0.2, 0.01]), 0, np.arange(3), soft)
    nodes, _ = patch_shares(body.coarse, Patch(np.array([0.1, 0.1, 0.01]), np.array([0.0, 0.0, 1.0]), 0.05))
    assert np.array_equal(body.coarse.nodes[nodes, 2], np.full(len(nodes), 0.01))
    # the side of a box does not face the one who presses the top, whatever rounding says
    nodes, _ = patch_shares(body.coarse, Patch(np.array([0.0, 0.1, 0.01]), np.array([1e-9, 0.0, 1.0]), 0.05))
    assert body.coarse.nodes[nodes, 2].min() == 0.01


def test_a_patch_far_from_the_body_loads_the_nearest_point(body):
    nodes, shares = patch_shares(body.coarse, Patch(np.array([1.0, 0.0, 0.1]), np.array([1.0, 0.0, 0.0]), 0.01))
    assert shares @ body.coarse.nodes[nodes] == pytest.approx([0.03, 0.0, 0.1])


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("radius", [0.0, 1e-5, 0.006])
@pytest.mark.parametrize("at", [[0.031, 0.017, 0.1], [0.075, 0.05, 0.1], [0.1, 0.06, 0.028], [0.05, 0.05, 0.1]])
def test_a_push_between_nodes_acts_where_it_is(box, order, radius, at):
    """In a facet, on an edge, on a side, at a node of facets 50 mm wide: the force's moment about its place is 0."""
    mesh = box([2, 2, 2], [0.1, 0.1, 0.1])
    off = [0.0, 0.0, 1e-3] if at[2] == 0.1 else [1e-3, 0.0, 0.0]
    for given in (at, np.add(at, off).tolist()):
        (load,) = placed(mesh, np.arange(0), "box", [Load(at_m=given, force_n=[0, 0, 1], radius_m=radius)])
        assert load.at_m == pytest.approx(at, abs=1e-15)
        assert load.normal == pytest.approx(np.array(off) / 1e-3, abs=1e-15)
        nodes, shares = patch_shares(mesh, disc(load), order)
        places = mesh.nodes if order == 1 else refine(mesh)[0].nodes
        assert shares.sum() == pytest.approx(1.0, abs=1e-14)
        assert shares @ places[nodes] == pytest.approx(at, abs=1e-14)
        if radius == 0.0 and at == [0.05, 0.05, 0.1]:
            assert shares.tolist() == [1.0] and load.at_m == mesh.nodes[nodes[0]].tolist()


@pytest.fixture(scope="module")
def mesh(box):
    return box([2, 1, 2], [0.2, 0.1, 0.3], jitter=0.2)


def inside(mesh, x):
    """Integrate det F over the quadratic elements, by a rule of degree 3 (Keast 1986)."""
    points = np.vstack([np.full(4, 0.25), np.full((4, 4), 1 / 6) + np.eye(4) / 3])
    gradients, volumes = shape_gradients(mesh)
    places, found = x[ten_nodes_enclosed_volume(mesh)], 0.0
    for weight, slopes in zip([-0.8, *[0.45] * 4], quadratic_gradients(points), strict=True):
        f = np.einsum("eai,ac,ecj->eij", places, slopes, gradients)
        found += weight * np.linalg.det(f) @ volumes
    return found


def test_quadratic_faces_enclose_what_their_elements_fill(mesh):
    finer, _ = refine(mesh)
    x = finer.nodes + 0.02 * np.random.default_rng(1).standard_normal(finer.nodes.shape)
    assert enclosed_volume(mesh, x) == pytest.approx(inside(mesh, x), rel=1e-12)
    assert abs(enclosed_volume(mesh, x) / enclosed_volume(finer, x) - 1.0) > 1e-3  # its flat facets enclose another


def test_at_rest_and_under_one_gradient_it_is_known(mesh):
    f = np.array([[1.1, 0.2, 0.0], [0.0, 0.9, -0.1], [0.1, 0.0, 1.3]])
    finer, _ = refine(mesh)
    for nodes in (mesh.nodes, finer.nodes):
        assert enclosed_volume(mesh, nodes) == pytest.approx(0.006, rel=1e-12)
        moved = nodes @ f.T + [3.0, -2.0, 1.0]
        assert enclosed_volume(mesh, moved) == pytest.approx(0.006 * np.linalg.det(f), rel=1e-11)
