"""The cube has the paper's counts and is well shaped."""

import numpy as np
import pytest

from palpate.bodies.mesh_quality import quality
from palpate.models.springs.cube_experiment import middle, paper_cube


def test_counts_are_the_papers_and_elements_are_good(cube):
    mesh = cube.mesh
    assert (len(mesh.nodes), len(mesh.tetrahedra), len(mesh.edges)) == (120, 377, 590)
    assert len(np.unique(mesh.tetrahedra)) == 120
    assert (len(mesh.surface), len(mesh.triangles)) == (96, 188)
    assert mesh.volumes.min() > 0.0 and mesh.volumes.sum() == pytest.approx(1e-6, rel=1e-12)
    assert (np.ptp(mesh.nodes, axis=0) == 0.01).all()
    assert quality(mesh)["min_dihedral_deg"] > 12.0
    assert np.array_equal(paper_cube(0.01).tetrahedra, mesh.tetrahedra)


def test_middles_of_the_pressed_faces_are_nodes(cube):
    for face, where, inward in (
        ("top", [0.5, 0.5, 1.0], [0, 0, -1]),
        ("left", [0.0, 0.5, 0.5], [1, 0, 0]),
        ("front", [0.5, 0.0, 0.5], [0, 1, 0]),
    ):
        node, direction = middle(cube.mesh, face)
        assert cube.mesh.nodes[node] == pytest.approx(0.01 * np.array(where), abs=1e-15)
        assert direction.tolist() == inward
