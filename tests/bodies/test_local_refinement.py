"""Local meshes have no gap, the nodes of the body, and are fine where they are asked to be."""

import numpy as np
import pytest

from palpate.bodies.body import nest
from palpate.bodies.box import box
from palpate.bodies.local_refinement import LocalRefinement
from palpate.bodies.material import Material, Tissue
from palpate.bodies.mesh import FACES

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
