"""``palpate init``: a first configuration that runs as it stands, and says what it assumes."""

import re
import warnings
from pathlib import Path

import meshio
import numpy as np
import pytest
import SimpleITK
from fixtures.mesh_encodings import SOLIDS, lopsided
from fixtures.organs import organ
from fixtures.scans import write_scan, write_series

from palpate.bodies.ct.synthetic_abdomen import abdomen
from palpate.bodies.make_body import make_body
from palpate.bodies.mesh import TetMesh
from palpate.bodies.organs import liver
from palpate.bodies.settings import Body
from palpate.bodies.simple_shapes import box
from palpate.bodies.supports import inner_nodes, read_bed
from palpate.bodies.surfaces.triangles import drop_unused
from palpate.cli import main
from palpate.effects.bed import BedSprings
from palpate.errors import InputError
from palpate.files import read_yaml
from palpate.init import choose
from palpate.init.choose import FINE_TETRAHEDRA, _bed
from palpate.init.command import init, init_each
from palpate.init.recognise import recognise, sides_of
from palpate.loading import load
from palpate.run.settings import complete


@pytest.fixture(scope="module")
def data(tmp_path_factory) -> Path:
    """A folder, with a space in its name, of an organ as STL in mm, tetrahedra in odd units, and a CT with a mask."""
    folder = tmp_path_factory.mktemp("my data")
    mesh = liver(0.2)
    meshio.write_points_cells(folder / "Übung 2.stl", 1e3 * mesh.nodes, [("triangle", mesh.triangles)], binary=True)
    bar = box([0.2, 0.05, 0.05], [8, 2, 2])
    meshio.write_points_cells(folder / "bar.vtk", bar.nodes / 0.2, [("tetra", bar.tetrahedra)])
    image, truth = abdomen(spacing_m=(0.008, 0.008, 0.008))
    mask = 5 * truth["liver"].astype(np.uint8)
    mask[:5, :5, :5] = 7
    write_scan(folder / "scan.nii.gz", image.hu, image)
    write_scan(folder / "organs.seg.nrrd", mask, image, {"Segment0_LabelValue": "5", "Segment0_Name": "liver"})
    return folder


def written(file: Path) -> tuple[str, Body, dict]:
    """Return the name and the settings of the only body of a configuration, and the whole, which the schema accepts."""
    given = read_yaml(file)
    config = complete(given, file)
    ((name, entry),) = config.bodies.items()
    return name, entry, given


@pytest.fixture(scope="module", params=["stl", "tetrahedra", pytest.param("mask", marks=pytest.mark.slow)])
def made(request, data) -> tuple[str, Path, str]:
    """Which data, the configuration that is written for them, and what is printed."""
    files = {"stl": ["Übung 2.stl"], "tetrahedra": ["bar.vtk"], "mask": ["scan.nii.gz", "organs.seg.nrrd"]}
    folder, label = data / f"config of {request.param}", ["liver"] if request.param == "mask" else []
    printed = init(recognise([data / name for name in files[request.param]], label), folder)
    return request.param, folder / "config.yaml", printed


def test_what_is_written_passes_the_schema_and_makes_the_body(made):
    what, file, printed = made
    name, entry, _ = written(file)
    assert name == {"stl": "ubung_2", "tetrahedra": "bar", "mask": "liver"}[what]
    paths = entry.paths(file.parent)
    assert paths and all(getattr(entry, key)[:3] == "../" and Path(path).is_file() for key, path in paths.items())
    body = make_body(name, entry.seen_from(file.parent))
    assert not len(body.anchors[0]) and body.bed is not None
    assert 0.1 < len(inner_nodes(body.coarse, body.bed)) / len(body.coarse.surface) < 0.6
    if what == "mask":  # a body that is made anew has the shape of its data
        assert re.search(r"found +the organ of the data has \d+.* mL, .* surfaces are up to", printed)
    # from a folder near by the path is relative; quotes, as it has a space
    typed = re.search(r"make CONFIG='(.*)'$", printed.splitlines()[-1])
    assert typed and Path(typed[1]).resolve() == Path(file).resolve()
    assert body.coarse.size == pytest.approx(0.2, rel=0.2)
    assert len(body.fine.tetrahedra) <= FINE_TETRAHEDRA
    assert (file.parent / "body.png").stat().st_size > 10_000


def test_it_is_pressed_by_a_fingertip_and_by_a_hand_and_has_contacts_to_judge_by(made):
    what, file, _ = made
    _, entry, given = written(file)
    size = make_body("", entry.seen_from(file.parent)).coarse.size
    small, deep, large = given["regimes"].values()
    assert list(given["regimes"]) == ["small", "deep", "large"]
    assert small["radius_m"] == deep["radius_m"] == 0.012
    assert large["radius_m"] == pytest.approx(0.025 if what == "tetrahedra" else 0.15 * size, rel=0.1)
    assert deep["pressure_of_young"] == 0.25 and "peak_of_size" not in deep
    assert small["peak_of_size"] == pytest.approx(0.3 * large["peak_of_size"], rel=0.1)
    assert large["peak_of_size"] <= 0.1
    assert given["tradeoff"]["contacts"] == 24
    assert given["tradeoff"]["presses"][1] == {"magnitude": 0.8, "tilt_degrees": 45}
    assert entry.magnitudes is entry.train is entry.test is None
    # a bar lies on its broad side, and an organ of a CT on the patient's back
    assert what != "tetrahedra" or entry.bed.facing[0] == 0
    assert what != "mask" or entry.bed.facing == [0, 1, 0]


def test_a_loaded_body_lies_in_tissue_as_stiff_as_itself_and_its_constants_are_checked(tmp_path):
    mesh = box([0.2, 0.2, 0.1], [4, 4, 2])
    meshio.write_points_cells(tmp_path / "slab.vtk", mesh.nodes, [("tetra", mesh.tetrahedra)])
    soft, stiff = (load(tmp_path / "slab.vtk", scale_m=1.0, young_pa=young) for young in (3000.0, 6000.0))
    assert stiff.material.young_pa == 6000.0
    assert stiff.bed.stiffness_n_m3 == pytest.approx(2 * soft.bed.stiffness_n_m3, rel=1e-12)
    with pytest.raises(InputError, match="young_pa"):
        load(tmp_path / "slab.vtk", scale_m=1.0, young_pa=-1.0)
    with pytest.warns(UserWarning, match=r"; scale_m=2 makes it twice as long$"):
        load(tmp_path / "slab.vtk")


def test_a_mesh_of_too_few_nodes_and_a_folder_that_cannot_be_written_are_refused(data, tmp_path):
    bar = box([0.2, 0.2, 0.2], [1, 1, 1])
    meshio.write_points_cells(tmp_path / "cube.vtk", bar.nodes, [("tetra", bar.tetrahedra)])
    with pytest.raises(InputError, match="has 8 nodes, of which it lies on 4 and 4 can be pressed"):
        init(recognise([tmp_path / "cube.vtk"]))
    tetrahedron = [[0, 0, 0], [60, 0, 0], [0, 60, 0], [0, 0, 60]]
    corners = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]
    meshio.write_points_cells(tmp_path / "tet.stl", np.array(tetrahedron, float), [("triangle", np.array(corners))])
    with pytest.raises(InputError, match=r"tet\.stl: its surface has 4 nodes, .*; give a mesh with more triangles"):
        init(recognise([tmp_path / "tet.stl"]))
    with pytest.raises(InputError, match=r"config\.yaml cannot be written \(File exists\); give another folder with"):
        init(recognise([data / "bar.vtk"]), tmp_path / "cube.vtk")


@pytest.mark.parametrize(
    ("position", "side", "axis"),
    [
        ("HFS", "back", ("y", "max")),
        ("HFDR", "right", ("x", "min")),
        ("FFP", "front", ("y", "min")),
        ("FFDL", "left", ("x", "max")),
        ("SITTING", "", ("y", "max")),
    ],
)
def test_the_patient_lies_on_the_side_that_dicom_says(data, tmp_path, position, side, axis):
    scan = SimpleITK.ReadImage(str(data / "scan.nii.gz"))
    found = recognise([write_series(tmp_path / "series", scan, position=position)])
    assert sides_of("ct", found.lies or None) == [axis]
    assert any(f"the patient lay on the {side} ({position})" in line for line in found.found) == bool(side)
    assert any("the patient lay on the back, as the header" in line for line in found.assumed) == (not side)


@pytest.mark.slow
def test_each_label_becomes_a_body_of_its_own_and_one_that_makes_none_does_not_stop_the_others(capsys, data, tmp_path):
    files = [data / name for name in ("scan.nii.gz", "organs.seg.nrrd")]
    (tmp_path / "label_7").mkdir()
    (tmp_path / "label_7/config.yaml").write_text("mine")
    assert main(["init", *map(str, files), "--each", "-o", str(tmp_path)]) == 1
    printed = capsys.readouterr()
    assert f"left out 7: {tmp_path}/label_7/config.yaml exists and is kept" in printed.out
    assert printed.err.count("\n") == 1 and "1 labels are left out, as said above; the others are done." in printed.err
    name, entry, _ = written(tmp_path / "liver/config.yaml")
    assert (name, entry.label) == ("liver", "liver") and printed.out.count("found    a body") == 1
    with pytest.raises(InputError, match=r"organs\.seg\.nrrd: the mask has no label spleen; it has liver, 7\."):
        init_each(files, ["spleen"], folder=tmp_path)
    with pytest.raises(InputError, match=r"scan\.nii\.gz: bodies or regions by label need a mask; give the mask after"):
        init_each(files[:1])


def test_a_body_lies_on_its_broadest_side_in_tissue_as_stiff_as_itself():
    """Displaced as a whole, a square foot pushes back by ∫ k, a share of E / thickness; the top has no springs."""
    mesh = box([0.1, 0.2, 0.2], [2, 4, 4])
    found = _bed("block", mesh, [(axis, side) for axis in "xyz" for side in ("min", "max")], "")
    assert found.facing == [-1, 0, 0]
    assert found.stiffness_n_m3 == pytest.approx(3000 / (0.05 * 0.2))
    bed = read_bed("block", found, mesh)
    assert (mesh.nodes[inner_nodes(mesh, bed), 0] == 0.0).all() and len(inner_nodes(mesh, bed)) == 25
    matrix = BedSprings(mesh, bed).matrix
    whole = np.tile([1e-3, 0.0, 0.0], len(mesh.nodes))
    pressure = (matrix @ whole).reshape(-1, 3)[:, 0].sum() / 0.2**2
    assert 0.2 < pressure / (1e-3 * found.stiffness_n_m3) < 0.6


@pytest.mark.parametrize("open_below", [False, True])
def test_a_hollow_body_lies_on_its_outside_and_springs_under_an_arch_are_doubted(open_below):
    whole = box([0.2, 0.1, 0.1], [8, 4, 4])
    x, y, z = whole.nodes[whole.tetrahedra].mean(axis=1).T
    out = (np.abs(x - 0.1) < 0.05) & (
        (z < 0.05) if open_below else (np.abs(y - 0.05) < 0.025) & (np.abs(z - 0.05) < 0.025)
    )
    mesh = TetMesh(*drop_unused(whole.nodes, whole.tetrahedra[~out]))
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        found = _bed("block", mesh, [("z", "min")], "")
    heights = mesh.nodes[inner_nodes(mesh, read_bed("block", found, mesh)), 2]
    if open_below:
        assert "32 of 64 triangles up to 50 mm above the rest, as under an arch; if nothing" in str(said[0].message)
    else:
        assert not said and len(heights) == 45 and (heights == 0.0).all()


@pytest.mark.slow
def test_a_body_that_is_not_the_organ_is_refused_and_nothing_is_written(capsys, monkeypatch, tmp_path):
    monkeypatch.setattr(choose, "SURFACE_NODES", (140,))
    points, triangles = organ("kidney", 2000)
    flat = 1000 * points * [1, 1, 0.1]
    meshio.write_points_cells(tmp_path / "flat.stl", flat, [("triangle", triangles)], binary=True)
    assert main(["init", str(tmp_path / "flat.stl"), "--scale", "0.001"]) == 1
    printed = capsys.readouterr()
    assert "so that it is not the organ; cut off or thicken" in printed.err and printed.err.count("\n") == 1
    assert not (tmp_path / "flat").exists()


def test_it_is_written_beside_the_data_and_never_over_another(capsys, data):
    assert main(["init", str(data / "bar.vtk")]) == 0
    file = data / "bar/config.yaml"
    assert str(file) in capsys.readouterr().out
    file.write_text("mine")
    assert main(["init", str(data / "bar.vtk")]) == 1
    said = f"error: {file} exists and is kept; delete it, or give another folder with --folder.\n"
    assert capsys.readouterr().err == said and file.read_text() == "mine"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["none.stl"], "none.stl: there is no such file or folder"),
        (["bar.vtk", "organs.seg.nrrd"], "bar.vtk: a mesh takes no mask"),
        (["scan.nii.gz", "--label", "5"], "scan.nii.gz: a label needs a mask"),
        (["scan.nii.gz", "--scale", "0.001"], "scan.nii.gz: an image knows its own unit"),
        (["scan.nii.gz", "organs.seg.nrrd"], "the mask has 2 labels: 5 liver (1070 mL), 7 (64 mL)"),
        (["scan.nii.gz", "organs.seg.nrrd", "--label", "livre"], "no voxel of label livre (did you mean liver?)"),
        (["scan.nii.gz", "organs.seg.nrrd", "--threshold", "1", "2"], "with a mask the threshold is not used"),
        (["scan.nii.gz", "--threshold", "2000", "3000"], "no voxel lies between 2000 and 3000 HU"),
        (["scan.nii.gz", "--threshold", "120", "30"], "--threshold is 120 30; give the lower number first."),
        (["scan.nii.gz", "--threshold", "low"], "expected 2 arguments; see palpate init --help."),
    ],
)
def test_what_cannot_be_used_gets_one_sentence_and_nothing_is_written(capsys, data, tmp_path, words, said):
    paths = [str(data / word) if "." in word and word != "0.001" else word for word in words]
    assert main(["init", *paths, "--folder", str(tmp_path / "new")]) == 1
    printed = capsys.readouterr().err
    assert printed.startswith("error: ") and printed.count("\n") == 1 and said in printed
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize(("frame", "hold", "facing"), [
    ("LPS", None, [0, 1, 0]), ("RAS", "left", [1, 0, 0]), ("", None, [0, 0, -1]), ("", "left", [-1, 0, 0]),
])  # fmt: skip
@pytest.mark.filterwarnings("ignore:.*its header says SPACE=RAS")
def test_a_mesh_with_a_frame_is_a_patient_who_lies_on_the_back(frame, hold, facing, tmp_path):
    """Without one it lies on its broadest side, and left is that of whoever looks at its front."""
    mesh, axes = lopsided(), [-1, -1, 1] if frame == "RAS" else [1, 1, 1]
    head = f"3D Slicer output. SPACE={frame}" if frame else ""
    (tmp_path / "organ.vtk").write_bytes(SOLIDS["v42_ascii_title.vtk"](1e3 * mesh.nodes * axes, mesh.tetrahedra, head))
    found = recognise([tmp_path / "organ.vtk"])
    assert choose.choose("organ", found.entry, hold).entry.bed.facing == facing
    said = {
        "LPS": "LPS from its header, so that its sides are the patient's",
        "RAS": "RAS from its header, turned to LPS, so that its sides are the patient's",
        "": "no frame in its header, so that z points up, y to the back and x to the right",
    }[frame]
    inside = f"{1e6 * mesh.volumes.sum():.4g} mL, as its tetrahedra"
    assert found.found[1] == f"{tmp_path}/organ.vtk: {said}; a unit of 1 mm, guessed from the size; 1 piece; {inside}"
