"""Organs as they are found on the web become bodies, or are refused in one sentence."""

import warnings

import meshio
import numpy as np
import pytest
from fixtures.organs import organ, torn, volume, write_ascii_stl, write_binary_ply, write_binary_stl, write_blender_obj

from palpate.bodies.box import box
from palpate.bodies.make_body import make_body
from palpate.bodies.mesh_file import inspect
from palpate.bodies.mesh_quality import quality
from palpate.bodies.surfaces.solid import distances, sample
from palpate.errors import InputError

ENTRY = {"kind": "file", "refinements": 2, "young_pa": 3000, "poisson": 0.3, "density_kg_m3": 1000}


def made(path, **changes):
    """Make the body in a file, without scale and anchors, and collect what was warned of."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        body = make_body("organ", ENTRY | {"path": str(path)} | changes)
    return body, [str(warning.message) for warning in said]


def check(body, points, triangles):
    """Check angles on every level, and on the fine one volume and distance of the surfaces, either way."""
    fine, size = body.fine, np.ptp(points, axis=0).max()
    assert min(quality(mesh)["min_dihedral_deg"] for mesh in body.levels) >= 10
    assert fine.volumes.sum() == pytest.approx(volume(points, triangles), rel=0.02)
    assert distances(sample(points, triangles, size / 100)[0], fine.nodes, fine.triangles).max() < 0.01 * size
    assert distances(sample(fine.nodes, fine.triangles, size / 100)[0], points, triangles).max() < 0.01 * size


def test_a_torn_organ_of_blender_in_millimetres(tmp_path):
    truth = organ("femur", 8000)
    points, triangles = torn(*truth)
    write_blender_obj(tmp_path / "femur.obj", 1000 * points, triangles)
    facts = inspect(tmp_path / "femur.obj")
    assert (facts.kind, facts.scale_m, facts.remeshed) == ("surface", 1e-3, True)
    body, said = made(tmp_path / "femur.obj")
    check(body, *truth)
    assert len(body.coarse.surface) == 140
    assert len(body.anchors[0]) >= 4
    text = "\n".join(said)
    assert "taken for the millimetre, which makes the body 20." in text
    assert "repeated or flat triangles removed" in text
    assert "triangles turned, 2 holes closed" in text
    assert f"surface of {facts.nodes} nodes is remeshed to 140; give surface_nodes" in text
    assert "anchors is not given" in text


def test_a_hollow_organ_keeps_its_hollow(tmp_path):
    truth = organ("hollow", 3000)
    write_binary_ply(tmp_path / "hollow.ply", *truth)
    body, _ = made(tmp_path / "hollow.ply", scale_m=1, surface_nodes=140, refinements=1)
    assert body.fine.volumes.sum() == pytest.approx(volume(*truth), rel=0.02)
    # nodes on the outer surface and on that of the hollow
    radius = np.linalg.norm(body.coarse.nodes[body.coarse.surface] / [0.1, 0.08, 0.07], axis=1)
    assert (radius > 0.9).sum() > 60
    assert (radius < 0.7).sum() >= 40


def test_without_snapping_every_level_has_the_files_volume(tmp_path):
    truth = organ("femur", 3000)
    write_ascii_stl(tmp_path / "femur.stl", *truth)
    body, said = made(tmp_path / "femur.stl", scale_m=1, surface_nodes=140, snap=False, refinements=1)
    for mesh in body.levels:
        assert mesh.volumes.sum() == pytest.approx(volume(*truth), rel=0.005)
    assert len(said) == 1  # anchors: what was asked for is no assumption


def test_a_shape_that_few_nodes_cannot_show_is_said(tmp_path):
    write_binary_stl(tmp_path / "lobed.stl", *organ("lobed", 3000))
    body, said = made(tmp_path / "lobed.stl", scale_m=1, surface_nodes=60, refinements=1)
    assert len(body.coarse.surface) == 60
    assert any("with 60 surface nodes, refined twice, the body's surface is up to" in text for text in said)


def test_numbers_of_the_files_nodes_mean_nothing_once_remeshed(tmp_path):
    write_binary_stl(tmp_path / "femur.stl", *organ("femur", 3000))
    with pytest.raises(InputError, match=r"nodes counts nodes of a mesh that is remeshed; hold nodes by plane"):
        made(tmp_path / "femur.stl", anchors={"nodes": [1, 2, 3]}, snap=False, surface_nodes=60)


def open_end(points, triangles):
    return points, triangles[points[triangles][:, :, 2].mean(axis=1) > -0.02]


def twice(points, triangles):
    return np.vstack([points, points + 0.3]), np.vstack([triangles, triangles + len(points)])


@pytest.mark.parametrize(
    ("fault", "scale_m", "message"),
    [
        (open_end, 1.0, r"its surface has a hole of \d+ edges, 79\.8 mm across, around \(.*\) m; close it"),
        (twice, 1.0, r"it has 2 separate pieces, the largest of 457 and 456 mL; give each body a file of its own"),
        (None, 400.0, r"scale_m 400 makes a body 80\.6 m long; if its unit is the metre, give scale_m: 1\."),
        (None, 1e-3, r"scale_m 0\.001 makes a body 0\.202 mm long; if its unit is the metre, give scale_m: 1\."),
    ],
)
def test_what_cannot_become_a_body_is_refused_in_one_sentence(tmp_path, fault, scale_m, message):
    mesh = organ("gallbladder" if fault else "femur", 1500)
    write_binary_stl(tmp_path / "organ.stl", *(fault(*mesh) if fault else mesh))
    with pytest.raises(InputError, match=message) as caught:
        made(tmp_path / "organ.stl", scale_m=scale_m)
    assert "\n" not in str(caught.value)


def test_a_unit_that_no_organ_has_is_asked_for(tmp_path):
    points, triangles = organ("femur", 1500)
    write_binary_stl(tmp_path / "organ.stl", points / 0.18, triangles)
    with pytest.raises(InputError, match=r"its longest side is 1\.12 units, .* give scale_m, .*makes it 20 cm long"):
        made(tmp_path / "organ.stl")


def test_tetrahedra_of_the_wild(shared_meshes):
    """SOFA's liver has elements of 6.2°, kept as they are and reported; it has so few nodes that no remeshing helps."""
    body, said = made(shared_meshes / "liver.msh", scale_m=0.03, anchors={"nodes": [3, 39, 64]}, refinements=0)
    assert len(body.coarse.tetrahedra) == 596
    (text,) = said
    assert "of 596 elements of level 0 have dihedral angles below 10°" in text
    assert text.endswith("; improve the mesh in the program that made it.")


@pytest.mark.parametrize("divisions", [3, 8])
def test_remeshing_bad_tetrahedra_is_advised_where_it_changes_them(tmp_path, divisions):
    """Flat boxes of 32 and of 162 surface nodes, one fewer and one more than it would be remeshed to."""
    mesh = box([0.2, 0.2, 0.02 / divisions], [divisions, divisions, 1])
    meshio.write_points_cells(tmp_path / "flat.vtk", mesh.nodes, [("tetra", mesh.tetrahedra)])
    plane = {"plane": {"axis": "x", "side": "min", "depth_m": 0.01}}
    body, (said,) = made(tmp_path / "flat.vtk", scale_m=1, anchors=plane, refinements=0)
    dense = divisions == 8
    assert len(body.coarse.surface) == 2 * (divisions + 1) ** 2
    assert said.endswith(
        "in the program that made it" + ", or give surface_nodes: 140 to have it remeshed" * dense + "."
    )
