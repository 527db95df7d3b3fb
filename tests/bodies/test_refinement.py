import numpy as np
import pytest

from palpate.bodies.box import cylinder
from palpate.bodies.mesh_quality import quality
from palpate.bodies.refinement import finer, refine


def test_fine_nodes_are_the_prolonged_coarse_ones(cube):
    fine, prolongation = refine(cube)
    assert np.array_equal(fine.nodes[:8], cube.nodes)
    assert np.abs(prolongation @ cube.nodes - fine.nodes).max() == 0
    assert np.allclose(prolongation.sum(axis=1), 1)


def test_volume_and_orientation_are_kept(cube):
    finer = cube
    for _ in range(3):
        finer, _ = refine(finer)
    assert len(finer.tetrahedra) == 6 * 8**3
    assert finer.volumes.min() > 0
    assert finer.volumes.sum() == pytest.approx(1, rel=1e-13)


def test_surface_splits_in_four_with_coarse_nodes_first(cube):
    fine, _ = refine(cube)
    assert len(fine.triangles) == 4 * len(cube.triangles)
    assert np.array_equal(fine.surface[: len(cube.surface)], cube.surface)


def test_quality_settles_after_one_refinement():
    mesh, angles = cylinder(0.2, 0.03), []
    for _ in range(3):
        angles.append(quality(mesh)["min_dihedral_deg"])
        mesh, _ = refine(mesh)
    # the inner octahedra may bring in one smaller angle, once; their children repeat the shapes
    assert angles[1] > 0.85 * angles[0]
    assert angles[2] == pytest.approx(angles[1], rel=1e-9)


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
