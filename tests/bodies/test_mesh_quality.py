import numpy as np
import pandas as pd
import pytest

from palpate.bodies.body import nest
from palpate.bodies.mesh import TetMesh
from palpate.bodies.mesh_quality import dihedral_angles, mesh_quality, mesh_sizes, quality


def test_regular_tetrahedron():
    nodes = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], dtype=float)
    mesh = TetMesh(nodes, np.array([[0, 1, 2, 3]]))
    found = quality(TetMesh(nodes, mesh.tetrahedra if mesh.volumes[0] > 0 else np.array([[1, 0, 2, 3]])))
    assert found["min_dihedral_deg"] == pytest.approx(np.degrees(np.arccos(1 / 3)))
    assert found["max_dihedral_deg"] == pytest.approx(found["min_dihedral_deg"])
    assert found["min_radius_ratio"] == pytest.approx(1)
    assert found["volume_m3"] == pytest.approx(8 / 3)


def test_angles_of_the_cut_cube(cube):
    assert np.allclose(np.unique(dihedral_angles(cube).round(6)), [45, 60, 90])


def test_quality_table(cube, material):
    table = mesh_quality(nest("cube", cube, 1, np.arange(4), material))
    assert list(table) == [
        "body",
        "level",
        "min_dihedral_deg",
        "max_dihedral_deg",
        "min_radius_ratio",
        "volume_m3",
    ]
    assert table["level"].tolist() == [0, 1]
    assert np.allclose(table["volume_m3"], 1)


def test_sizes_stand_beside_the_papers(cube, material):
    body = nest("cube", cube, 1, np.arange(4), material)
    table = mesh_sizes(body, {"paper_surface": [[8, 12], None]})
    assert table.iloc[0].tolist() == ["cube", 0, 8, 12, 8, 6, 8, 12]
    assert table.iloc[1].tolist()[:6] == ["cube", 1, 26, 48, 27, 48]
    assert table.iloc[1, 6:].isna().all()
    assert mesh_sizes(body, {})["paper_nodes"].isna().all()
    assert isinstance(table["paper_nodes"].dtype, pd.Int64Dtype)
