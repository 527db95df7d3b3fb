import numpy as np
import pytest

from palpate.bodies.box import cylinder
from palpate.bodies.mesh_quality import quality
from palpate.bodies.refinement import refine


def test_counts_are_the_papers_on_both_levels():
    coarse = cylinder(0.2, 0.03)
    fine, _ = refine(coarse)
    assert (len(coarse.surface), len(coarse.triangles)) == (182, 360)
    assert (len(fine.surface), len(fine.triangles)) == (722, 1440)
    assert (len(coarse.nodes), len(coarse.tetrahedra)) == (266, 936)


def test_fills_the_twelve_sided_prism_and_touches_the_round_one():
    mesh = cylinder(0.2, 0.03)
    assert mesh.volumes.min() > 0
    # a regular 12-gon in a circle has area 3 r²
    assert mesh.volumes.sum() == pytest.approx(3 * 0.03**2 * 0.2, rel=1e-12)
    assert np.hypot(*mesh.nodes[:, :2].T).max() == pytest.approx(0.03, rel=1e-12)
    assert mesh.size == pytest.approx(0.2)


def test_diagonals_lean_to_both_sides_equally():
    mesh = cylinder(0.2, 0.03)
    centres = mesh.nodes[mesh.tetrahedra].mean(axis=1)

    def places(points):
        return {tuple(p) for p in np.round(points * 1e7).astype(int).tolist()}

    assert places(centres * [1, -1, 1]) == places(centres)


def test_elements_are_well_shaped():
    assert quality(cylinder(0.2, 0.03))["min_dihedral_deg"] > 35
