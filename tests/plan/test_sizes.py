"""Sizes of meshes that are known before they are made, and estimates of those that are not."""

from pathlib import Path

import numpy as np
import pytest

from palpate.bodies.body_file import save
from palpate.bodies.make_body import make_body
from palpate.plan.sizes import Level, filled, size_of

HERE = Path()
ROUND = {"young_pa": 3000, "poisson": 0.3, "density_kg_m3": 1000}
LIVER = {"kind": "liver", "length_m": 0.2, "refinements": 2, "anchors": {"nodes": [3, 39, 64]}} | ROUND
ROD = {"kind": "cylinder", "length_m": 0.2, "radius_m": 0.03, "refinements": 1, "anchors": {"nodes": [0, 1, 2]}} | ROUND
BAR = {"kind": "box", "sizes_m": [3, 1, 1], "divisions": [6, 2, 3], "refinements": 1, "anchors": {"nodes": [0, 1, 5]}}
CLOTH = {"kind": "sheet", "sizes_m": [1, 1], "divisions": [4, 6], "thickness_m": 0.01, "anchors": {"nodes": [0]}}


def sizes(body):
    return [
        Level(len(mesh.nodes), len(mesh.surface), len(getattr(mesh, "tetrahedra", mesh.triangles)))
        for mesh in body.levels
    ]


@pytest.mark.parametrize("entry", [LIVER, ROD, BAR | ROUND], ids=["liver", "cylinder", "box"])
def test_generated_bodies_have_the_sizes_that_were_counted(entry):
    assert list(size_of(entry, HERE).levels) == sizes(make_body("new", entry))


def test_a_sheet_has_the_size_that_was_counted():
    cloth = make_body("new", CLOTH | ROUND)
    assert size_of(CLOTH, HERE).coarse == Level(len(cloth.fine.nodes), len(cloth.fine.nodes), len(cloth.fine.triangles))


def test_a_mesh_of_tetrahedra_is_counted_in_its_file(slab, tmp_path):
    meshio = pytest.importorskip("meshio")
    mesh = slab.coarse
    meshio.write_points_cells(tmp_path / "slab.vtk", mesh.nodes, [("tetra", mesh.tetrahedra)])
    size = size_of({"kind": "file", "path": "slab.vtk", "refinements": 1}, tmp_path)
    assert list(size.levels) == sizes(slab)


@pytest.mark.parametrize(("surface", "tetrahedra"), [(140, 528), (300, 1626), (800, 6844), (1200, 12164)])
def test_filled_surfaces_are_estimated_within_a_tenth(surface, tetrahedra):
    """Counts of results/tables/node_mass.csv for the synthetic abdomen."""
    assert filled(surface).elements == pytest.approx(tetrahedra, rel=0.1)


@pytest.mark.parametrize(
    ("wanted", "nodes"), [(None, 200), (300, 300), (5000, 1002)], ids=["as usual", "as given", "kept"]
)
def test_a_surface_in_a_file_is_kept_if_it_is_small_and_remeshed_if_not(tmp_path, wanted, nodes):
    meshio = pytest.importorskip("meshio")
    triangles = np.arange(3 * 2000).reshape(-1, 3)  # a closed surface of 2000 has 1002 nodes
    meshio.write_points_cells(
        tmp_path / "ball.stl", np.random.default_rng(1).random((6000, 3)), [("triangle", triangles)]
    )
    entry = {"kind": "file", "path": "ball.stl", "refinements": 1, "surface_nodes": wanted}
    size = size_of(entry, tmp_path)
    assert size.coarse == filled(nodes) and size.remeshed == (nodes != 1002)


def test_a_body_that_is_made_is_counted_and_no_longer_estimated(slab, tmp_path):
    save(slab, tmp_path / "body.h5")
    entry = {"kind": "ct", "surface_nodes": 5000, "refinements": 1}
    assert list(size_of(entry, HERE, tmp_path / "body.h5").levels) == sizes(slab)
