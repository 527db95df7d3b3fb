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
    mesh_sizes,
    quality,
)
from palpate.errors import InputError


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 3e38])
def test_coordinates(cube, bad):
    cube.nodes[5, 1] = bad
    with pytest.raises(InputError, match=r"^a\.msh: 1 of 8 nodes have NaN, infinite .*first: node 5"):
        check_coordinates("a.msh", cube.nodes)


@pytest.mark.parametrize(
    ("scale", "tetrahedra", "message"),
    [
        (1.0, lambda t: np.where(np.isin(np.arange(6), [2, 4])[:, None], t[:, [1, 0, 2, 3]], t),
         r"a: 2 of 6 tetrahedra are inverted \(first: element 2\); repair"),
        (1e-12, lambda t: t, "6 of 6 tetrahedra have no volume"),
        (1.0, lambda t: np.vstack([t, t[3:4, [1, 2, 0, 3]]]), r"1 of 7 tetrahedra are duplicates \(first: of el.* 3"),
    ],
    ids=["inverted", "flat", "duplicate"],
)  # fmt: skip
def test_faulty_elements_are_refused(cube, scale, tetrahedra, message):
    with pytest.raises(InputError, match=message):
        check_tetrahedra("a", cube.nodes * [1.0, 1.0, scale], tetrahedra(cube.tetrahedra))


def test_all_inverted_are_turned(cube):
    turned = check_tetrahedra("a", cube.nodes, cube.tetrahedra[:, [0, 2, 1, 3]])
    assert TetMesh(cube.nodes, turned).volumes.min() > 0


OVERLAP = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0.1, 0.1, 2], [0, 0, -1]]
TOUCH = [[0, 0, 0], [0, 0, 1], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]]


@pytest.mark.parametrize(
    ("nodes", "tetrahedra", "message"),
    [
        (OVERLAP, [[0, 1, 2, 3], [0, 1, 2, 4], [0, 2, 1, 5]], r"share the face of nodes \[0, 1, 2\]"),
        (TOUCH, [[0, 2, 3, 1], [0, 4, 5, 1]], r"not a manifold at the edge of nodes \[0, 1\], where 4"),
        ([*TOUCH[:4], [-1, 0, 0], [0, -1, 0], [0, 0, -1]], [[0, 2, 3, 1], [0, 5, 4, 6]],
         "not a manifold at node 0, where parts touch at a point"),
    ],
    ids=["face", "edge", "node"],
)  # fmt: skip
def test_elements_that_overlap_or_touch_are_refused(nodes, tetrahedra, message):
    with pytest.raises(InputError, match=message):
        check_boundary("a", TetMesh(np.array(nodes, dtype=float), np.array(tetrahedra)))


def test_closed_surface_passes_and_is_turned_outward(octahedron):
    points, triangles = octahedron
    assert np.array_equal(check_closed("s", points, triangles), triangles)
    assert np.array_equal(check_closed("s", points, triangles[:, ::-1]), triangles)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda t: t[1:], r"^s: the surface is not closed, or neighbouring triangles are wound opposite ways; close"),
        (lambda t: np.vstack([t[:1, ::-1], t[1:]]), "wound opposite ways"),
        (lambda t: np.vstack([t, np.where(t == 0, 0, t + 5)[:, ::-1]]), "not a manifold at node 0"),
        (lambda t: np.vstack([t, t[:1]]), "not closed"),
        (lambda t: t[:0], "not closed"),
    ],
    ids=["hole", "winding", "pinched", "duplicate", "none"],
)
def test_a_faulty_surface_is_refused(octahedron, change, message):
    points, triangles = octahedron
    both = np.vstack([points, points[1:] * [-1, 1, 1] + [2, 0, 0]])
    with pytest.raises(InputError, match=message):
        check_closed("s", both, change(triangles))


def test_regular_tetrahedron():
    nodes = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], dtype=float)
    mesh = TetMesh(nodes, np.array([[0, 1, 2, 3]]))
    found = quality(TetMesh(nodes, mesh.tetrahedra if mesh.volumes[0] > 0 else np.array([[1, 0, 2, 3]])))
    assert found["min_dihedral_deg"] == pytest.approx(np.degrees(np.arccos(1 / 3)))
    assert found["max_dihedral_deg"] == pytest.approx(found["min_dihedral_deg"])
    assert found["min_radius_ratio"] == pytest.approx(1)
    assert found["volume_m3"] == pytest.approx(8 / 3)


def test_sizes_stand_beside_the_papers(cube, material):
    body = nest("cube", cube, 1, np.arange(4), material)
    table = mesh_sizes(body, [[8, 12], None])
    assert table.iloc[0].tolist() == ["cube", 0, 8, 12, 8, 6, 8, 12]
    assert table.iloc[1].tolist()[:6] == ["cube", 1, 26, 48, 27, 48]
    assert table.iloc[1, 6:].isna().all()
    assert mesh_sizes(body)["paper_nodes"].isna().all()
    assert isinstance(table["paper_nodes"].dtype, pd.Int64Dtype)
