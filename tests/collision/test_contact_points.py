"""Contacts carry place, direction, depth and relative velocity, from triangles and from volumes."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from palpate.collision.contact_points import stopped_contacts, triangle_contacts
from palpate.collision.trees.tree import Tree
from palpate.collision.trees.tree_query import StoppedTree, crossing_pairs

FLOOR = np.array([[-3.0, -3.0, 0.0], [5.0, -3.0, 0.0], [-3.0, 5.0, 0.0]])
ONE = np.array([[0, 1, 2]])


def rigid(points, spin, drift):
    """Return the velocities of points of a body that turns and moves."""
    return np.cross(spin, points) + drift


def ball(seed, centre):
    """Make points and triangles that face outward."""
    points = np.random.default_rng(seed).normal(size=(120, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    cells = ConvexHull(points).simplices.astype(np.int64)
    inward = np.linalg.det(points[cells]) < 0.0
    return points + centre, np.where(inward[:, None], cells[:, ::-1], cells)


@pytest.fixture(scope="module")
def meeting():
    """Two balls of radius 1 that overlap by 0.4 along x, each with a motion of its own."""
    (a, one), (b, other) = ball(1, [0.0, 0.0, 0.0]), ball(2, [1.6, 0.0, 0.0])
    motions = [([0.3, -0.2, 0.5], [1.0, 0.0, 0.2]), ([-0.1, 0.4, 0.2], [-0.5, 0.3, 0.0])]
    return (a, b), (one, other), motions, [rigid(at, *motion) for at, motion in zip((a, b), motions, strict=True)]


def test_a_corner_through_a_floor_in_closed_form():
    # its lowest corner 0.1 below, the cut between two edges at z = 0
    corner = np.array([[0.0, 0.0, -0.1], [0.4, 0.0, 0.3], [0.0, 0.0, 0.3]])
    down = np.tile([0.0, 0.0, -2.0], (3, 1))
    found = triangle_contacts(Tree(corner, ONE), Tree(FLOOR, ONE), down, np.zeros((3, 3)))
    assert found.pairs.tolist() == [[0, 0]] and found.tests.triangle_tests == 1
    assert found.places[0] == pytest.approx([0.05, 0.0, 0.0], abs=1e-15)
    assert found.directions[0] == pytest.approx([0.0, 0.0, 1.0], abs=1e-15)
    assert found.depths == pytest.approx([0.1], rel=1e-12)
    # it approaches, against the direction
    assert found.velocities[0] == pytest.approx([0.0, 0.0, -2.0], abs=1e-15)


def test_velocities_of_triangles_are_those_of_both_bodies_at_the_place(meeting):
    points, triangles, motions, velocities = meeting
    trees = [Tree(at, cells) for at, cells in zip(points, triangles, strict=True)]
    found = triangle_contacts(*trees, *velocities)
    assert np.array_equal(found.pairs, crossing_pairs(*trees)[0]) and len(found.pairs) > 10
    expected = rigid(found.places, *motions[0]) - rigid(found.places, *motions[1])
    # linear interpolation is exact for rigid motions
    assert found.velocities == pytest.approx(expected, abs=1e-12)
    # they meet in the plane half way
    assert found.places[:, 0] == pytest.approx(0.8, abs=0.1)


def test_outward_triangles_lead_out_of_the_body(meeting):
    points, faces, _, velocities = meeting
    trees = [Tree(at, cells) for at, cells in zip(points, faces, strict=True)]
    found = triangle_contacts(*trees, *velocities)
    pushed = found.depths @ found.directions
    # a is to the left of b, and both are coarse
    assert pushed[0] / np.linalg.norm(pushed) < -0.9
    assert (found.directions[:, 0] < 0.0).all() and (found.depths > 0.0).all()
    back = triangle_contacts(*trees[::-1], *velocities[::-1])
    assert back.depths.sum() == pytest.approx(found.depths.sum(), rel=1e-12)
    assert back.depths @ back.directions == pytest.approx(-pushed, rel=1e-9)
    # moved out by the depth, each corner of one is on the other's plane
    one, other = points[0][faces[0][found.pairs[:, 0]]], points[1][faces[1][found.pairs[:, 1]]]
    moved = one + (found.depths[:, None] * found.directions)[:, None]
    heights = []
    for a, b in ((moved, other), (other, moved)):
        normals = np.cross(b[:, 1] - b[:, 0], b[:, 2] - b[:, 0])
        heights.append(
            np.einsum("ki,kci->kc", normals / np.linalg.norm(normals, axis=1)[:, None], a - b[:, :1]).min(axis=1)
        )
    assert np.max(heights, axis=0) == pytest.approx(np.zeros(len(one)), abs=1e-12)


@pytest.mark.parametrize("structure", ["sphere", "aabb", "composite"])
def test_volumes_come_nearer_to_the_truth_layer_by_layer(meeting, structure):
    points, triangles, motions, velocities = meeting
    errors = []
    for layer in (0, 3, 5, 20):
        trees = [StoppedTree(at, cells, layer, structure) for at, cells in zip(points, triangles, strict=True)]
        found = stopped_contacts(*trees, *velocities)
        place = found.depths @ found.places / found.depths.sum()
        moving = found.depths @ found.velocities / found.depths.sum()
        expected = rigid(place, *motions[0]) - rigid(place, *motions[1])
        assert found.tests.triangle_tests == 0
        errors.append((np.linalg.norm(place - [0.8, 0.0, 0.0]), np.linalg.norm(moving - expected)))
    # at the root the mean velocity is that of the centre, a ball's radius away from the place
    assert errors[0][1] > 0.2
    assert errors[-1][0] < 0.1 and errors[-1][1] < 0.1


def test_a_mean_is_over_the_leafs_own_triangles():
    points, triangles = ball(4, [0.0, 0.0, 0.0])
    velocity = np.random.default_rng(5).normal(size=points.shape)
    tree = StoppedTree(points, triangles, 2, "aabb")
    found = stopped_contacts(tree, StoppedTree(points, triangles, 0, "aabb"), velocity, np.zeros_like(points))
    leaves = tree.leaf_of()
    for leaf, moving in zip(found.pairs[:, 0], found.velocities, strict=True):
        assert moving == pytest.approx(velocity[triangles[leaves == leaf]].mean(axis=(0, 1)), rel=1e-12)


def test_degenerate_triangles_have_velocities():
    # a segment and a point in the floor, whose velocities are linear along them
    points = np.array([[0.0, 0, -1], [0, 0, 1], [0, 0, 1], [1.0, 1, 0]])
    cells = np.array([[0, 1, 2], [3, 3, 3]])
    velocity = np.array([[1.0, 0, 0], [3.0, 0, 0], [3.0, 0, 0], [7.0, 0, 0]])
    found = triangle_contacts(Tree(points, cells), Tree(FLOOR, ONE), velocity, np.zeros((3, 3)))
    assert found.velocities.tolist() == [[2.0, 0.0, 0.0], [7.0, 0.0, 0.0]]


def test_without_contact_there_are_no_rows(meeting):
    points, triangles, _, velocities = meeting
    far = points[1] + [5.0, 0.0, 0.0]
    for make, find in ((Tree, triangle_contacts), (lambda *ball: StoppedTree(*ball, 9), stopped_contacts)):
        found = find(make(points[0], triangles[0]), make(far, triangles[1]), *velocities)
        assert found.pairs.shape == (0, 2) and found.places.shape == (0, 3) and found.depths.shape == (0,)
