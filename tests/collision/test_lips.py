"""Trees over the lips of a cut find all that touch, and lips that touch again collide."""


import numpy as np
import pytest
from fixtures.cut_cases import LIVER

from palpate.bodies.body import nest
from palpate.bodies.cutting.conform import cut_body
from palpate.bodies.cutting.cut import Disc, blade, unit
from palpate.bodies.make_body import make_body
from palpate.bodies.material import Material
from palpate.bodies.simple_shapes import box
from palpate.collision.trees.tree import Tree
from palpate.collision.trees.tree_query import crossing_pairs
from palpate.collision.triangles.brute_force import crossing

TISSUE = Material(5000.0, 0.3, 1000.0)
SIZES = [0.1, 0.1, 0.04]
DEEP_M, OPEN_M = 0.02, 0.004


@pytest.fixture(scope="module", params=["slab", "liver"])
def cut(request):
    """A body that a blade has cut: its mesh, the whole one, and how its nodes open the lips, (n, 3) [m]."""
    if request.param == "slab":
        mesh = box(SIZES, [8, 8, 4])
        body = nest("slab", mesh, 0, np.flatnonzero(mesh.nodes[:, 2] == 0.0), TISSUE)
        knife = blade(mesh, np.array([[0.02, 0.0513, 0.04], [0.08, 0.048, 0.04]]), -np.eye(3)[2], DEEP_M)
        found = cut_body(body, knife, 0.0125)
    else:
        body = make_body("liver", LIVER | {"refinements": 0})
        knife = Disc(np.array([0.0, 0.0, 0.05]), unit([1.0, 0.3, 0.2]), 0.06)
        found = cut_body(body, knife, 0.05)
    nodes = found.coarse.nodes
    opening = np.zeros_like(nodes)
    for side, sign in ((0, 1.0), (1, -1.0)):
        lip = np.unique(found.lips[:, side])
        # nothing at the front
        deep = np.maximum(knife.within(nodes[lip]), 0.0)[:, None] / knife.narrow_m
        opening[lip] = sign * OPEN_M * deep * unit(knife.pieces[0].normal)
    return found, opening


@pytest.mark.parametrize("structure", ["composite", "obb"])
def test_pairs_of_lips_are_those_of_brute_force_however_they_lie(cut, structure):
    """At first both lips are at one place, then apart, pressed into each other, and apart again."""
    body, opening = cut
    mesh, whole = body.coarse, body.whole
    assert not len(crossing_pairs(Tree(whole.nodes, whole.triangles, structure))[0])
    tree, found = Tree(mesh.nodes, mesh.triangles, structure), []
    for share in (0.0, 1.0, -0.2, 0.3):
        x = mesh.nodes + share * opening
        tree.refit(x)
        right = crossing([x], [mesh.triangles])
        assert np.array_equal(crossing_pairs(tree)[0], right)
        assert np.array_equal(crossing_pairs(Tree(x, mesh.triangles, structure))[0], right)
        found.append({tuple(each) for each in right.tolist()})
    # each triangle of a lip touches the one that it was, unless the front joins them
    number = {tuple(each): i for i, each in enumerate(np.sort(mesh.triangles, axis=1).tolist())}
    first, second = (np.array([number[tuple(t)] for t in np.sort(body.lips[:, s], axis=1).tolist()]) for s in (0, 1))
    parted = ~(body.lips[:, 0] == body.lips[:, 1]).any(axis=1)
    twins = np.sort(np.column_stack([first, second])[parted], axis=1)
    assert len(twins) > 5 and {tuple(each) for each in twins.tolist()} <= found[0]
    assert not found[1] and not found[3]
    assert len(found[2]) > 5
