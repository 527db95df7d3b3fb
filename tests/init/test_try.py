"""``palpate try``: what ``palpate init`` writes, and small settings of it that are run at once."""

import re
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace

import meshio
import pytest

from palpate.benchmark.advice import advise
from palpate.benchmark.ranking import read_errors
from palpate.bodies.settings import Ct, File
from palpate.bodies.simple_shapes import box
from palpate.bodies.supports import inner_nodes, read_bed
from palpate.cli import main
from palpate.errors import InputError
from palpate.files import read_yaml
from palpate.init import try_command
from palpate.init.choose import _bed, _too_few_nodes
from palpate.init.recognise import HOLDS, sides_of
from palpate.init.try_command import MODELS, is_unchanged
from palpate.report.tables import read
from palpate.run.settings import complete

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def data(tmp_path_factory) -> Path:
    """A folder of a block of 3 × 2 × 1 decimetres, in decimetres."""
    folder = tmp_path_factory.mktemp("data")
    block = box([3.0, 2.0, 1.0], [6, 4, 2])
    meshio.write_points_cells(folder / "block.vtk", block.nodes, [("tetra", block.tetrahedra)])
    return folder


def write_tables(made: Path, folder: Path, **changed) -> None:
    """Leave the tables of one scene of the made-up trade-off behind, as a run in ``folder`` does."""
    table = read(made / "tables/accuracy_vs_time.csv")
    table = table[table["scene"] == "own_large"].assign(**changed)
    rows = advise(table, read_errors(made / "data", table), [16.7], [0.1])
    (folder / "results/tables").mkdir(parents=True, exist_ok=True)
    rows.to_csv(folder / "results/tables/advice.csv", index=False)
    table.to_csv(folder / "results/tables/accuracy_vs_time.csv", index=False)


@pytest.fixture
def ran(monkeypatch, trade_off_folder) -> list[Path]:
    """The files of settings that were run, each of which leaves the tables of the made-up trade-off behind."""
    found = []

    def run(file: Path, again: str) -> None:
        found.append(file)
        write_tables(trade_off_folder, file.parent)

    monkeypatch.setattr(try_command, "run_settings", run)
    return found


def test_try_writes_a_whole_configuration_and_runs_a_small_one_of_the_same_body(capsys, data, tmp_path, ran):
    folder = tmp_path / "organ"
    assert main(["try", str(data / "block.vtk"), "--scale", "0.1", "--hold", "left", "-o", str(folder)]) == 0
    printed = capsys.readouterr().out
    whole, small = (complete(read_yaml(folder / name), folder / name) for name in ("config.yaml", "try.yaml"))
    assert ran == [folder / "try.yaml"]
    body = whole.bodies["block"]
    assert (body.scale_m, body.bed.facing) == (0.1, [-1, 0, 0]) and body.anchors is None
    assert small.bodies["block"] == body.but(refinements=1) and body.refinements == 2
    assert list(whole.regimes) == ["small", "deep", "large"]
    assert small.regimes == {"large": whole.regimes["large"]}
    assert small.tradeoff.models == MODELS and small.tradeoff.contacts < whole.tradeoff.contacts
    assert "given    it lies where its x is smallest" in printed and "a unit of the file" not in printed
    assert "unit [m], given; the longest side is 30 cm" in (folder / "config.yaml").read_text(encoding="utf-8")
    assert "within 16.7 ms" in printed and f"The report: {folder}/results/report.html" in printed
    assert re.search(r"make CONFIG=\S*organ/config\.yaml\n", printed)
    assert printed.rstrip().endswith(f"palpate press --config {folder}/config.yaml")


@pytest.mark.slow
def test_try_goes_on_in_its_own_folder_and_leaves_any_other_alone(capsys, data, tmp_path, ran):
    words = ["try", str(data / "block.vtk"), "--scale", "0.1", "-o"]
    own, empty, other = tmp_path / "own", tmp_path / "empty", tmp_path / "other"
    empty.mkdir()
    other.mkdir()
    (other / "thesis.txt").write_text("mine")
    assert main([*words, str(own)]) == main([*words, str(empty)]) == main([*words, str(own)]) == 0
    assert is_unchanged(own) and len(ran) == 3
    capsys.readouterr()
    assert main([*words, str(other)]) == 1
    said = f"error: {other} exists and is kept; delete it, or give another folder with --folder.\n"
    assert capsys.readouterr().err == said
    assert [path.name for path in other.iterdir()] == ["thesis.txt"]
    for name in ("config.yaml", "try.yaml"):
        text = (own / name).read_text(encoding="utf-8")
        (own / name).write_text(text.replace("young_pa: 3000", "young_pa: 5000"), encoding="utf-8")
        assert main([*words, str(own)]) == 1 and "young_pa: 5000" in (own / name).read_text(encoding="utf-8")
        said = rf"error: {own}/config\.yaml or try\.yaml was changed and is kept; run it with .*make CONFIG=\S+\.\n"
        assert re.fullmatch(said, capsys.readouterr().err)
        (own / name).write_text(text, encoding="utf-8")
    assert len(ran) == 3


@pytest.mark.slow
def test_try_goes_on_where_it_was_killed_and_never_over_results_of_all_settings(capsys, data, tmp_path, ran):
    words = ["try", str(data / "block.vtk"), "--scale", "0.1", "-o", str(tmp_path / "own")]
    (tmp_path / "own").mkdir()
    for name in ("body.png", ".config.part123.yaml"):  # what it writes before its settings
        (tmp_path / "own" / name).write_text("")
    assert main(words) == 0 and len(ran) == 1
    for regime in ("small", "large"):
        folder = tmp_path / "own/results/data/block" / regime
        folder.mkdir(parents=True)
        (folder / "database.h5").write_text("")
    capsys.readouterr()
    assert main(words) == 1 and len(ran) == 1
    assert "holds results of all its config.yaml, and is kept" in capsys.readouterr().err


@pytest.mark.parametrize("code", [0, 3])
def test_a_run_that_fails_is_said_to_have_and_how_to_go_on(monkeypatch, tmp_path, code):
    asked = []

    def run(command, **_):
        asked.append(command)
        return SimpleNamespace(returncode=code)

    monkeypatch.setattr(try_command.subprocess, "run", run)
    failed = pytest.raises(InputError, match=r"try\.yaml did not finish; what it has is kept, and")
    with failed if code else nullcontext():
        try_command.run_settings(tmp_path / "try.yaml", "palpate try a.stl")
    assert asked[0][-4:] == ["--directory", str(tmp_path), "--configfile", str(tmp_path / "try.yaml")]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["block.vtk", "--hold", "under"], r"^error: --hold under is no side; choose from below, above, left, right, "),
        (["block.vtk", "--scale", "-1"], r"argument --scale: -1 is not a number above 0"),
        (["block.vtk", "--scale", "0.0001"], r"scale_m 0\.0001 makes a body 0\.3 mm long"),
    ],
)
def test_what_cannot_be_tried_gets_one_sentence_and_nothing_is_written(capsys, data, tmp_path, ran, words, said):
    paths = [str(data / word) if word.endswith("vtk") else word for word in words]
    assert main(["try", *paths, "-o", str(tmp_path / "new")]) == 1
    printed = capsys.readouterr().err
    assert re.search(said, printed) and printed.count("\n") == 1
    assert not (tmp_path / "new").exists() and ran == []


def test_a_block_can_lie_on_each_of_its_sides_and_the_left_of_a_patient_is_the_patients_own():
    """In a CT x points to the patient's left, y to the back and z to the head."""
    assert sides_of("ct", "left") == [("x", "max")] and sides_of("ct", "right") == [("x", "min")]
    assert sides_of("ct", "back") == sides_of("ct", None) == [("y", "max")]
    assert sides_of("ct", "x-min") == [("x", "min")] and len(sides_of("file", None)) == 6
    block = box([0.3, 0.2, 0.1], [6, 4, 2])
    found = {}
    for word in HOLDS:
        bed = read_bed("block", _bed("block", block, sides_of("file", word), ""), block)
        nodes = block.nodes[inner_nodes(block, bed)]
        found[word] = nodes.mean(axis=0) - block.nodes.mean(axis=0)
    for axis, low, high in (("x", "left", "right"), ("y", "front", "back"), ("z", "below", "above")):
        assert found[low]["xyz".index(axis)] < 0 < found[high]["xyz".index(axis)]
        assert found[low].tolist() == found[f"{axis}-min"].tolist()
        assert found[high].tolist() == found[f"{axis}-max"].tolist()

    rod, tissue = box([0.3, 0.002, 0.002], [30, 1, 1]), {"young_pa": 3000, "poisson": 0.3}
    mesh = File(path="rod.vtu", **tissue)
    with pytest.raises(InputError, match=r"^rod: its side left has too few nodes to lie on; give another"):
        _bed("rod", rod, sides_of("file", "left"), _too_few_nodes(mesh, "file", "left"))

    # who names no side is not told to name another
    scan = Ct(threshold_hu=[30, 120], **tissue)
    assert "if the largest piece between 30 and 120 is not the organ" in _too_few_nodes(scan, "ct", None)
    assert "mask" not in _too_few_nodes(scan.but(mask="organs.nii.gz"), "ct", None)
    assert _too_few_nodes(mesh, "file", None).endswith("enough nodes to lie on; give a mesh with more triangles")


def init_of_bar(longest: float, folder: Path) -> int:
    """Write the configuration of a bar into folder/new, and return the exit code."""
    bar = box([longest, longest / 4, longest / 4], [8, 2, 2])
    meshio.write_points_cells(folder / "bar.vtk", bar.nodes, [("tetra", bar.tetrahedra)])
    return main(["init", str(folder / "bar.vtk"), "-o", str(folder / "new")])


@pytest.mark.parametrize("size", [2e-7, 1e7])
def test_a_size_that_no_unit_explains_asks_for_the_scale(capsys, tmp_path, size):
    assert init_of_bar(size, tmp_path) == 1
    assert "an organ's in no unit from micrometres to metres; give --scale" in capsys.readouterr().err
    assert not (tmp_path / "new").exists()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("longest", "unit", "length", "twice", "others"),
    [
        (190.0, 0.001, "19 cm", 0.002, None),
        (0.25, 1.0, "25 cm", 2.0, None),
        (6.481, 0.01, "64.8 mm", 0.02, "the inch, which makes it 16.5 cm long (--scale 0.0254), or one of its own"),
        (22.0, 0.001, "22 mm", 0.002, "22 cm long (--scale 0.01), or the inch, which makes it 55.9 cm long"),
        (1.2, 0.167, "20 cm", 0.334, "the inch, which makes it 30.5 mm long"),
        (0.01, 20.0, "20 cm", 40.0, "its unit may be one of its own"),
    ],
)
def test_a_guessed_unit_is_said_with_the_size_it_makes_and_doubted_where_others_make_an_organ_too(
    capsys, tmp_path, longest, unit, length, twice, others
):
    """SOFA's liver is 6.481 of its own units long, and no one could tell."""
    assert init_of_bar(longest, tmp_path) == 0
    printed = capsys.readouterr().out
    said = re.escape(f"of {longest:.4g} is {length}; --scale {twice:g} makes it twice as long\n")
    assert re.search(rf"assumed  a unit of the file is {unit:g} m \(.*\), so that its longest side {said}", printed)
    warned = [line for line in printed.splitlines() if line.startswith("warning: ")]
    assert len(warned) == (others is not None)
    if others:
        assert others in warned[0] and "; compare the length with the organ's, and give --scale" in warned[0]
    assert read_yaml(tmp_path / "new/config.yaml")["bodies"]["bar"]["scale_m"] == pytest.approx(unit)
