"""Trees over the lips of a cut find all that touch, and lips that touch again collide."""

import numpy as np
import pytest
from fixtures.bodies import LIVER

from palpate.bodies.body import nest
from palpate.bodies.cutting.conform import cut_body
from palpate.bodies.cutting.cut import Disc, blade
from palpate.bodies.cutting.ways import SPLIT_FACES, part
from palpate.bodies.make_body import make_body
from palpate.bodies.material import Material
from palpate.bodies.mesh import TetMesh, components, unit
from palpate.bodies.particles import particles_of
from palpate.bodies.simple_shapes import box
from palpate.collision.trees.tree import Tree
from palpate.collision.trees.tree_query import crossing_pairs
from palpate.effects.linear_elements import LinearElements
from palpate.effects.settings import Ball, Contact, Gravity, Rayleigh
from palpate.studies.brute_force import crossing

TISSUE = Material(5000.0, 0.3, 1000.0)
SIZES = [0.1, 0.1, 0.04]
DEEP_M, OPEN_M = 0.02, 0.004
LOSS = Rayleigh(mass_1_s=5.0, stiffness_s=0.02)


@pytest.fixture(scope="module", params=["slab", "liver"])
def cut(request):
    """A body that a blade has cut: its mesh, the whole one, and how its nodes open the lips, (n, 3) [m]."""
    if request.param == "slab":
        mesh = box(SIZES, [8, 8, 4])
        body = nest("slab", mesh, 0, np.flatnonzero(mesh.nodes[:, 2] == 0.0), TISSUE)
        knife = blade(mesh, np.array([[0.02, 0.0513, 0.04], [0.08, 0.048, 0.04]]), -np.eye(3)[2], DEEP_M)
        found = cut_body(body, knife, 0.0125)
    else:
        body = make_body("liver", LIVER.but(refinements=0))
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


def test_the_half_of_a_severed_block_falls_on_the_other_and_rests_there(play):
    """Cut aslant; the upper half begins 2 mm above the lower one."""
    mesh = box([0.06, 0.06, 0.06], [3, 3, 3])
    whole = nest("block", mesh, 0, np.flatnonzero(mesh.nodes[:, 2] == 0.0), TISSUE)
    found = cut_body(whole, Disc(np.array([0.03, 0.03, 0.033]), unit([0.2, 0.1, 1.0]), 1.0), 0.05)
    piece = components(found.coarse.edges, len(found.coarse.nodes))
    upper = piece == piece[found.coarse.nodes[:, 2].argmax()]
    apart = TetMesh(found.coarse.nodes + np.outer(upper, [0.0, 0.0, 0.002]), found.coarse.tetrahedra)
    particles = particles_of(nest("block", apart, 0, found.anchors[0], TISSUE), 0, surface=False)
    falling = {"held": True, "rayleigh": LOSS, "gravity": Gravity(acceleration_m_s2=[0.0, 0.0, -9.81])}

    def crossed(motion):
        return max(len(crossing([x], [motion.triangles])) for x in motion.positions)

    assert crossed(play([particles], step_s=0.02, steps=6, **falling).motion) > 0
    motion = play([particles], step_s=0.02, steps=40, contact=Contact(friction=0.5, gap_m=5e-4), **falling).motion
    assert not crossed(motion)
    # the lower half carries the upper one's weight to what is held
    force = LinearElements(apart, TISSUE).force(motion.positions[-1])[found.anchors[0]].sum(axis=0)
    carried = 9.81 * np.delete(particles.masses, found.anchors[0]).sum()
    assert force[2] == pytest.approx(-carried, rel=0.02)
    assert np.abs(force[:2]).max() < 0.02 * carried


def test_a_lip_that_is_pressed_meets_the_other_and_moves_it(play):
    """A blade of half a millimetre has cut a block from above; a ball presses one side towards the other."""
    mesh = box([0.06, 0.06, 0.06], [3, 4, 3])
    body = nest("block", mesh, 0, np.flatnonzero(mesh.nodes[:, 2] == 0.0), TISSUE)
    knife = blade(mesh, np.array([[0.0, 0.03, 0.06], [0.06, 0.03, 0.06]]), -np.eye(3)[2], 0.04)
    found = part(body, 0, [knife], SPLIT_FACES).body
    nodes = found.coarse.nodes.copy()
    lips = np.flatnonzero(np.abs(nodes[:, 1] - 0.03) < 1e-9)
    middles = nodes[found.coarse.tetrahedra].mean(axis=1)
    for node in lips:
        beside = middles[(found.coarse.tetrahedra == node).any(axis=1), 1] - 0.03
        if (beside > 0.0).all() or (beside < 0.0).all():
            nodes[node, 1] += 2.5e-4 * np.sign(beside[0])
    particles = particles_of(
        nest("block", TetMesh(nodes, found.coarse.tetrahedra), 0, found.anchors[0], TISSUE), 0, False
    )
    path = {"times_s": [0.0, 0.3], "shifts_m": [[0, 0, 0], [0, 0.014, 0]]}
    ball = Ball(center_m=[0.03, -0.0205, 0.05], radius_m=0.02, **path)

    def pressed(self_contact):
        contact = Contact(instruments=[ball], self_contact=self_contact, gap_m=2e-4)
        motion = play([particles], step_s=0.02, steps=15, held=True, contact=contact, rayleigh=LOSS).motion
        x = motion.positions[-1]
        far = particles.nodes[:, 1] > 0.059
        return len(crossing([x], [motion.triangles])), float(
            (x - particles.nodes)[far & (particles.nodes[:, 2] > 0.05), 1].mean()
        )

    crossed, moved = pressed(True)
    through, still = pressed(False)
    assert not crossed and through > 0
    assert moved > 0.003 and moved > 2.0 * still
