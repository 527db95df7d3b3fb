"""Boxes, sheets, lattices and the cylinder: counts, volumes, symmetry."""

import numpy as np
import pytest

from palpate.bodies.body import nest
from palpate.bodies.mesh_quality import check_boundary, check_tetrahedra, quality
from palpate.bodies.simple_shapes import box, cut_lattice, cylinder, sheet


def as_set(simplices):
    return {tuple(s) for s in np.sort(simplices, axis=1).tolist()}


def moved(points, simplices, image):
    """The simplices after each point went to its image, (n, d), which is a lattice point too."""
    number = {tuple(p): i for i, p in enumerate(points.tolist())}
    return as_set(np.array([number[tuple(p)] for p in image.tolist()])[simplices])


def check_mirrored(points, simplices, counts):
    """Check that simplices of lattice points, from 0 to ``counts``, are their own mirror image along each axis."""
    for axis, count in enumerate(counts):
        image = points.copy()
        image[:, axis] = count - image[:, axis]
        assert moved(points, simplices, image) == as_set(simplices)


def test_a_box_is_whole():
    mesh = box([0.4, 0.1, 0.2], [4, 2, 3])
    assert (len(mesh.nodes), len(mesh.tetrahedra)) == (5 * 3 * 4, 6 * 24)
    assert mesh.volumes == pytest.approx(np.full(144, 0.4 * 0.1 * 0.2 / 144))
    assert mesh.nodes.min(axis=0).tolist() == [0, 0, 0]
    assert mesh.nodes.max(axis=0) == pytest.approx([0.4, 0.1, 0.2])
    assert mesh.areas.sum() == pytest.approx(2 * (0.4 * 0.1 + 0.4 * 0.2 + 0.1 * 0.2))
    check_tetrahedra("box", mesh.nodes, mesh.tetrahedra)
    check_boundary("box", mesh)


@pytest.mark.parametrize("sizes", [[1, 1, 1], [2, 1, 3]])
def test_refined_elements_keep_their_shape_and_symmetry(material, sizes):
    body = nest("cube", box(sizes, [2, 2, 2]), 2, np.arange(9), material)
    coarse, fine = quality(body.coarse), quality(body.fine)
    for key in ("min_dihedral_deg", "max_dihedral_deg", "min_radius_ratio"):
        assert fine[key] == pytest.approx(coarse[key])
    lattice = np.rint(body.fine.nodes * 8 / sizes).astype(int)
    check_mirrored(lattice, body.fine.tetrahedra, [8, 8, 8])


@pytest.mark.parametrize("divisions", [[4, 2], [2, 4, 6]])
def test_the_mesh_is_its_own_mirror_image(divisions):
    check_mirrored(*cut_lattice(divisions), divisions)


@pytest.mark.parametrize("divisions", [[3, 3], [3, 3, 3]])
def test_no_axis_comes_first(divisions):
    points, simplices = cut_lattice(divisions)
    for shift in range(1, len(divisions)):
        assert moved(points, simplices, np.roll(points, shift, axis=1)) == as_set(simplices)


@pytest.fixture
def cloth():
    return sheet([0.3, 0.2], [6, 4], 0.001)


def test_a_sheet_is_flat_and_whole(cloth):
    assert (len(cloth.nodes), len(cloth.triangles)) == (7 * 5, 48)
    assert not cloth.nodes[:, 2].any()
    assert cloth.areas.sum() == pytest.approx(0.06, rel=1e-14)
    assert np.array_equal(cloth.normals, np.tile([0.0, 0.0, 1.0], (35, 1)))
    assert (cloth.size, cloth.thickness_m) == (pytest.approx(0.3), 0.001)
    assert cloth.tetrahedra.shape == (0, 4) and np.array_equal(cloth.surface, np.arange(35))
    # Euler's formula for a disc
    assert len(cloth.nodes) - len(cloth.edges) + len(cloth.triangles) == 1


def test_no_corner_of_a_sheet_hangs_by_one_triangle(cloth):
    """With even divisions a diagonal ends in each corner, so that it can be bent along no single edge."""
    corners = [0, 4, 30, 34]
    assert np.bincount(cloth.triangles.ravel())[corners].tolist() == [2, 2, 2, 2]


def test_fills_the_twelve_sided_prism_and_touches_the_round_one():
    mesh = cylinder(0.2, 0.03)
    assert mesh.volumes.min() > 0
    # a regular 12-gon in a circle has area 3 r²
    assert mesh.volumes.sum() == pytest.approx(3 * 0.03**2 * 0.2, rel=1e-12)
    assert np.hypot(*mesh.nodes[:, :2].T).max() == pytest.approx(0.03, rel=1e-12)
    assert mesh.size == pytest.approx(0.2)
    assert quality(mesh)["min_dihedral_deg"] > 35


def test_diagonals_lean_to_both_sides_equally():
    mesh = cylinder(0.2, 0.03)
    centres = mesh.nodes[mesh.tetrahedra].mean(axis=1)

    def places(points):
        return {tuple(p) for p in np.round(points * 1e7).astype(int).tolist()}

    assert places(centres * [1, -1, 1]) == places(centres)
