"""A folder of questions says what was simulated, repeats byte for byte, and is refused where it was changed."""

import json
import shutil
from pathlib import Path

import meshio
import numpy as np
import pytest
from exchange.conftest import files_of

from palpate.benchmark.accuracy import read_judged
from palpate.benchmark.settings import FitOptions
from palpate.bodies.surface_quadrature import enclosed_volume
from palpate.errors import InputError
from palpate.exchange.answers import read_answers
from palpate.exchange.ask import ask
from palpate.exchange.asked_body import body_of
from palpate.exchange.folder import read


def test_the_same_questions_are_the_same_bytes(pressed, folder, tmp_path):
    ask(pressed.config, pressed.results, "block_large", None, tmp_path / "again")
    for path in folder.iterdir():
        assert path.read_bytes() == (tmp_path / "again" / path.name).read_bytes(), path.name
    assert sum(path.stat().st_size for path in folder.iterdir()) < 2e7


def test_meshes_of_all_formats_are_the_body_s(pressed, folder):
    for i, mesh in enumerate(pressed.body.levels):
        with np.load(folder / f"level_{i}.npz") as found:
            assert np.array_equal(found["nodes_m"], mesh.nodes) and np.array_equal(
                found["held"], pressed.body.anchors[i]
            )
        for suffix in ("vtu", "msh"):
            read_again = meshio.read(folder / f"level_{i}.{suffix}")
            assert np.allclose(read_again.points, mesh.nodes, rtol=0, atol=1e-15)
            assert np.array_equal(read_again.cells_dict["tetra"], mesh.tetrahedra)
        held = meshio.read(folder / f"level_{i}.vtu").point_data["held"]
        assert np.array_equal(np.flatnonzero(held), pressed.body.anchors[i])


def test_the_body_can_be_made_again_from_its_questions(pressed, questions):
    again = body_of(questions)
    assert again.material == pressed.body.material and again.bed is None
    for i, (one, other) in enumerate(zip(again.levels, pressed.body.levels, strict=True)):
        assert np.array_equal(one.triangles, other.triangles) and np.array_equal(
            again.anchors[i], pressed.body.anchors[i]
        )
    assert abs(again.prolongation - pressed.body.prolongation).max() == 0.0
    assert enclosed_volume(again.fine, again.fine.nodes) == pytest.approx(0.12 * 0.06 * 0.05)


def test_loads_are_those_of_the_test_samples_and_nodal_forces_are_consistent(pressed, questions):
    _, judge = read_judged(files_of(pressed.results), "large", 1, 0.03, FitOptions(), 1e-8)
    tests = judge.side == "test"
    loads = questions.arrays["loads"]
    assert np.array_equal(loads["sample"], judge.numbers[tests]) and questions.count == 4
    assert np.array_equal(loads["force_n"], judge.samples.force[tests])
    assert np.array_equal(questions.truth["displacement_m"], judge.truth[tests])
    assert np.array_equal(loads["in_dent"], judge.patch[tests])
    for level, mesh in enumerate(pressed.body.levels):
        nodal = loads[f"level_{level}/nodal_force_n"]
        assert np.allclose(nodal.sum(axis=1), loads["force_n"])
        # both levels have the same shape, so that any linear displacement takes the same work
        moment = np.einsum("kni,nj->kij", nodal, mesh.nodes)
        fine = np.einsum("kni,nj->kij", loads["level_1/nodal_force_n"], pressed.body.fine.nodes)
        assert np.allclose(moment, fine, atol=1e-12)
    for load, told in zip(loads["force_n"], questions.info["loads"], strict=True):
        assert np.array_equal(load, told["force_n"])


def test_a_private_set_is_drawn_anew_and_has_no_truth(pressed, questions, tmp_path):
    ask(pressed.config, None, "block_large", 5, tmp_path / "private")
    found = read(tmp_path / "private")
    assert found.truth is None and not (tmp_path / "private/truth.npz").exists()
    assert found.count == 4 and found.digest != questions.digest
    assert "truth" not in json.loads((tmp_path / "private/questions.json").read_text())["files"]
    with pytest.raises(InputError, match=r"--seed 1 is that of .*config.yaml, whose presses are public"):
        ask(pressed.config, None, "block_large", 1, tmp_path / "other")


def test_the_page_has_all_its_places_filled_and_its_example_runs(folder, questions, tmp_path, monkeypatch):
    text = (folder / "README.md").read_text(encoding="utf-8")
    assert "{{" not in text and f"the same {questions.count} questions" in text and "Ψ = μ" in text
    (tmp_path / "questions").symlink_to(folder)
    monkeypatch.chdir(tmp_path)
    example = text.split("```python\n")[1].split("```")[0]
    exec(compile(example, "README.md", "exec"), {"solve": lambda name, force: 1e-6 * force})
    found = read_answers(tmp_path / "answers.npz", questions, {})
    assert found.law == "corotational" and not any(each.failed.any() for each in found.settings)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            lambda f: (f / "loads.npz").write_bytes(b"PK"),
            r"loads.npz is not as it was written \(its checksum differs\)",
        ),
        (lambda f: (f / "asked.npz").unlink(), r"asked.npz cannot be read"),
        (lambda f: (f / "questions.json").write_text("{"), r"questions.json is damaged"),
        (lambda f: (f / "questions.json").write_text("{}"), r"format is not 'palpate questions'"),
        (lambda f: told(f, version=2), r"version is 2, and this palpate reads 1"),
        (lambda f: told(f, digest="0"), r"digest is not that of its questions"),
    ],
)
def test_a_changed_folder_is_refused(folder, tmp_path, change, said):
    copy = shutil.copytree(folder, tmp_path / "copy")
    change(copy)
    with pytest.raises(InputError, match=said):
        read(copy)


def told(folder: Path, **values) -> None:
    head = json.loads((folder / "questions.json").read_text()) | values
    (folder / "questions.json").write_text(json.dumps({name: each for name, each in head.items() if each is not None}))
