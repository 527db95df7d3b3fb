import numpy as np
import pytest

from palpate.bodies.body import nest
from palpate.bodies.box import sheet
from palpate.bodies.mesh import TetMesh
from palpate.bodies.supports import choose_anchors, default_anchors
from palpate.errors import InputError


def test_three_rules_find_the_same_face(cube):
    plane = choose_anchors("cube", {"plane": {"axis": "z", "side": "min", "depth_m": 0.01}}, cube)
    numbers = choose_anchors("cube", {"nodes": [3, 0, 1, 2]}, cube)
    sphere = choose_anchors("cube", {"sphere": {"center_m": [0.5, 0.5, 0], "radius_m": 0.8}}, cube)
    assert plane.tolist() == numbers.tolist() == sphere.tolist() == [0, 1, 2, 3]


def test_plane_on_the_far_side(cube):
    held = choose_anchors("cube", {"plane": {"axis": "x", "side": "max", "depth_m": 0.01}}, cube)
    assert held.tolist() == [1, 3, 5, 7]


def test_several_rules_hold_what_any_of_them_holds(cube):
    ends = [{"plane": {"axis": "x", "side": side, "depth_m": 0.01}} for side in ("min", "max")]
    assert choose_anchors("cube", {"several": [ends[1], {"nodes": [0]}]}, cube).tolist() == [0, 1, 3, 5, 7]
    with pytest.raises(InputError, match="several holds every node of the surface"):
        choose_anchors("cube", {"several": ends}, cube)


def test_new_nodes_are_held_between_held_ones(cube, material):
    body = nest("cube", cube, 1, np.arange(4), material)
    assert np.array_equal(body.anchors[1], np.flatnonzero(body.fine.nodes[:, 2] == 0))


@pytest.mark.parametrize(
    ("rule", "message"),
    [
        (
            {"nodes": [1, 8]},
            r"anchors\.nodes names 8, which does not exist; its coarse nodes are counted from 0, and go up to 7",
        ),
        (
            {"nodes": list(range(8))},
            r"nodes holds every node of the surface, .* hold fewer: the body is 1 × 1",
        ),
        ({"nodes": [-1, 2, 3]}, "names -1"),
        ({"nodes": [1.5, 2, 3]}, r"names 1\.5"),
        ({"nodes": []}, r"anchors\.nodes holds no node"),
        ({"sphere": {"center_m": [9, 9, 9], "radius_m": 1}}, r"anchors\.sphere holds no node"),
        ({"nodes": [0, 1]}, "turn about the held nodes; hold three"),
        ({"nodes": [0], "plane": {}}, "exactly one of nodes, plane, sphere and several"),
        ({"several": [{"nodes": [0]}, {"nodes": [9]}]}, "names 9"),
        ({"several": []}, r"anchors\.several holds no node"),
        ({"several": [{"nodes": [0, 1, 2]}, {"box": {}}]}, "exactly one of nodes, plane, sphere and several"),
        ({"box": {}}, "exactly one of nodes, plane, sphere and several"),
    ],
)
def test_a_rule_that_cannot_hold_the_body(cube, rule, message):
    with pytest.raises(InputError, match=f"^body cube: .*{message}"):
        choose_anchors("cube", rule, cube)


def test_three_nodes_on_a_line_do_not_hold():
    nodes = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
    mesh = TetMesh(nodes, np.array([[0, 1, 3, 4], [1, 2, 3, 4]]))
    with pytest.raises(InputError, match="not on a line"):
        choose_anchors("bar", {"nodes": [0, 1, 2]}, mesh)


def test_a_sheet_may_hang_by_a_line():
    held = choose_anchors(
        "cloth", {"plane": {"axis": "x", "side": "min", "depth_m": 0.0}}, sheet([0.2, 0.1], [4, 2], 0.001)
    )
    assert held.tolist() == [0, 1, 2]


def test_every_piece_must_be_held(cube):
    two = TetMesh(
        np.vstack([cube.nodes, cube.nodes + np.array([3, 0, 0])]),
        np.vstack([cube.tetrahedra, cube.tetrahedra + 8]),
    )
    with pytest.raises(InputError, match="no node of the piece of node 8, one of 2;"):
        choose_anchors("two", {"nodes": [0, 1, 2, 3]}, two)
    assert len(choose_anchors("two", {"plane": {"axis": "z", "side": "min", "depth_m": 0}}, two)) == 8


def test_without_a_rule_the_low_end_of_the_longest_side_is_held(cube):
    long = TetMesh(cube.nodes * [1, 1, 3], cube.tetrahedra)
    with pytest.warns(UserWarning, match=r"^anchors is not given; the nodes within 0\.3 m of its lowest z, "):
        rule = default_anchors("cube", long)
    assert choose_anchors("cube", rule, long).tolist() == [0, 1, 2, 3]
