"""Files as programs write them are read as they are meant, cut ones are refused, and units are guessed from sizes."""

import numpy as np
import pytest
import pyvista
from fixtures.mesh_encodings import SOLIDS, SURFACES, binary_stl, dataset, halves, lopsided, off, ply
from fixtures.organs import volume
from scipy.spatial import cKDTree

from palpate.bodies.mesh import TetMesh
from palpate.bodies.mesh_file import choose_scale, guess_scale, load_shape, load_tagged
from palpate.bodies.mesh_readers import read
from palpate.errors import InputError

CORNERS = np.array([[i & 1, i >> 1 & 1, i >> 2] for i in range(8)], dtype=float)
QUADS = np.array([[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]])
TRIANGLES = QUADS[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
V = "".join("v {:.6f} {:.6f} {:.6f}\n".format(*p) for p in CORNERS)
VN = "".join(f"vn {k} 0 0\n" for k in range(6))
VT = "".join(f"vt {k / 24} 0\n" for k in range(24))


def faces(pattern, elements=QUADS):
    """Write one line a face; i: the corner from 1, t: the texture place, k: the face."""
    return "".join(
        "f " + " ".join(pattern.format(i=c + 1, t=len(q) * k + j + 1, k=k + 1) for j, c in enumerate(q)) + "\n"
        for k, q in enumerate(elements)
    )


OBJ = {
    "blender": f"# Blender\nmtllib a.mtl\no Cube\n{V}{VN}{VT}s 0\nusemtl M\n" + faces("{i}/{t}/{k}"),
    "normals": V + VN + faces("{i}//{k}"),
    "textures": V + VT + faces("{i}/{t}"),
    "relative_between": "".join(
        "".join("v {} {} {}\n".format(*CORNERS[c]) for c in t) + "f -3 -2 -1\n" for t in TRIANGLES
    ),
    "continued": (V + faces("{i}")).replace(" 1", " \\\n1"),
    "groups": V + "g a b\nusemtl x\n" + faces("{i}", TRIANGLES[:6]) + "g c\ns 1\n" + faces("{i}", TRIANGLES[6:]),
    "colours": V.replace("\n", " 0.5 0.5 0.5\n") + faces("{i}"),
    "no_last_line_end": (V + faces("{i}")).rstrip(),
}


STL = binary_stl(CORNERS, TRIANGLES, "x")
CUBES = {f"{name}.obj": text.encode() for name, text in OBJ.items()} | {
    "longer.stl": STL + b"\0" * 20,
    "uncounted.stl": STL[:80] + bytes(4) + STL[84:],
    "little.ply": ply(CORNERS, QUADS, "", "<"),
    "big.ply": ply(CORNERS, QUADS, "", ">"),
    "text.ply": ply(CORNERS, QUADS, ""),
    "short.ply": ply(CORNERS, TRIANGLES, "", "<", index="ushort"),
    "a.off": off(CORNERS, QUADS, ""),
}


@pytest.mark.parametrize("name", CUBES)
def test_a_cube_as_exporters_write_it(tmp_path, name):
    (tmp_path / name).write_bytes(CUBES[name])
    raw = read(tmp_path / name)
    assert len(raw.sheets["triangle"]) == 12
    assert volume(raw.points, raw.sheets["triangle"]) == pytest.approx(1)


CUT = {
    "binary.stl": STL[:-120],
    "ascii.stl": SURFACES["ascii.stl"](CORNERS, TRIANGLES, "")[:-300],
    "little.ply": CUBES["little.ply"][:-40],
    "text.ply": CUBES["text.ply"][:-3],
    "line.obj": (V + faces("{i}"))[:-6].encode(),
    "a.off": CUBES["a.off"][:-12],
    "a.vtu": b"<VTKFile><UnstructuredGrid>",
    "binary.msh": SOLIDS["v4.1_binary_one.msh"](lopsided().nodes, lopsided().tetrahedra, "")[:-150],
    "points.vtk": b"# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\nPOINTS 3 float\n0 0 0 1 0 0 0 1 0\n",
}


@pytest.mark.parametrize("name", CUT)
def test_a_cut_file_is_said_to_be_cut(tmp_path, name):
    (tmp_path / name).write_bytes(CUT[name])
    with pytest.raises(InputError, match=f"{name}: it is cut off: "):
        read(tmp_path / name)


UNITS = {"millimetre": 1e-3, "centimetre": 1e-2, "metre": 1.0, "micrometre": 1e-6, "inch": 0.0254}
AXES = {"": 1.0, "LPS": 1.0, "RAS": np.array([-1.0, -1.0, 1.0])}
"""Coordinates in a frame over those in palpate's."""


def apart(points, others):
    """Greatest distance between two clouds of points, either way."""
    return max(cKDTree(points).query(others)[0].max(), cKDTree(others).query(points)[0].max())


@pytest.mark.filterwarnings("ignore:.*its header says SPACE=RAS")
@pytest.mark.parametrize("name", [*SURFACES, *(f"solid_{name}" for name in SOLIDS)])
def test_one_mesh_is_the_same_body_in_every_encoding_frame_and_unit(tmp_path, name):
    """Points, volume, elements in their order with their tags; units are drawn."""
    mesh, random = lopsided(), np.random.default_rng(len(name))
    solid = name.startswith("solid_")
    elements, writer = (mesh.tetrahedra, SOLIDS[name[6:]]) if solid else (mesh.triangles, SURFACES[name])
    for frame, axes in AXES.items():
        scale = UNITS[random.choice(list(UNITS))]
        path = tmp_path / f"{frame}_{name}"
        path.write_bytes(
            writer(mesh.nodes * axes / scale, elements, f"3D Slicer output. SPACE={frame}" if frame else "")
        )
        points, triangles, tetrahedra = load_shape(path)
        assert read(path).frame == (frame or None)
        assert apart(scale * points, mesh.nodes if solid else mesh.nodes[mesh.surface]) < 2e-6
        assert volume(scale * points, triangles) == pytest.approx(mesh.volumes.sum(), rel=1e-5)
        if not solid:
            assert len(triangles) == len(elements)
            continue
        middles = [each.nodes[each.tetrahedra].mean(axis=1) for each in (mesh, TetMesh(scale * points, tetrahedra))]
        assert np.abs(middles[0] - middles[1]).max() < 2e-6
        tags = halves(elements)
        if name.endswith(".msh") and "none" not in name:
            assert len(load_tagged(path, 7)) == len(elements)
            assert "two" not in name or np.array_equal(load_tagged(path, 8), np.flatnonzero(tags == 8))
        elif not name.endswith(".msh"):
            assert np.array_equal(load_tagged(path, 8), np.flatnonzero(tags == 8))


def test_ghost_cells_and_other_kinds_of_datasets_of_vtk(tmp_path):
    """A piece repeats cells of its neighbours, marked as ghosts."""
    mesh = lopsided()
    grid = dataset(mesh.nodes, np.vstack([mesh.tetrahedra, mesh.tetrahedra[:9]]))
    grid.cell_data["vtkGhostType"] = np.repeat([0, 1], [len(mesh.tetrahedra), 9]).astype(np.uint8)
    grid.save(tmp_path / "ghosts.vtu")
    assert len(load_shape(tmp_path / "ghosts.vtu")[2]) == len(mesh.tetrahedra)
    pyvista.ImageData(dimensions=(3, 3, 3)).save(tmp_path / "image.vtk")
    with pytest.raises(InputError, match=r"image\.vtk: it holds a dataset of kind ImageData; write it as"):
        read(tmp_path / "image.vtk")


@pytest.mark.parametrize(
    "name", ["little_double.ply", "big_double.ply", "more.ply", "plain.obj", "plain.off", "ascii.stl"]
)
def test_far_from_the_origin_points_keep_double_precision(tmp_path, name):
    mesh, far = lopsided(), np.array([1e8, -1e8, 1e8])
    (tmp_path / name).write_bytes(SURFACES[name](1e3 * mesh.nodes + far, mesh.triangles, ""))
    assert apart(load_shape(tmp_path / name)[0] - far, 1e3 * mesh.nodes[mesh.surface]) < 1e-6


@pytest.mark.parametrize("name", ["binary.stl", "little.ply"])
def test_single_precision_far_from_the_origin_is_refused(tmp_path, name):
    mesh = lopsided()
    (tmp_path / name).write_bytes(SURFACES[name](1e3 * mesh.nodes + 1e8, mesh.triangles, ""))
    with pytest.raises(InputError, match=r"its coordinates are of single precision, 8 units apart .* length of 20\d"):
        load_shape(tmp_path / name)


@pytest.mark.parametrize(
    ("head", "said"),
    [
        ("SPACE=scanner", "says SPACE=SCANNER; write LPS or RAS"),
        ("SPACE=RAS SPACE=LPS", "says SPACE=LPS and RAS; write"),
    ],
)
def test_a_frame_that_is_none_or_two_is_refused(tmp_path, head, said):
    (tmp_path / "a.obj").write_bytes(SURFACES["plain.obj"](lopsided().nodes, lopsided().triangles, head))
    with pytest.raises(InputError, match=said):
        read(tmp_path / "a.obj")


def box(size):
    return np.array([[0, 0, 0], [size, size / 2, size / 3]])


@pytest.mark.parametrize(
    ("size", "scale"), [(200, 1e-3), (35, 1e-3), (12, 1e-2), (0.2, 1.0), (2e5, 1e-6), (1.0, None), (5000, None)]
)
def test_the_unit_is_one_that_makes_an_organ(size, scale):
    guess = guess_scale(size)
    assert (guess[1] if guess else None) == scale


@pytest.mark.parametrize(
    ("size", "given", "message"),
    [
        (1, None, r"is 1 units, .*give scale_m, .* \(0\.2 makes it 20 cm long\)\.$"),
        (82, 1, r"scale_m 1 makes a body 82 m long; if its unit is the millimetre, give scale_m: 0\.001\.$"),
        (0.08, 1e-3, r"makes a body 0\.08 mm long; if its unit is the metre, give scale_m: 1\.$"),
        (1, 100, r"makes a body 100 m long; check scale_m\.$"),
    ],
)
def test_an_impossible_scale_is_refused_with_the_likely_one(size, given, message):
    with pytest.raises(InputError, match=message):
        choose_scale("a", box(size), given)


def test_a_guess_and_an_unlikely_scale_are_said(recwarn):
    assert choose_scale("a", box(1), 1.0) == 1.0 and not recwarn.list
    with pytest.warns(UserWarning, match=r"^a: scale_m is not given; .* for the millimetre, .* 82 mm long"):
        assert choose_scale("a", box(82), None) == 1e-3
    with pytest.warns(UserWarning, match="makes a body 2 m long, which no organ is"):
        choose_scale("a", box(1), 2.0)
