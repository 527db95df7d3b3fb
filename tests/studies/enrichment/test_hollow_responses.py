"""A surface alone: its stiffness against the effects of scenes, finite differences and rigid motions."""

import numpy as np
import pytest

from palpate.bodies.body import nest
from palpate.bodies.cylinder import cylinder
from palpate.bodies.material import Material
from palpate.bodies.particles import particles_of
from palpate.bodies.sheet import sheet
from palpate.effects.springs import Springs
from palpate.effects.triangles import make
from palpate.errors import InputError
from palpate.linalg.block_pattern import shared_pattern
from palpate.studies.enrichment.premise_samples import (
    hinge_parts,
    hollow_responses,
    membrane_parts,
    spring_parts,
    stiffness,
)

TISSUE = Material(3000.0, 0.3, 1000.0)
THICK = 0.002
TUBE = cylinder(0.2, 0.03)
KEPT = TUBE.surface
NODES, TRIANGLES = TUBE.nodes[KEPT], np.searchsorted(KEPT, TUBE.triangles)


def hessian(effect, nodes):
    pattern = shared_pattern([effect.couples], len(nodes))
    values = np.zeros((len(pattern.indices), 3, 3))
    effect.add_stiffness(nodes, False, pattern.slots[0], values)
    return pattern.matrix(values).toarray()


def test_triangles_are_those_of_scenes():
    mesh = sheet([0.3, 0.2], [3, 2], THICK)
    nodes = mesh.nodes.copy()
    nodes[:, :2] += 0.01 * np.sin(40 * mesh.nodes[:, :2][:, ::-1])
    held = particles_of(nest("cloth", type(mesh)(nodes, mesh.triangles, THICK), 0, np.array([0]), TISSUE), 0, False)
    ours = stiffness([membrane_parts(nodes, mesh.triangles, THICK, TISSUE)], len(nodes)).toarray()
    assert ours == pytest.approx(hessian(make(held, {}), nodes), abs=1e-9 * abs(ours).max())


def test_springs_are_those_of_scenes():
    pairs, _, weights = spring_parts(NODES, TRIANGLES, THICK, TISSUE)
    lengths = np.linalg.norm(NODES[pairs[:, 1]] - NODES[pairs[:, 0]], axis=1)
    assert (weights * lengths**2).sum() == pytest.approx(3 * 3000 * THICK * area(), rel=1e-12)
    ours = stiffness([spring_parts(NODES, TRIANGLES, THICK, TISSUE)], len(NODES)).toarray()
    assert ours == pytest.approx(hessian(Springs(pairs, weights, lengths), NODES), abs=1e-9 * abs(ours).max())


def area():
    a, b, c = (NODES[TRIANGLES[:, i]] for i in range(3))
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()


def angle(points):
    """The angle between the normals of two triangles (0, 1, 2) and (1, 0, 3), with a sign."""
    start, end, one, other = points
    first, second = np.cross(start - one, end - one), np.cross(end - other, start - other)
    sine = np.cross(first, second) @ (end - start) / np.linalg.norm(end - start)
    return np.arctan2(sine, first @ second)


def test_hinges_have_the_gradient_of_their_angle():
    couples, gradients, _ = hinge_parts(NODES, TRIANGLES, THICK, TISSUE)
    for hinge in (0, 40, 400):
        points = NODES[couples[hinge]]
        step = 1e-7
        for corner in range(4):
            for axis in range(3):
                moved = np.zeros((4, 3))
                moved[corner, axis] = step
                slope = (angle(points + moved) - angle(points - moved)) / (2 * step)
                assert abs(slope) == pytest.approx(
                    abs(gradients[hinge, corner, axis]), abs=1e-4 * abs(gradients[hinge]).max()
                )


@pytest.mark.parametrize("parts", [membrane_parts, spring_parts, hinge_parts])
def test_rigid_motions_cost_nothing(parts):
    matrix = stiffness([parts(NODES, TRIANGLES, THICK, TISSUE)], len(NODES))
    turn = np.cross([0.3, -0.2, 0.5], NODES)
    for moved in (turn, np.ones_like(NODES)):
        assert abs(matrix @ moved.ravel()).max() < 1e-10 * abs(matrix).max() * abs(moved).max()


def test_a_plate_bends_as_its_flexural_stiffness_says():
    """A strip of mirrored cells held at one end and loaded at the other: u = F l³ / 3 D b, with ν = 0."""
    strip = sheet([0.2, 0.02], [40, 4], THICK)
    material = Material(3000.0, 0.0, 1000.0)
    parts = [part(strip.nodes, strip.triangles, THICK, material) for part in (membrane_parts, hinge_parts)]
    matrix = stiffness(parts, len(strip.nodes)).toarray()
    free = np.flatnonzero(np.repeat(strip.nodes[:, 0] > 0.006, 3))
    load = np.zeros((len(strip.nodes), 3))
    end = strip.nodes[:, 0] > 0.2 - 1e-9
    load[end, 2] = 1e-4 / end.sum()
    moved = np.zeros(load.size)
    moved[free] = np.linalg.solve(matrix[np.ix_(free, free)], load.ravel()[free])
    sunk = moved.reshape(-1, 3)[end, 2].mean()
    expected = 1e-4 * 0.195**3 / (3 * 3000 * THICK**3 / 12 * 0.02)
    # 1.27 on these cells; hinges do not converge to a plate, and a factor of two in their stiffness is out of the range
    assert 1.0 < sunk / expected < 1.5


@pytest.mark.parametrize("springs", [True, False])
def test_responses_are_reciprocal_and_local(springs):
    """Maxwell and Betti: what a force at a does at b, one at b does at a."""
    body = nest("tube", TUBE, 1, np.flatnonzero((TUBE.nodes[:, 2] < 1e-3) | (TUBE.nodes[:, 2] > 0.199)), TISSUE)
    contacts = np.setdiff1d(TUBE.surface, body.anchors[0])[[30, 70]]
    found = hollow_responses(body, contacts, THICK, springs)
    assert found.shape == (2, 3, 722, 3)
    at = np.searchsorted(body.fine.surface, contacts)
    assert found[0, :, at[1]] == pytest.approx(found[1, :, at[0]].T, rel=1e-6, abs=1e-12)
    assert not found[:, :, np.searchsorted(body.fine.surface, np.intersect1d(body.anchors[1], body.fine.surface))].any()
    own, other = np.linalg.norm(found[0, :, at[0]]), np.linalg.norm(found[0, :, at[1]])
    assert own > 3 * other > 0


def test_a_surface_that_nothing_holds_is_refused():
    body = nest("tube", TUBE, 1, np.array([0]), TISSUE)
    with pytest.raises(InputError, match=r"tube: its surface alone is free to move; hold more of it \(anchors\)"):
        hollow_responses(body, np.array([100]), THICK, False)
