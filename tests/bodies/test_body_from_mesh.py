"""Bodies from mesh files: tetrahedra, closed surfaces, and organs as they are found on the web."""

import warnings

import meshio
import numpy as np
import pytest
from fixtures.mesh_encodings import SURFACES, gmsh
from fixtures.organs import organ, torn, volume

from palpate.bodies.make_body import build, make_body, taken
from palpate.bodies.mesh_file import load_shape
from palpate.bodies.mesh_quality import quality
from palpate.bodies.settings import File
from palpate.bodies.surfaces.solid import sample
from palpate.bodies.surfaces.triangles import distances, weld
from palpate.errors import InputError

# a cube without its faces towards +z, which leave an open square
OPEN = [[0, 2, 3], [0, 3, 1], [0, 1, 5], [0, 5, 4], [2, 6, 7], [2, 7, 3], [0, 4, 6], [0, 6, 2], [1, 3, 7], [1, 7, 5]]


FLAT_SQUARE = b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\nf 1 3 2\nf 1 4 3\n"


ENTRY = File(path="", refinements=2, young_pa=3000, poisson=0.3)


def load_file(path, scale_m):
    return build(ENTRY.but(path=str(path), scale_m=scale_m))[0]


def test_the_first_version_of_gmsh_files_is_read(cube, tmp_path):
    (tmp_path / "cube.msh").write_bytes(gmsh(cube.nodes, cube.tetrahedra, "", version=1))
    found = load_file(tmp_path / "cube.msh", 0.5)
    assert np.array_equal(found.nodes, 0.5 * cube.nodes) and np.array_equal(found.tetrahedra, cube.tetrahedra)


@pytest.mark.parametrize("name", ["cube.vtk", "cube.vtu", "cube.mesh"])
def test_other_elements_and_loose_nodes_are_left_out(cube, tmp_path, name):
    points = np.vstack([[5, 5, 5], cube.nodes])
    cells = [("triangle", cube.triangles[:1] + 1), ("tetra", cube.tetrahedra[:2] + 1), ("line", [[1, 2]])]
    cells.append(("tetra", cube.tetrahedra[2:] + 1))
    meshio.write(tmp_path / name, meshio.Mesh(points, cells))
    found = load_file(tmp_path / name, 1.0)
    assert np.array_equal(found.nodes, cube.nodes)
    assert np.array_equal(found.tetrahedra, cube.tetrahedra)


def test_surface_is_filled_and_kept(octahedron, tmp_path):
    points, triangles = octahedron
    meshio.write(tmp_path / "a.stl", meshio.Mesh(points, [("triangle", triangles)]), binary=True)
    found = load_file(tmp_path / "a.stl", 0.5)
    corners = {tuple(p) for p in found.nodes[found.surface].tolist()}
    assert corners == {tuple(p) for p in (0.5 * points).tolist()}
    assert (len(found.surface), len(found.triangles)) == (6, 8)
    assert "1 piece; 1.667e+05 mL" in taken(ENTRY.but(path=str(tmp_path / "a.stl"), scale_m=0.5))[0]
    meshio.write(tmp_path / "open.stl", meshio.Mesh(points, [("triangle", triangles[1:])]), binary=True)
    assert "no volume of its own, as it has 1 hole" in taken(ENTRY.but(path=str(tmp_path / "open.stl"), scale_m=0.5))[0]
    assert found.volumes.sum() == pytest.approx(4 / 3 / 8)


def test_weld_joins_close_points_and_drops_what_closes_up():
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 1e-9, 0], [9, 9, 0]])
    welded, triangles = weld(points, np.array([[0, 1, 2], [0, 3, 1], [3, 1, 2]]))
    assert np.array_equal(welded, points[:3])
    assert triangles.tolist() == [[0, 1, 2], [0, 1, 2]]


@pytest.mark.parametrize(
    ("name", "elements", "message"),
    [
        ("mixed.vtu", [("tetra", [[0, 1, 3, 7]]), ("wedge", [[0, 1, 2, 4, 5, 6]])], "it has wedge elements; convert"),
        ("line.vtu", [("line", [[0, 1]])], "it has neither tetrahedra nor triangles"),
        ("open.stl", [("triangle", OPEN)], r"its surface has a hole of 4 edges, 1 m across, around"),
        ("inf.vtk", [("tetra", [[0, 1, 3, 7]])], "1 of 8 nodes have NaN, infinite .*first: node 2"),
        ("gone.msh", None, "this mesh file does not exist"),
        ("a.step", None, "its name does not show a mesh format"),
    ],
)
def test_what_holds_no_body_is_refused(cube, tmp_path, name, elements, message):
    if name == "inf.vtk":
        cube.nodes[2, 0] = np.inf
    if elements:
        meshio.write(tmp_path / name, meshio.Mesh(cube.nodes, elements))
    with pytest.raises(InputError, match=rf"{name}: {message}"):
        load_file(tmp_path / name, 1.0)


@pytest.mark.parametrize("name", ["a.msh", "a.vtk", "a.vtu", "a.mesh", "a.stl", "a.obj", "a.ply"])
def test_malformed(tmp_path, capsys, name):
    (tmp_path / name).write_text("no mesh at all\n")
    with pytest.raises(InputError, match=r"a\.\w+: (malformed|it has neither|it holds|it is cut off).*\.$") as caught:
        load_file(tmp_path / name, 1.0)
    assert "\n" not in str(caught.value)
    assert capsys.readouterr().out == ""


def test_a_gmsh_script_is_not_run(tmp_path):
    (tmp_path / "a.msh").write_text(f'SystemCall "touch {tmp_path}/ran";\n')
    with pytest.raises(InputError, match="does not start like a gmsh mesh"):
        load_file(tmp_path / "a.msh", 1.0)
    assert not (tmp_path / "ran").exists()


def made(path, **changes):
    """Make the body in a file, without scale and anchors, and collect what was warned of."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        body = make_body("organ", ENTRY.but(path=str(path), **changes))
    return body, [str(warning.message) for warning in said]


def check(body, points, triangles):
    """Check angles on every level, and on the fine one volume and distance of the surfaces, either way."""
    fine, size = body.fine, np.ptp(points, axis=0).max()
    assert min(quality(mesh)["min_dihedral_deg"] for mesh in body.levels) >= 10
    assert fine.volumes.sum() == pytest.approx(volume(points, triangles), rel=0.02)
    assert distances(sample(points, triangles, size / 100)[0], fine.nodes, fine.triangles).max() < 0.01 * size
    assert distances(sample(fine.nodes, fine.triangles, size / 100)[0], points, triangles).max() < 0.01 * size


@pytest.mark.slow
def test_a_hollow_organ_keeps_its_hollow(tmp_path):
    truth = organ("hollow", 3000)
    (tmp_path / "hollow.ply").write_bytes(SURFACES["little.ply"](*truth, ""))
    body, _ = made(tmp_path / "hollow.ply", scale_m=1, surface_nodes=140, refinements=1)
    assert body.fine.volumes.sum() == pytest.approx(volume(*truth), rel=0.02)
    # nodes on the outer surface and on that of the hollow
    radius = np.linalg.norm(body.coarse.nodes[body.coarse.surface] / [0.1, 0.08, 0.07], axis=1)
    assert (radius > 0.9).sum() > 60
    assert (radius < 0.7).sum() >= 40


@pytest.mark.slow
def test_a_torn_organ_in_millimetres(tmp_path):
    truth = organ("femur", 8000)
    points, triangles = torn(*truth)
    (tmp_path / "femur.obj").write_bytes(SURFACES["plain.obj"](1000 * points, triangles, ""))
    nodes = len(load_shape(tmp_path / "femur.obj")[0])
    body, said = made(tmp_path / "femur.obj")
    check(body, *truth)
    assert len(body.coarse.surface) == 280
    assert len(body.anchors[0]) >= 4
    text = "\n".join(said)
    assert "taken for the millimetre, which makes the body 20." in text
    assert "repeated or flat triangles removed" in text
    assert "triangles turned, 2 holes closed" in text
    assert f"surface of {nodes} nodes is remeshed to 280; give surface_nodes" in text
    assert "anchors is not given" in text


def test_without_snapping_every_level_has_the_files_volume(tmp_path):
    truth = organ("femur", 3000)
    (tmp_path / "femur.stl").write_bytes(SURFACES["ascii.stl"](*truth, ""))
    body, said = made(tmp_path / "femur.stl", scale_m=1, surface_nodes=140, snap=False, refinements=1)
    for mesh in body.levels:
        assert mesh.volumes.sum() == pytest.approx(volume(*truth), rel=0.005)
    assert len(said) == 1  # anchors: what was asked for is no assumption


def test_numbers_of_the_files_nodes_mean_nothing_once_remeshed(tmp_path):
    (tmp_path / "femur.stl").write_bytes(SURFACES["solid.stl"](*organ("femur", 3000), ""))
    with pytest.raises(InputError, match=r"nodes counts nodes of a mesh that is remeshed; hold nodes by plane"):
        made(tmp_path / "femur.stl", anchors={"nodes": [1, 2, 3]}, snap=False, surface_nodes=60)


def open_end(points, triangles):
    return points, triangles[points[triangles][:, :, 2].mean(axis=1) > -0.02]


def twice(points, triangles):
    return np.vstack([points, points + 0.3]), np.vstack([triangles, triangles + len(points)])


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        (open_end, r"its surface has a hole of \d+ edges, 79\.8 mm across, around \(.*\) m; close it"),
        (twice, r"it has 2 separate pieces, the largest of 458 and 457 mL; give each body a file of its own"),
    ],
)
def test_what_cannot_become_a_body_is_refused_in_one_sentence(tmp_path, fault, message):
    (tmp_path / "organ.stl").write_bytes(SURFACES["solid.stl"](*fault(*organ("gallbladder", 1500)), ""))
    with pytest.raises(InputError, match=message) as caught:
        made(tmp_path / "organ.stl", scale_m=1.0)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "data", "said"),
    [
        ("png.obj", b"\x89PNG\r\n\x1a\n" + bytes(99), "it holds a PNG picture and no mesh"),
        ("page.vtk", b"<!doctype html><html></html>", "it holds a web page and no mesh"),
        ("short.stl", b"hello\n", "it holds a text that does not begin with solid"),
        ("lfs.stl", b"version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\n", "it holds a pointer of Git LFS"),
        ("stl.obj", b"solid a".ljust(80) + bytes([1, 0, 0, 0]) + bytes(50), "it holds what a .stl file holds; give it"),
        ("ply.off", b"ply\nformat ascii 1.0\n", "it holds what a .ply file holds; give it"),
        ("flat.obj", FLAT_SQUARE, "all of its points lie in one plane, so it encloses no body"),
    ],
)
def test_what_is_no_mesh_of_a_body_is_called_what_it_is(tmp_path, name, data, said):
    (tmp_path / name).write_bytes(data)
    with pytest.raises(InputError, match=f"{name}: {said}"):
        load_shape(tmp_path / name)
