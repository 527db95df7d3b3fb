import numpy as np
import pytest

from palpate.bodies.make_body import make_body
from palpate.bodies.mesh_quality import mesh_quality, mesh_sizes
from palpate.errors import InputError

SPHERE = {"sphere": {"center_m": [-0.03, 0.05, 0.035], "radius_m": 0.045}}
CYLINDER = {"kind": "cylinder", "length_m": 0.2, "radius_m": 0.03, "refinements": 1}
LIVER = {"kind": "liver", "length_m": 0.2, "refinements": 2, "anchors": SPHERE}


def counts(body):
    table = mesh_sizes(body, {})
    return table[["surface_nodes", "surface_triangles", "nodes", "tetrahedra"]].to_numpy().tolist()


def check_nesting(body):
    volume = body.coarse.volumes.sum()
    for coarse, fine, prolongation in zip(body.levels, body.levels[1:], body.prolongations, strict=False):
        assert np.array_equal(prolongation @ coarse.nodes, fine.nodes)
        assert fine.volumes.min() > 0
        assert fine.volumes.sum() == pytest.approx(volume, rel=1e-12)
    n = len(body.coarse.nodes)
    assert np.array_equal(body.fine.nodes[:n], body.coarse.nodes)
    assert np.array_equal(body.anchors[-1][body.anchors[-1] < n], body.anchors[0])


def test_cylinder(entry):
    body = make_body("cylinder", entry | CYLINDER)
    assert counts(body) == [[182, 360, 266, 936], [722, 1440, 1647, 7488]]
    assert [len(held) for held in body.anchors] == [19, 61]
    check_nesting(body)


def test_liver(entry):
    body = make_body("liver", entry | LIVER)
    assert [row[:2] for row in counts(body)] == [[140, 276], [554, 1104], [2210, 4416]]
    check_nesting(body)
    held = np.intersect1d(body.anchors[0], body.coarse.surface)
    assert 8 <= len(held) <= 0.2 * 140
    # the bare area is at the back
    assert body.coarse.normals[held].mean(axis=0)[1] > 0.5


BED = {"sphere": {"center_m": [0.0, -0.03, 0.1], "radius_m": 0.05}, "stiffness_n_m3": 1e5}


def test_a_body_on_a_bed_needs_no_anchors(entry):
    free = {key: value for key, value in (entry | CYLINDER).items() if key != "anchors"}
    body = make_body("cylinder", free | {"bed": BED})
    assert [len(held) for held in body.anchors] == [0, 0]
    assert body.bed.center_m.tolist() == [0.0, -0.03, 0.1] and body.bed.stiffness_n_m3 == 1e5
    both = make_body("cylinder", entry | CYLINDER | {"bed": BED})
    assert len(both.anchors[0]) == 19 and both.bed.radius_m == 0.05
    assert make_body("cylinder", entry | CYLINDER).bed is None


def test_a_file_on_a_bed_is_not_held_by_default(entry, shared_meshes):
    free = {key: value for key, value in entry.items() if key != "anchors"}
    own = free | {"kind": "file", "path": str(shared_meshes / "liver.msh"), "scale_m": 0.03, "refinements": 0}
    middle = make_body("own", own | {"anchors": {"nodes": [3, 39, 64]}}).coarse.nodes[3].tolist()
    body = make_body("own", own | {"bed": BED | {"sphere": {"center_m": middle, "radius_m": 0.06}}})
    assert not len(body.anchors[0]) and body.bed is not None


def test_box(entry):
    body = make_body(
        "bar", entry | {"kind": "box", "sizes_m": [0.1, 0.1, 0.3], "divisions": [2, 2, 6], "refinements": 1}
    )
    assert counts(body)[0] == [63 - 5, 2 * (4 + 4 + 4 * 12), 63, 144]
    assert [len(held) for held in body.anchors] == [9, 25]
    check_nesting(body)


def test_sheet(entry):
    entry = {key: value for key, value in entry.items() if key != "refinements"}
    changes = {"kind": "sheet", "sizes_m": [0.3, 0.2], "divisions": [6, 4], "thickness_m": 0.001}
    body = make_body("cloth", entry | changes | {"anchors": {"nodes": [0, 4]}})
    assert counts(body) == [[35, 48, 35, 0]]
    assert body.anchors[0].tolist() == [0, 4]
    assert mesh_quality(body).empty


@pytest.mark.parametrize("name", ["liver.msh", "liver_v4.1_bin.msh"])
def test_liver_from_a_file(entry, shared_meshes, name):
    changes = {"kind": "file", "path": str(shared_meshes / name), "scale_m": 0.03, "refinements": 2}
    body = make_body("own", entry | changes | {"anchors": {"nodes": [3, 39, 64]}})
    assert counts(body) == [[140, 276, 181, 596], [554, 1104, 1095, 4768], [2210, 4416, 7509, 38144]]
    assert np.allclose(body.coarse.nodes[3], 0.03 * np.array([-0.642848, 2.34542, 2.57241]), rtol=1e-12)
    assert body.anchors[0].tolist() == [3, 39, 64]
    check_nesting(body)


def test_cylinder_from_a_file(entry, shared_meshes):
    path = str(shared_meshes / "cylinder.msh")
    body = make_body("own", entry | {"kind": "file", "path": path, "scale_m": 0.2, "refinements": 1})
    assert [row[:2] for row in counts(body)] == [[182, 360], [722, 1440]]
    assert body.coarse.size == pytest.approx(0.2)
    check_nesting(body)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"poisson": 0.5}, r"poisson is 0\.5; give a number above -1 and below 0\.5"),
        ({"poisson": -1}, "poisson is -1"),
        ({"poisson": float("nan")}, "poisson is nan"),
        ({"young_pa": -3000}, "young_pa is -3000; give a positive number"),
        ({"young_pa": float("inf")}, "young_pa is inf"),
        ({"density_kg_m3": 0}, "density_kg_m3 is 0"),
        ({"kind": "sponge"}, "kind 'sponge' is unknown; give one of cylinder, liver, file, box, sheet"),
        ({"anchors": {"nodes": [266]}}, r"anchors\.nodes names 266"),
    ],
)
def test_bad_entries(entry, change, message):
    with pytest.raises(InputError, match=f"^body b: {message}"):
        make_body("b", entry | CYLINDER | change)
