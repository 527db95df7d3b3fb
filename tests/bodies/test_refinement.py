"""Uniform and local refinement, and quadratic elements, against polynomials."""

from itertools import product
from math import factorial

import numpy as np
import pytest

from palpate.bodies.body import nest
from palpate.bodies.local_refinement import LocalRefinement
from palpate.bodies.material import Material, Tissue
from palpate.bodies.mesh import FACES
from palpate.bodies.refinement import (
    QUADRATURE_POINTS,
    finer,
    quadratic_gradients,
    quadratic_prolongation,
    refine,
    shape_functions,
)
from palpate.bodies.simple_shapes import box


def test_a_finer_body_is_the_same_with_levels_more(slab):
    again = finer(slab, 2)
    assert again.levels[:2] == slab.levels and len(again.levels) == 4
    assert np.array_equal(again.fine.nodes, refine(refine(slab.fine)[0])[0].nodes)
    assert np.abs(again.prolongation @ slab.coarse.nodes - again.fine.nodes).max() < 1e-16
    for mesh, held in zip(again.levels, again.anchors, strict=True):
        plane = mesh.nodes[held] - slab.coarse.nodes[slab.anchors[0][0]]
        assert np.linalg.matrix_rank(plane, tol=1e-12) == 2
    # held at one end, whose faces are split in four
    assert [len(held) for held in again.anchors] == [9, 25, 81, 289]
    assert finer(slab, 0) is slab


@pytest.fixture(scope="module")
def levels(box):
    meshes = [box([2, 1, 2], [0.2, 0.1, 0.3], jitter=0.2)]
    for _ in range(2):
        meshes.append(refine(meshes[-1])[0])
    return meshes


def quadratic(x):
    """Three polynomials of degree 2 at points (n, 3)."""
    return np.stack([x[:, 0] ** 2 - 3 * x[:, 1] * x[:, 2], x[:, 2] ** 2 + x[:, 0], x[:, 0] * x[:, 1] - 2.0], axis=1)


def test_slopes_are_derivatives():
    inside = np.random.default_rng(1).dirichlet(np.ones(4), 20)
    for corner, delta in enumerate(1e-6 * np.eye(4)):
        slope = (shape_functions(inside + delta) - shape_functions(inside - delta)) / 2e-6
        assert np.abs(slope - quadratic_gradients(inside)[:, :, corner]).max() < 1e-9


def test_points_integrate_degree_two_exactly():
    """Σ over the points of a monomial of barycentric coordinates, against a! b! c! d! 3! / (a + b + c + d + 3)!"""
    for powers in product(range(3), repeat=4):
        found = np.prod(QUADRATURE_POINTS**powers, axis=1).mean()
        exact = 6 * np.prod([factorial(p) for p in powers]) / factorial(sum(powers) + 3)
        assert (found == pytest.approx(exact, rel=1e-14)) == (sum(powers) <= 2)


def test_prolongation_is_exact_for_quadratic_polynomials(levels):
    coarse, fine, finest = levels
    matrix = quadratic_prolongation(coarse, fine)
    assert matrix.shape == (len(finest.nodes), len(fine.nodes))
    assert np.abs(matrix @ quadratic(fine.nodes) - quadratic(finest.nodes)).max() < 1e-15
    linear = refine(fine)[1]
    assert np.abs(linear @ quadratic(fine.nodes) - quadratic(finest.nodes)).max() > 1e-4


TIP = np.array([0.2, 0.05, 0.05])


@pytest.fixture(scope="module", params=["plain", "moved"])
def whole(request):
    """A bar with three levels, once with the new nodes moved off the edges' middles."""
    soft, stiff = Material(3000.0, 0.3, 1000.0), Material(30000.0, 0.3, 1000.0)
    coarse = box([0.2, 0.05, 0.05], [4, 1, 1])
    regions = Tissue([soft, stiff], (coarse.nodes[coarse.tetrahedra, 0].mean(axis=1) > 0.1).astype(int))
    held = np.flatnonzero(coarse.nodes[:, 0] == 0.0)

    def swell(mesh, first):
        nodes = mesh.nodes.copy()
        nodes[first:] *= 1.02
        return type(mesh)(nodes, mesh.tetrahedra)

    return nest("bar", coarse, 2, held, soft, swell if request.param == "moved" else None, regions=regions)


def faces(mesh):
    return np.unique(np.sort(mesh.tetrahedra[:, FACES].reshape(-1, 3), axis=1), axis=0, return_counts=True)


@pytest.mark.parametrize("depth", [1, 2])
@pytest.mark.parametrize("radius", [0.0, 0.03, 0.07, 1.0])
def test_elements_fill_the_body_without_gaps(whole, depth, radius):
    """Each face inside has two elements, none is inverted, and the surface is that of a closed body."""
    local = LocalRefinement(whole, depth).around(TIP, radius)
    for mesh in local.levels:
        assert (mesh.volumes > 0).all()
        around = np.bincount(
            np.sort(mesh.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1) @ [1, len(mesh.nodes)]
        )
        assert set(around[around > 0]) == {2}  # a hanging node would leave edges of the surface open, or inside
        assert faces(mesh)[1].max() == 2
    if np.allclose(whole.fine.nodes[len(whole.coarse.nodes) :].max(axis=0), whole.coarse.nodes.max(axis=0)):
        assert all(mesh.volumes.sum() == pytest.approx(whole.fine.volumes.sum(), rel=1e-12) for mesh in local.levels)
        assert all(mesh.areas.sum() == pytest.approx(whole.fine.areas.sum(), rel=1e-12) for mesh in local.levels)


def test_it_is_fine_near_the_place_and_coarse_elsewhere(whole):
    local = LocalRefinement(whole, 2).around(TIP, 0.02)
    assert len(whole.coarse.nodes) < len(local.fine.nodes) < 0.5 * len(whole.fine.nodes)
    for level, mesh in enumerate(local.levels):
        near = np.linalg.norm(whole.levels[level].nodes - TIP, axis=1) <= 0.02
        assert np.isin(np.flatnonzero(near), local.numbers[level]).all()
        assert np.array_equal(mesh.nodes, whole.levels[level].nodes[local.numbers[level]])
    far = np.flatnonzero(local.fine.nodes[:, 0] < 0.05)
    assert set(local.numbers[-1][far]) <= set(range(len(whole.coarse.nodes)))


def test_everywhere_it_is_the_body_itself(whole):
    local = LocalRefinement(whole, 2).around(TIP, 1.0)
    for mine, theirs in zip(local.levels, whole.levels, strict=True):
        assert np.array_equal(mine.nodes, theirs.nodes) and np.array_equal(mine.tetrahedra, theirs.tetrahedra)
    for mine, theirs in zip(local.prolongations, whole.prolongations, strict=True):
        assert abs(mine - theirs).max() == 0.0
    assert all(np.array_equal(mine, theirs) for mine, theirs in zip(local.anchors, whole.anchors, strict=True))


def test_levels_are_nested_and_keep_what_is_held_and_stiff(whole):
    local = LocalRefinement(whole, 2).around(TIP, 0.03)
    if np.array_equal(whole.prolongations[0] @ whole.coarse.nodes, whole.levels[1].nodes):
        for up, mesh, finer in zip(local.prolongations, local.levels[:-1], local.levels[1:], strict=True):
            assert np.abs(up @ mesh.nodes - finer.nodes).max() < 1e-15
    held = whole.anchors[-1]
    assert np.array_equal(local.numbers[-1][local.anchors[-1]], np.intersect1d(local.numbers[-1], held))
    for level, mesh in enumerate(local.levels):
        stiff = local.tissue(level).region == 1
        whole_stiff = whole.regions.region == 1
        at_rest = whole.levels[0].volumes if level == 0 else None
        if at_rest is None and np.allclose(mesh.volumes.sum(), whole.coarse.volumes.sum()):
            assert mesh.volumes[stiff].sum() == pytest.approx(whole.coarse.volumes[whole_stiff].sum(), rel=1e-12)


@pytest.mark.parametrize("radii", [0.05, [0.2, 0.1, 0.05, 0.03]])
def test_levels_beyond_the_bodys_own_are_as_sound(whole, radii):
    """Two levels that the body lacks, near the place only: conforming, nested, of the body's shape and volume."""
    plain = whole.from_level(whole.shape_level)
    depth = len(plain.levels) + 1
    local = LocalRefinement(plain, depth).around(TIP, radii if isinstance(radii, float) else radii[:depth])
    assert len(local.levels) == depth + 1
    for up, mesh, finer_mesh in zip(local.prolongations, local.levels[:-1], local.levels[1:], strict=True):
        assert (finer_mesh.volumes > 0.0).all() and faces(finer_mesh)[1].max() == 2
        assert np.abs(up @ mesh.nodes - finer_mesh.nodes).max() < 1e-15
        assert finer_mesh.volumes.sum() == pytest.approx(plain.coarse.volumes.sum(), rel=1e-12)
        assert finer_mesh.areas.sum() == pytest.approx(plain.coarse.areas.sum(), rel=1e-12)
    stiff = local.tissue(depth).region == 1
    of_coarse = plain.coarse.volumes[plain.tissue(0).region == 1].sum()
    assert local.fine.volumes[stiff].sum() == pytest.approx(of_coarse, rel=1e-12)
    near = np.linalg.norm(local.fine.nodes[local.fine.edges].mean(axis=1) - TIP, axis=1) < 0.02
    longest = np.linalg.norm(np.diff(local.fine.nodes[local.fine.edges], axis=1)[:, 0], axis=1)[near].max()
    coarse = np.linalg.norm(np.diff(plain.coarse.nodes[plain.coarse.edges], axis=1)[:, 0], axis=1).max()
    assert longest < 1.1 * coarse / 2**depth


def test_the_shape_begins_at_the_last_level_that_was_moved(whole):
    moved = not np.allclose(whole.prolongations[0] @ whole.coarse.nodes, whole.levels[1].nodes)
    assert whole.shape_level == (1 if moved else 0)
    shape = whole.from_level(whole.shape_level)
    assert np.abs(shape.prolongation @ shape.coarse.nodes - whole.fine.nodes).max() < 1e-12
    assert np.array_equal(shape.tissue(0).region, whole.tissue(whole.shape_level).region)
