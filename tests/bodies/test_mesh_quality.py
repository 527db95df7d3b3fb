"""Faulty meshes are refused, and shapes of elements are measured."""

import numpy as np
import pandas as pd
import pytest

from palpate.bodies.body import nest
from palpate.bodies.mesh import TetMesh
from palpate.bodies.mesh_quality import (
    check_boundary,
    check_closed,
    check_coordinates,
    check_tetrahedra,
    dihedral_angles,
    mesh_quality,
    mesh_sizes,
    quality,
)
from palpate.errors import InputError


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 3e38])
def test_coordinates(cube, bad):
    cube.nodes[5, 1] = bad
    with pytest.raises(InputError, match=r"^a\.msh: 1 of 8 nodes have NaN, infinite .*first: node 5"):
        check_coordinates("a.msh", cube.nodes)


def test_good_elements_come_back_as_they_are(cube):
    assert check_tetrahedra("a", cube.nodes, cube.tetrahedra) is cube.tetrahedra
    check_boundary("a", cube)


def test_some_inverted(cube):
    tetrahedra = cube.tetrahedra.copy()
    tetrahedra[[2, 4]] = tetrahedra[[2, 4]][:, [1, 0, 2, 3]]
    with pytest.raises(InputError, match=r"a: 2 of 6 tetrahedra are inverted \(first: element 2\); repair"):
        check_tetrahedra("a", cube.nodes, tetrahedra)


def test_all_inverted_are_turned(cube):
    turned = check_tetrahedra("a", cube.nodes, cube.tetrahedra[:, [0, 2, 1, 3]])
    assert TetMesh(cube.nodes, turned).volumes.min() > 0


def test_no_volume(cube):
    cube.nodes[:, 2] *= 1e-12
    with pytest.raises(InputError, match="6 of 6 tetrahedra have no volume"):
        check_tetrahedra("a", cube.nodes, cube.tetrahedra)


def test_duplicates(cube):
    twice = np.vstack([cube.tetrahedra, cube.tetrahedra[3:4, [1, 2, 0, 3]]])
    with pytest.raises(InputError, match=r"1 of 7 tetrahedra are duplicates \(first: of element 3\)"):
        check_tetrahedra("a", cube.nodes, twice)


def test_nodes_that_do_not_exist(cube):
    cube.tetrahedra[4, 2] = -1
    cube.tetrahedra[5, 2] = 8
    with pytest.raises(InputError, match=r"2 tetrahedra refer to .* not exist \(first: element 4, of 8 nodes\)"):
        check_tetrahedra("a", cube.nodes, cube.tetrahedra)


def test_elements_that_overlap():
    nodes = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0.1, 0.1, 2], [0, 0, -1]])
    mesh = TetMesh(nodes, np.array([[0, 1, 2, 3], [0, 1, 2, 4], [0, 2, 1, 5]]))
    with pytest.raises(InputError, match=r"share the face of nodes \[0, 1, 2\]"):
        check_boundary("a", mesh)


def test_elements_that_touch_at_an_edge(cube):
    nodes = np.array([[0, 0, 0], [0, 0, 1], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]], dtype=float)
    mesh = TetMesh(nodes, np.array([[0, 2, 3, 1], [0, 4, 5, 1]]))
    assert mesh.volumes.min() > 0
    with pytest.raises(InputError, match=r"not a manifold at the edge of nodes \[0, 1\], where 4"):
        check_boundary("a", mesh)


def test_elements_that_touch_at_a_node(cube):
    both = TetMesh(
        np.vstack([cube.nodes, cube.nodes[1:] * -1]),
        np.vstack([cube.tetrahedra, np.where(cube.tetrahedra == 0, 0, cube.tetrahedra + 7)[:, [1, 0, 2, 3]]]),
    )
    assert both.volumes.min() > 0
    with pytest.raises(InputError, match="not a manifold at node 0, where parts touch at a point"):
        check_boundary("a", both)


def test_closed_surface_passes_and_is_turned_outward(octahedron):
    points, triangles = octahedron
    assert np.array_equal(check_closed("s", points, triangles), triangles)
    assert np.array_equal(check_closed("s", points, triangles[:, ::-1]), triangles)


def test_holes(octahedron):
    points, triangles = octahedron
    with pytest.raises(InputError, match=r"^s: the surface has holes \(3 open edges, first: between points 0 "):
        check_closed("s", points, triangles[1:])


def test_mixed_winding(octahedron):
    points, triangles = octahedron
    triangles[0] = triangles[0, ::-1]
    with pytest.raises(InputError, match="wound opposite ways at 3 edges"):
        check_closed("s", points, triangles)


def test_surface_that_is_not_a_manifold(octahedron):
    points, triangles = octahedron
    pinched = np.where(triangles == 0, 0, triangles + 5)
    both = np.vstack([points, points[1:] * [-1, 1, 1] + [2, 0, 0]])
    with pytest.raises(InputError, match="not a manifold at node 0"):
        check_closed("s", both, np.vstack([triangles, pinched[:, ::-1]]))
    with pytest.raises(InputError, match="1 of 9 triangles are duplicates"):
        check_closed("s", points, np.vstack([triangles, triangles[:1]]))
    with pytest.raises(InputError, match="0 triangles; give a closed surface"):
        check_closed("s", points, triangles[:0])


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
    assert list(table) == ["body", "level", "min_dihedral_deg", "max_dihedral_deg", "min_radius_ratio", "volume_m3"]
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
