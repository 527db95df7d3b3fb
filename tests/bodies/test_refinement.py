import numpy as np
import pytest

from palpate.bodies.cylinder import cylinder
from palpate.bodies.mesh_quality import quality
from palpate.bodies.refinement import refine


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
