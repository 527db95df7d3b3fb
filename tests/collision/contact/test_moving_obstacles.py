"""Moving obstacles displace the nodes in their path."""

import numpy as np
import pytest

from palpate.collision.contact.additive_ccd import limit
from palpate.collision.contact.obstacles import displace_nodes
from palpate.collision.contact.proximity import Proximity
from palpate.errors import NotConverged

GAP = 1e-3


@pytest.fixture
def scene(cube):
    """Make proximity and points of a cube under a rod; the rod's two points are last."""
    body = cube(2)
    rod = np.array([[-0.05, 0.05, 0.112], [0.15, 0.05, 0.112]])
    points = np.vstack([body.nodes, rod])
    n = len(body.nodes)
    surfaces = [body.triangles, np.array([[n, n + 1, n + 1]])]
    can_touch = np.array([[False, True], [True, False]])
    return Proximity(points, surfaces, np.array([0.0, 0.01]), can_touch, np.ones(n + 2), GAP), points, n


def moved(scene, way):
    proximity, points, n = scene
    motion = np.zeros_like(points)
    motion[n:] = way
    return displace_nodes(proximity, points, motion, n, ["cube", "rod"]), motion


def test_nodes_beside_the_path_stay(scene):
    for way in ([0.0, 0.0, 1.0], [0.0, 0.02, 0.0], [0.0, 0.0, -0.0017]):
        assert np.array_equal(moved(scene, way)[0], scene[1][: scene[2]])


@pytest.mark.parametrize("depth", [0.003, 0.03, 0.3, 3.0])
def test_nodes_in_the_path_make_the_whole_motion_and_nothing_intersects(scene, depth):
    proximity, points, n = scene
    reached, motion = moved(scene, [0.0, 0.0, -depth])
    gone = reached - points[:n]
    taken = gone.any(axis=1)
    assert taken.any()
    assert gone[taken] == pytest.approx(np.tile([0.0, 0.0, -depth], (taken.sum(), 1)), abs=1e-15)
    near = proximity.find_near(points, depth)
    motion[:n] = gone
    assert limit(near.kinds, near.nodes, near.offsets, near.known, points, motion, 0.0) == 1.0
    assert (near.clearances(np.vstack([reached, points[n:] - [0.0, 0.0, depth]])) > 0.0).all()


def test_held_nodes_stop_it_with_one_sentence(scene):
    proximity, _, n = scene
    proximity.movable[:n] = False
    proximity.movable[n:] = True
    with pytest.raises(
        NotConverged, match=r"^rod is driven into held nodes, or between two instruments; change its path$"
    ):
        moved(scene, [0.0, 0.0, -0.03])
