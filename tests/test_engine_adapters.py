"""Scripts that answer folders of questions: short, free of palpate, right on a cube where their engine is installed."""

import ast
import importlib.util
import json
import runpy
import subprocess
import sys
from pathlib import Path
from unittest.mock import MagicMock

import numpy as np
import pytest

ENGINES = Path(__file__).parents[1] / "examples/engines"
SIDE_M, YOUNG_PA, POISSON = 0.1, 3000.0, 0.0
STRESS_PA = 0.01 * YOUNG_PA


def questions(folder: Path) -> None:
    """Write a folder as ``palpate ask`` does: a cube held below, pressed evenly enough by a disc far wider than it."""
    corners = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)]) * SIDE_M
    ways = [(0, 1, 3, 7), (0, 3, 2, 7), (0, 2, 6, 7), (0, 6, 4, 7), (0, 4, 5, 7), (0, 5, 1, 7)]
    faces = np.array(
        [[tets[i] for i in side] for tets in ways for side in ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))]
    )
    _, first, counts = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    triangles = faces[first[counts == 1]]
    held = np.arange(4)
    mesh = {"nodes_m": corners, "tetrahedra": np.array(ways), "triangles": triangles, "held": held}
    np.savez(folder / "level_0.npz", **mesh, region=np.zeros(6, int))
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$Nodes", "8"]
    lines += [f"{i + 1} {x} {y} {z}" for i, (x, y, z) in enumerate(corners)] + ["$EndNodes", "$Elements", "6"]
    lines += [f"{i + 1} 4 2 1 1 " + " ".join(str(n + 1) for n in tets) for i, tets in enumerate(ways)]
    (folder / "level_0.msh").write_text("\n".join([*lines, "$EndElements", ""]))
    total_n, radius_m = STRESS_PA * SIDE_M**2, 100 * SIDE_M
    force = np.zeros((1, 8, 3))  # of an even traction on the two triangles above
    for triangle in triangles[(triangles >= 4).all(axis=1)]:
        force[0, triangle, 2] -= total_n / 6
    np.savez(folder / "loads.npz", **{"level_0/nodal_force_n": force})
    load = {"place_m": [0.05, 0.05, 0.1], "normal": [0, 0, 1], "radius_m": radius_m, "force_n": [0, 0, -total_n]}
    material = {"young_pa": YOUNG_PA, "poisson": POISSON, "density_kg_m3": 1000}
    asked = {
        "digest": "abc",
        "kind": "press",
        "law": "corotational",
        "scene": "cube",
        "materials": [material],
        "loads": [load],
    }
    (folder / "questions.json").write_text(json.dumps(asked))


@pytest.mark.parametrize("path", sorted(ENGINES.glob("*.py")), ids=lambda path: path.stem)
def test_a_script_has_120_lines_at_most_and_imports_nothing_of_palpate(path):
    text = path.read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 120
    names = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Import | ast.ImportFrom)]
    assert "palpate" not in {a.name.split(".")[0] for node in names for a in node.names} | {
        (node.module or "").split(".")[0] for node in names if isinstance(node, ast.ImportFrom)
    }


@pytest.mark.parametrize(
    ("name", "package", "options"),
    [
        ("mujoco_flex", "mujoco", ["--levels", "0"]),
        ("newton_vbd", "newton", []),
        ("scikit_fem", "skfem", ["--settings", "0:1", "0:2"]),
    ],
)
def test_a_cube_without_poissons_ratio_shortens_by_stress_over_modulus(name, package, options, tmp_path):
    if importlib.util.find_spec(package) is None:
        pytest.skip(f"{package} is not installed")
    questions(tmp_path)
    command = [sys.executable, str(ENGINES / f"{name}.py"), str(tmp_path), str(tmp_path / "answers.npz"), *options]
    subprocess.run(command, check=True, capture_output=True)
    answers = np.load(tmp_path / "answers.npz")
    last = int(np.flatnonzero(answers["converged"])[-1])
    moved = answers[f"setting_{last}/displacement_m"][0]
    above = answers[f"setting_{last}/nodes_m"][:, 2] > 0.99 * SIDE_M
    # the laws differ by the square of the strain, 1 %
    assert moved[above] == pytest.approx(np.tile([0, 0, -0.01 * SIDE_M], (above.sum(), 1)), abs=0.03 * 0.01 * SIDE_M)
    assert answers["digest"] == "abc" and not answers[f"setting_{last}/failed"].any()


@pytest.mark.parametrize("path", sorted(ENGINES.glob("*.py")), ids=lambda path: path.stem)
def test_questions_of_another_kind_end_in_a_sentence(path, tmp_path, monkeypatch):
    """The engine itself, which may not be installed, is not reached."""
    questions(tmp_path)
    head = json.loads((tmp_path / "questions.json").read_text()) | {"kind": "touch"}
    (tmp_path / "questions.json").write_text(json.dumps(head))
    for name in ("mujoco", "newton", "newton.solvers", "warp", "skfem", "Sofa", "Sofa.Core", "Sofa.Simulation"):
        monkeypatch.setitem(sys.modules, name, MagicMock())
    monkeypatch.setattr(sys, "argv", [path.name, str(tmp_path)])
    with pytest.raises(SystemExit, match=r"^cube asks for a touch"):
        runpy.run_path(str(path), run_name="__main__")
