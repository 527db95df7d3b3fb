import numpy as np
import pytest

from palpate.bodies.mesh_quality import quality
from palpate.bodies.organs import liver
from palpate.bodies.refinement import refine


@pytest.fixture(scope="module")
def coarse():
    return liver(0.2)


def test_counts_are_the_papers_on_every_level(coarse):
    middle, _ = refine(coarse)
    fine, _ = refine(middle)
    counts = [(len(mesh.surface), len(mesh.triangles)) for mesh in (coarse, middle, fine)]
    assert counts == [(140, 276), (554, 1104), (2210, 4416)]
    assert min(mesh.volumes.min() for mesh in (coarse, middle, fine)) > 0


def test_has_the_size_of_a_liver(coarse):
    assert coarse.size == pytest.approx(0.2, rel=0.01)
    assert 1.0e-3 < coarse.volumes.sum() < 1.6e-3


def test_right_lobe_is_large_and_left_lobe_thin(coarse):
    centres = coarse.nodes[coarse.tetrahedra].mean(axis=1)
    right = centres[:, 0] < 0
    assert coarse.volumes[right].sum() > 2 * coarse.volumes[~right].sum()
    x, _, z = coarse.nodes.T
    assert np.ptp(z[x > 0.06]) < 0.5 * np.ptp(z[x < 0])


def test_elements_are_well_shaped(coarse):
    found = quality(coarse)
    assert found["min_dihedral_deg"] > 20
    assert found["min_radius_ratio"] > 0.3


def test_is_the_same_every_time(coarse):
    again = liver(0.2)
    assert np.array_equal(again.nodes, coarse.nodes)
    assert np.array_equal(again.tetrahedra, coarse.tetrahedra)


def test_scales_with_its_length(coarse):
    assert np.allclose(liver(0.4).nodes, 2 * coarse.nodes, rtol=0, atol=1e-12)
