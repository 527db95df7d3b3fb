"""``palpate identify``: presses in a file, and out sentences, tables and a picture; or a sentence on what is wrong."""

import subprocess
import sys

import numpy as np
import pandas as pd
import pytest
import yaml
from fixtures.pressed_layer import Layer, draw_presses

from palpate.cli import main
from palpate.init import identify_command


def write(path, *drawn, **change):
    rows = [
        {"press": press.name, "place": press.place, "session": press.session, "depth_m": depth, "force_n": force}
        | dict(zip(("x_m", "y_m", "z_m"), press.at_m, strict=True))
        for records in drawn
        for press in records.presses
        for depth, force in zip(press.depth_m, press.force_n, strict=True)
    ]
    pd.DataFrame(rows).assign(**change).to_csv(path, index=False)
    return str(path)


@pytest.fixture
def layer(monkeypatch):
    """A layer in closed form instead of curves that take minutes."""
    found = Layer(0.004)
    monkeypatch.setattr(identify_command, "forwards_for", lambda *asked: {"neo_hookean": found})
    return found


def drawn(layer, **more):
    return draw_presses(layer, {"poisson": 0.45}, np.random.default_rng(0), places=8, **more)


def test_presses_become_sentences_tables_and_a_picture(layer, tmp_path, capsys):
    file = write(tmp_path / "presses.csv", drawn(layer))
    assert main(["identify", file, "--instrument", "sphere:0.004", "-o", str(tmp_path / "out")]) == 0
    answer = capsys.readouterr().out
    assert "ν cannot be told from these presses (any from 0.3 to 0.49 fits)" in answer
    table = pd.read_csv(tmp_path / "out/identified.csv").set_index("quantity")
    modulus = table.loc["modulus_pa"]
    assert modulus["low"] < 2000.0 / (1 - 0.45**2) < modulus["high"]
    assert not table.loc["poisson", "known"]
    left_out = pd.read_csv(tmp_path / "out/predictions.csv")
    assert set(left_out["by"]) == {"place", "depth"}
    assert (tmp_path / "out/identified.png").stat().st_size > 10_000


def test_sessions_that_contradict_are_said_and_fitted_alone(layer, tmp_path, capsys):
    drawings = [drawn(layer, session="early"), drawn(layer, session="late", young_pa=5400.0)]
    file = write(tmp_path / "presses.csv", *drawings)
    assert main(["identify", file, "--instrument", "sphere:0.004"]) == 0
    assert "contradict each other: forces of late are 2.7 times those of early" in capsys.readouterr().out
    table = pd.read_csv(tmp_path / "presses_identified/identified.csv")
    young = table[table["quantity"] == "young_pa"].set_index("part")["best"]
    assert young["late"] / young["early"] == pytest.approx(2.7, rel=0.1)


@pytest.mark.parametrize(
    ("change", "words", "expected"),
    [
        ({}, ["--instrument", "punch:0.004"], "forces are known for a ball"),
        ({}, ["--instrument", "sphere:0.004", "--thickness", "0.03:0.02"], "is no range"),
        ({}, ["--instrument", "sphere:0.004", "--hold", "below"], "give --body"),
        ({}, ["--instrument", "sphere:0.004", "--law", "hooke"], "--law hooke"),
        ({}, ["--instrument", "sphere:0.03", "--thickness", "0.02"], "give its radius"),
        ({"depth_m": list(range(10, 0, -1)) * 8}, ["--instrument", "sphere:0.004"], "depth"),
    ],
)
def test_what_cannot_be_used_gets_one_sentence_and_leaves_nothing(layer, tmp_path, capsys, change, words, expected):
    file = write(tmp_path / "presses.csv", drawn(layer), **change)
    assert main(["identify", file, *words]) == 1
    said = capsys.readouterr().err
    assert expected in said and said.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["presses.csv"]


def test_a_body_may_stand_in_settings_that_ask_for_no_study(tmp_path):
    block = {
        "kind": "box", "sizes_m": [0.1, 0.1, 0.04], "divisions": [3, 3, 2], "refinements": 1, "young_pa": 4000.0,
        "poisson": 0.3, "density_kg_m3": 1000.0, "anchors": {"plane": {"axis": "z", "side": "min", "depth_m": 0.01}},
    }  # fmt: skip
    (tmp_path / "config.yaml").write_text(yaml.safe_dump({"bodies": {"block": block}}), encoding="utf-8")
    assert identify_command.body_of("block", tmp_path / "config.yaml", None, None).name == "block"


def test_a_model_without_a_force_is_said_in_a_sentence(layer, tmp_path, capsys, monkeypatch):
    file = write(tmp_path / "presses.csv", drawn(layer))
    monkeypatch.setattr(Layer, "forces", lambda self, press, depth_m, values: np.zeros(len(depth_m)))
    assert main(["identify", file, "--instrument", "sphere:0.004"]) == 1
    said = capsys.readouterr().err
    assert "no positive force" in said and said.count("\n") == 1


def test_the_module_is_the_command():
    asked = [sys.executable, "-m", "palpate.cli", "identify", "--help"]
    assert "--instrument" in subprocess.run(asked, check=True, capture_output=True, text=True).stdout
