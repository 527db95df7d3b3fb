"""Finer meshes on a given surface."""

from itertools import pairwise

import numpy as np
import pytest

from palpate.bodies.body import nest
from palpate.bodies.mesh_quality import quality
from palpate.bodies.refinement import refine
from palpate.bodies.surfaces.decimate import fibonacci_sphere, triangulate
from palpate.bodies.surfaces.snap import snapper
from palpate.bodies.surfaces.tetrahedralize import tetrahedralize

COARSE, DENSE = fibonacci_sphere(60), fibonacci_sphere(8000)


def nested(material, radius=1.0):
    """A coarse ball of radius 1, refined twice onto a sphere of another."""
    coarse = tetrahedralize(COARSE, triangulate(COARSE))
    settle = snapper(radius * DENSE, DENSE)
    held = np.array([0, 1, 59])
    return nest("ball", coarse, 2, held, material), nest("ball", coarse, 2, held, material, settle)


def test_new_surface_nodes_reach_the_surface_and_the_volume_converges(material):
    plain, snapped = nested(material)
    missing = [4 / 3 * np.pi - mesh.volumes.sum() for mesh in snapped.levels]
    for before, after in pairwise(missing):
        # the facets' distance from the sphere is quadratic in their edge
        assert before / after == pytest.approx(4, rel=0.1)
    for mesh, old in zip(snapped.levels[1:], plain.levels[1:], strict=True):
        assert np.abs(np.linalg.norm(mesh.nodes[mesh.surface], axis=1) - 1).max() < 1e-3
        assert quality(mesh)["min_dihedral_deg"] > 10
        assert quality(refine(mesh)[0])["min_dihedral_deg"] > 10
        assert np.array_equal(mesh.surface, old.surface)


def test_coarse_nodes_prolongations_and_anchors_stay(material):
    plain, snapped = nested(material)
    for mesh in snapped.levels:
        assert np.array_equal(mesh.nodes[: len(snapped.coarse.nodes)], snapped.coarse.nodes)
    assert (snapped.prolongation != plain.prolongation).nnz == 0
    assert all(np.array_equal(*pair) for pair in zip(snapped.anchors, plain.anchors, strict=True))


def test_no_element_is_inverted_for_a_surface_out_of_reach(material):
    _, snapped = nested(material, radius=0.4)
    for mesh in snapped.levels:
        assert mesh.volumes.min() > 0
        assert quality(mesh)["min_dihedral_deg"] > 5
