"""Surfaces with faults are mended or refused, and filled."""

import re
import threading
from dataclasses import replace

import numpy as np
import pytest

from palpate.bodies.organs import liver_shape
from palpate.bodies.simple_shapes import box
from palpate.bodies.surfaces.mend import mend
from palpate.bodies.surfaces.remesh import fibonacci_sphere, triangulate
from palpate.bodies.surfaces.solid import solidify, winding_numbers
from palpate.bodies.surfaces.tetrahedralize import gmsh_session, tetrahedralize
from palpate.bodies.surfaces.triangles import drop_unused, volume, weld
from palpate.errors import InputError

BALL = 0.1 * fibonacci_sphere(1500)
FACES = triangulate(BALL)
TRUE = volume(BALL, FACES)
rng = np.random.default_rng(5)


def turned(triangles, part):
    chosen = rng.random(len(triangles)) < part
    return np.where(chosen[:, None], triangles[:, ::-1], triangles)


def without(place, width):
    return FACES[np.linalg.norm(BALL[FACES].mean(axis=1) - place, axis=1) > width]


SPECK = np.array([[0, 0, 0], [0.004, 0, 0], [0, 0.004, 0], [0, 0, 0.004]])
TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
SCATTERED = BALL[FACES].reshape(-1, 3) + rng.normal(size=(3 * len(FACES), 3)) * 2e-6

FAULTS = {
    "mixed": (BALL, turned(FACES, 0.3), r"\d+ of 2996 triangles turned"),
    "inward": (BALL, FACES[:, ::-1], "all triangles turned outward"),
    "repeated": (BALL, np.vstack([FACES, FACES[:50], FACES[60:70, ::-1]]), "60 repeated or flat triangles removed"),
    "holes": (BALL, without([0.1, 0, 0], 0.01), r"1 holes closed \(the largest of \d+ edges, [\d.]+ mm\)"),
    "torn_apart": (*weld(SCATTERED, np.arange(3 * len(FACES)).reshape(-1, 3)), r"points up to 0\.02 mm apart merged"),
    "flat_cut": (BALL, FACES[BALL[FACES].mean(axis=1)[:, 2] > -0.095], r"1 holes closed"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_is_mended_and_said(name):
    points, triangles, note = FAULTS[name]
    mended = mend("ball", points, triangles)
    assert volume(mended.points, mended.triangles) == pytest.approx(TRUE, rel=0.01)
    assert len(mended.notes) == 1
    assert re.match(note, mended.notes[0])


def test_a_large_hole_is_refused_with_its_edges_and_place():
    with pytest.raises(InputError, match=r"a hole of \d+ edges, .* cm across, around \(.*\) m; close it"):
        mend("ball", BALL, without([0.1, 0, 0], 0.1))


def test_a_speck_is_dropped_and_a_second_body_refused():
    speck = np.vstack([BALL, SPECK + 0.08]), np.vstack([FACES, TETRAHEDRON + len(BALL)])
    solid = solidify("ball", mend("ball", *speck))
    assert solid.notes[0].startswith("1 separate piece dropped")
    assert np.linalg.norm(solid.places, axis=1).max() < 0.101
    other = np.vstack([BALL, 0.7 * BALL + 0.2]), np.vstack([FACES, FACES + len(BALL)])
    with pytest.raises(InputError, match=r"2 separate pieces, .*give each body a file of its own"):
        solidify("ball", mend("ball", *other))


def block(sizes, parts, low=(0.0, 0.0, 0.0)):
    """Build the surface of a box [m] of finely divided sides: points, and triangles wound outward."""
    mesh = box(sizes, parts)
    points, triangles = drop_unused(mesh.nodes, mesh.triangles)
    return points + low, triangles


def solid_of(*shells):
    starts = np.cumsum([0, *(len(points) for points, _ in shells)])
    points = np.vstack([points for points, _ in shells])
    triangles = np.vstack([each + start for (_, each), start in zip(shells, starts, strict=False)])
    mended = mend("block", *weld(points, triangles))
    solid = solidify("block", mended)
    return replace(solid, notes=mended.notes + solid.notes)


@pytest.mark.parametrize("sizes", [[0.15, 0.1, 0.0095], [0.2, 0.05, 0.0126], [0.06, 0.06, 0.01], [0.1, 0.1, 0.1]])
def test_a_finely_divided_block_has_its_volume(sizes):
    solid = solid_of(block(sizes, [round(side / 0.005) for side in sizes]))
    assert solid.volume_m3 == pytest.approx(np.prod(sizes), rel=1e-12)
    assert solid.mask.sum() * solid.voxel_m3 == pytest.approx(np.prod(sizes), rel=1e-9)


@pytest.mark.parametrize("turn", [np.diag([-1, -1, 1]), np.diag([1, -1, -1]), np.eye(3)[[1, 2, 0]]])
def test_a_turned_organ_is_the_same_solid(turn):
    points = 0.1 * liver_shape(fibonacci_sphere(1500))
    before, after = (solidify("liver", mend("liver", each, FACES)) for each in (points, points @ turn))
    assert after.volume_m3 == pytest.approx(before.volume_m3, rel=1e-12)
    assert abs(after.mask.sum() - before.mask.sum()) < 1e-4 * before.mask.sum()
    assert before.volume_m3 == pytest.approx(volume(points, FACES), rel=1e-12)


@pytest.mark.parametrize(
    ("other", "note"),
    [
        (block([0.1, 0.1, 0.1], [8, 8, 8], (0.1, 0, 0)), "128 pairs of triangles removed that two parts share"),
        (block([0.1, 0.1, 0.1], [5, 5, 5], (0.1, 0, 0)), "2 parts that touch, or lie less than 1.25 mm apart, joined"),
        (block([0.1, 0.04, 0.03], [4, 2, 2], (0.1, 0.02, 0.05)), "2 parts that touch, or lie less than 1.25 mm apart"),
        (block([0.1, 0.1, 0.1], [8, 8, 8], (0.10002, 0, 0)), "2 parts that touch, or lie less than 1.25 mm apart"),
    ],
    ids=["same triangles", "others", "smaller", "20 µm apart"],
)
def test_parts_that_share_a_wall_are_one_body_without_it(other, note):
    solid = solid_of(block([0.1, 0.1, 0.1], [8, 8, 8]), other)
    assert len(solid.notes) == 1 and solid.notes[0].startswith(note)
    assert solid.volume_m3 == pytest.approx(1e-3 + volume(*other), rel=1e-6)
    inside = (np.abs(solid.places - [0.1, 0.045, 0.065]) < [0.005, 0.01, 0.01]).all(axis=1)
    assert not inside.any()


def test_parts_that_overlap_count_once():
    shift = np.array([0.1, 0, 0])
    union = mend("balls", np.vstack([BALL, BALL + shift]), np.vstack([FACES, FACES + len(BALL)]))
    solid = solidify("balls", union)
    # two balls of radius r at a distance r have 27/16 of the volume of one
    assert solid.mask.sum() * solid.voxel_m3 == pytest.approx(27 / 16 * TRUE, rel=0.01)
    inside = np.minimum(*(np.linalg.norm(solid.places - centre, axis=1) for centre in (0, shift))) < 0.095
    assert inside.mean() < 0.01


def test_a_shell_wound_inward_is_a_hollow_and_one_wound_outward_a_part():
    points = np.vstack([BALL, 0.5 * BALL])
    hollow = solidify("ball", mend("ball", points, np.vstack([FACES, FACES[:, ::-1] + len(BALL)])))
    part = solidify("ball", mend("ball", points, np.vstack([FACES, FACES + len(BALL)])))
    (found,) = hollow.hollows
    assert found.sum() * hollow.voxel_m3 == pytest.approx(TRUE / 8, rel=0.03)
    assert hollow.volumes_m3 == pytest.approx([TRUE, TRUE / 8], rel=1e-12)
    assert part.hollows == []


def test_winding_is_that_of_a_ball_also_with_a_hole():
    for triangles in (FACES, without([0, 0, 0.1], 0.01)):
        winding = winding_numbers(BALL, triangles, np.full(3, -0.12), 0.01, (25, 25, 25))
        axis = -0.12 + 0.01 * np.arange(25)
        radius = np.sqrt(sum(a**2 for a in np.meshgrid(axis, axis, axis, indexing="ij")))
        assert (winding[radius < 0.09] > 0.5).all()
        assert (winding[radius > 0.103] < 0.5).all()


def test_keeps_the_surface_and_its_volume_and_names_what_cannot_be_filled(octahedron):
    points, triangles = octahedron
    mesh = tetrahedralize(points, triangles)
    assert np.array_equal(mesh.nodes[:6], points)
    assert {frozenset(t) for t in mesh.triangles.tolist()} == {frozenset(t) for t in triangles.tolist()}
    assert mesh.volumes.min() > 0
    assert mesh.volumes.sum() == pytest.approx(4 / 3)
    both = np.vstack([points, points + np.array([3, 0, 0])])
    with pytest.raises(InputError, match=r"^two\.stl: the surface has 2 separate shells; give each body"):
        tetrahedralize(both, np.vstack([triangles, triangles + 6]), source="two.stl")
    points[5] = [1, 1, 1]
    with pytest.raises(InputError, match=r"^knot\.stl: gmsh .*itself\.$"):
        tetrahedralize(points, triangles, source="knot.stl")


@pytest.fixture
def ball():
    points = fibonacci_sphere(300)
    return points, triangulate(points)


def test_is_the_same_every_time_and_off_the_main_thread_and_leaves_no_state_behind(ball):
    first = tetrahedralize(*ball)
    found = []
    thread = threading.Thread(target=lambda: found.append(tetrahedralize(*ball)))
    thread.start()
    thread.join()
    assert np.array_equal(found[0].nodes, first.nodes)
    assert np.array_equal(found[0].tetrahedra, first.tetrahedra)
    with pytest.raises(RuntimeError), gmsh_session() as gmsh:
        raise RuntimeError
    assert not gmsh.isInitialized()
