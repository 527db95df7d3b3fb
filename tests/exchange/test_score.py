"""Answers from elsewhere are scored to the digits of the same model inside, with floor, ties, failures and costs."""

import ast
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest
from exchange.conftest import files_of

from palpate.benchmark.accuracy import read_judged
from palpate.benchmark.engine_scores import ANSWERS
from palpate.benchmark.press_measure import measure
from palpate.benchmark.settings import FitOptions
from palpate.errors import InputError
from palpate.exchange import presses
from palpate.exchange.ask import ask
from palpate.exchange.asked_body import law_named
from palpate.exchange.judging import OwnMesh, score_answers
from palpate.exchange.score import score, truth_beside
from palpate.models.kinds import FEM

SCRIPT = Path(__file__).with_name("independent_p1.py")


def saved(answers, path):
    np.savez_compressed(path, **answers)
    return path


def test_the_script_imports_nothing_of_palpate():
    tree = ast.parse(SCRIPT.read_text(encoding="utf-8"))
    names = {each.names[0].name for each in ast.walk(tree) if isinstance(each, ast.Import)}
    names |= {each.module for each in ast.walk(tree) if isinstance(each, ast.ImportFrom)}
    assert {name.split(".")[0] for name in names} == {"json", "sys", "time", "pathlib", "numpy", "scipy"}


@pytest.mark.slow
def test_linear_elements_from_elsewhere_are_scored_as_those_inside(pressed, folder, questions, tmp_path):
    """The script knows the folder alone; both solve to 1e-10, and errors agree to eight digits."""
    subprocess.run([sys.executable, "-I", SCRIPT, folder, tmp_path / "answers.npz"], check=True)
    found = score_answers(tmp_path / "answers.npz", questions, questions.truth)
    case, judge = read_judged(files_of(pressed.results), "large", 1, 0.03, FitOptions(), 1e-10)
    models = [FEM(order=1, level=level, tolerance=1e-10) for level in (0, 1)]
    inside = measure(case, "fem_p1", models, judge, 1, 0.0)[1].set_index("setting")
    for outside, name in (
        ("level 0", "level=0, start=rest, tolerance=1e-10"),
        ("level 1", "level=1, start=rest, tolerance=1e-10"),
    ):
        one, other = found.settings.set_index("setting").loc[outside], inside.loc[name]
        for column in ("rmse_m", "rmse_of_peak", "relative_l2", "max_of_peak", "patch_rms_of_peak", "rmse_of_peak_p95"):
            assert one[column] == pytest.approx(other[column], rel=1e-8), (outside, column)
    loose = found.settings.set_index("setting")["rmse_of_peak"]
    assert loose["level 0"] > 1.5 * loose["level 1"]


def test_errors_failures_and_times_are_those_that_were_made(questions, answers, tmp_path):
    """30 %, 10 % and 1 % too small everywhere is a relative L2 error of just that."""
    found = score_answers(saved(answers, tmp_path / "a.npz"), questions, questions.truth)
    rows = found.settings
    assert rows["relative_l2"].to_numpy() == pytest.approx([0.3, 0.1, 0.01])
    assert rows["failures"].tolist() == [1, 0, 0] and rows["samples"].tolist() == [4, 4, 4]
    assert rows["online_median_s"].to_numpy() == pytest.approx([0.001, 0.002, 0.003])
    assert rows["converged"].tolist() == [False, False, True] and set(rows["hardware"]) == {"a graphics card"}
    assert found.warnings == ()


def test_an_answer_on_a_mesh_of_its_own_is_interpolated_and_its_cost_is_said(questions, answers, tmp_path):
    """The truth taken at the coarse nodes is wrong by just what is said to be the mesh's cost."""
    level, asked = questions.arrays["level_0"], questions.arrays["asked"]
    place = {int(node): i for i, node in enumerate(asked["node"])}
    surface = np.unique(level["triangles"])
    moved = np.zeros((questions.count, len(level["nodes_m"]), 3))
    moved[:, surface] = questions.truth["displacement_m"][:, [place[int(node)] for node in surface]]
    mesh = OwnMesh(level["nodes_m"], level["triangles"], asked["points_m"], asked["triangles"])
    assert mesh.at_nodes(questions.truth["displacement_m"]) == pytest.approx(moved[:, mesh.used], abs=1e-12)
    answers |= {
        "setting_2/displacement_m": moved,
        "setting_2/nodes_m": level["nodes_m"],
        "setting_2/triangles": level["triangles"],
    }
    row = score_answers(saved(answers, tmp_path / "a.npz"), questions, questions.truth).settings.iloc[2]
    assert row["rmse_of_peak"] == pytest.approx(row["mesh_rmse_of_peak"], rel=1e-9) and row["rmse_of_peak"] > 1e-3
    assert row["patch_rms_of_peak"] == pytest.approx(row["mesh_patch_rms_of_peak"], rel=1e-9)
    # the asked points themselves cost nothing
    answers |= {
        "setting_2/displacement_m": 0.99 * questions.truth["displacement_m"],
        "setting_2/nodes_m": asked["points_m"],
    }
    answers["setting_2/triangles"] = asked["triangles"]
    row = score_answers(saved(answers, tmp_path / "a.npz"), questions, questions.truth).settings.iloc[2]
    assert row["mesh_rmse_of_peak"] == pytest.approx(0.0, abs=1e-12) and row["relative_l2"] == pytest.approx(0.01)


def test_hdf5_says_the_same(questions, answers, tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for name, value in answers.items():
            file[name] = (
                value.astype(object)
                if value.dtype.kind == "U" and value.ndim
                else (str(value) if value.dtype.kind == "U" else value)
            )
    one = score_answers(tmp_path / "a.h5", questions, questions.truth).settings
    pd.testing.assert_frame_equal(
        one, score_answers(saved(answers, tmp_path / "a.npz"), questions, questions.truth).settings
    )


def test_another_law_is_said_and_judged_by_its_own_truth_where_there_is_one(questions, answers, tmp_path):
    answers["law"] = np.array("neo_hookean")
    path = saved(answers, tmp_path / "a.npz")
    found = score_answers(path, questions, questions.truth)
    assert len(found.warnings) == 1 and "ask for it with --own-law" in found.warnings[0]
    assert found.settings["own_law_rmse_of_peak"].isna().all()
    other = dict(questions.truth) | {"displacement_m": 0.9 * questions.truth["displacement_m"]}
    found = score_answers(path, questions, questions.truth, {"neo_hookean": other}.get)
    rows = found.settings.set_index("setting")
    assert rows.loc["middle", "own_law_rmse_of_peak"] == pytest.approx(0.0, abs=1e-12)
    assert rows.loc["middle", "relative_l2"] == pytest.approx(0.1) and found.warnings == ()
    answers["law"] = np.array("a law of mine")
    found = score_answers(saved(answers, path), questions, questions.truth)
    assert "palpate has no law of that name" in found.warnings[0]
    with pytest.raises(InputError, match=r"law is a law of mine, which palpate does not have; .*leave --own-law out"):
        score_answers(path, questions, questions.truth, {}.get)


@pytest.mark.slow
def test_a_law_of_a_file_has_a_truth_where_it_is_palpate_s_own(pressed, questions):
    """Newton's law, a file of palpate's, is stiffer than the corotational one in large presses; others are refused."""
    few = replace(questions, truth=None)
    assert Path(law_named("quadratic_neo_hookean")).is_file() and not law_named("mine")
    found = presses.find_truth(few, "quadratic_neo_hookean")["displacement_m"]
    apart = np.linalg.norm(found - questions.truth["displacement_m"], axis=2).max()
    assert 1e-3 < apart / np.linalg.norm(found, axis=2).max() < 0.3
    with pytest.raises(InputError, match=r"bodies.block has the law mine of a file, .*; ask without --seed"):
        presses.find_truth(few, "mine")


def test_a_truth_is_found_once_and_kept_beside_its_questions(questions, folder, monkeypatch):
    """The truth of the body's own law, found anew from the folder alone, is the run's."""
    found = truth_beside(replace(questions, truth=None), folder, "corotational")
    assert np.allclose(found["displacement_m"], questions.truth["displacement_m"], rtol=0, atol=1e-9)
    assert np.allclose(found["own_rmse_of_peak"], questions.truth["own_rmse_of_peak"], rtol=0.01)
    monkeypatch.setattr(presses, "find_truth", lambda *_: pytest.fail("it is found twice"))
    again = truth_beside(questions, folder, "corotational")
    assert np.array_equal(again["displacement_m"], found["displacement_m"])


def test_the_command_writes_a_table_and_a_picture_beside_palpate_s_models(rows_of_run, folder, answers, tmp_path):
    path = saved(answers, tmp_path / "a.npz")
    text = score(path, folder, rows_of_run, None, False)
    assert text.startswith("Elsewhere 1.2 on a graphics card, block_large, law corotational")
    assert "palpate's fem_p2, level=0" in text and "fine (converged)" in text
    table = pd.read_csv(tmp_path / "score.csv")
    assert table.columns.tolist() == ANSWERS.columns and (tmp_path / "score.png").stat().st_size > 10_000
    assert table["engine"].tolist() == ["Elsewhere"] * 3 + ["palpate"] * 2
    own = table.iloc[:3]
    assert (own["truth_rmse_of_peak"] > 0).all() and own["truth_rmse_of_peak"].nunique() == 1
    known = {"fem_p1 level=0": 0.1, "fem_p2 level=0": 0.0102}
    for _, row in own.iterrows():
        floor = row["truth_rmse_of_peak"]
        ties = [
            n
            for n, e in known.items()
            if max(e, floor, row["rmse_of_peak"]) <= 1.05 * max(floor, min(e, row["rmse_of_peak"]))
        ]
        assert ("" if pd.isna(row["tied_with"]) else row["tied_with"]) == "; ".join(ties)
    shutil.copytree(rows_of_run, tmp_path / "others")
    loads = pd.read_csv(tmp_path / "others/data/block/large/loads.csv")
    loads.assign(force_z_n=1.1 * loads["force_z_n"]).to_csv(tmp_path / "others/data/block/large/loads.csv", index=False)
    with pytest.raises(InputError, match=r"loads.csv has other presses than these questions"):
        score(path, folder, tmp_path / "others", None, False)


def test_answers_are_looked_at_before_a_truth_is_found(pressed, tmp_path):
    ask(pressed.config, None, "block_large", 5, tmp_path / "private")
    with pytest.raises(InputError, match=r"none\.npz cannot be read"):
        score(tmp_path / "none.npz", tmp_path / "private", None, None, False)
