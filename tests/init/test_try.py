"""``palpate try``: what ``palpate init`` writes, and small settings of it that are run at once."""

import re
from pathlib import Path

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


def test_a_block_can_lie_on_each_of_its_sides():
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
