"""``palpate identify``: presses in a file, and out sentences, tables and a picture; or a sentence on what is wrong."""

import numpy as np
import pandas as pd
import pytest
from fixtures.pressed_layer import Layer, draw_presses

from palpate.cli import main
from palpate.identification import asked


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
    monkeypatch.setattr(asked, "forwards_for", lambda *given: {"neo_hookean": found})
    return found


def drawn(layer, **more):
    return draw_presses(layer, {"poisson": 0.45}, np.random.default_rng(0), places=8, **more)


@pytest.mark.slow
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


@pytest.mark.slow
@pytest.mark.parametrize("least", [-0.6e-3, 0.0])
def test_what_a_sensor_adds_is_subtracted_where_rows_are_before_contact_and_else_warned_of(
    layer, tmp_path, capsys, least
):
    """Presses of 4 kPa on a sensor with a fifth of the largest force as its zero, written with decimal commas."""
    rng, depth = np.random.default_rng(0), np.linspace(-0.6e-3, 2.4e-3, 41)
    clean = 4000.0 * layer.forces(0, depth, {"poisson": 0.45})
    rows = pd.concat([pd.DataFrame({"Press": name, "Depth (m)": depth, "Force (N)": clean}) for name in "abcdef"])
    rows["Force (N)"] += 0.2 * clean[-1] + 3.0 * rows["Depth (m)"] + 1e-4 * rng.normal(size=len(rows))
    rows[rows["Depth (m)"] >= least].to_csv(tmp_path / "presses.csv", index=False, sep=";", decimal=",")
    assert main(["identify", str(tmp_path / "presses.csv"), "--instrument", "sphere:4mm"]) == 0
    said = capsys.readouterr().out
    modulus = pd.read_csv(tmp_path / "presses_identified/identified.csv").set_index("quantity").loc["modulus_pa"]
    holds = modulus["low"] < 4000.0 / (1 - 0.45**2) < modulus["high"]
    assert "separated by semicolons, decimals have commas" in said and "√(1 + 4 mm/R)" in said
    assert holds and "6 of 6 presses have rows before contact" in said if least < 0.0 else "\nwarning: " in said


@pytest.mark.slow
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
        ({}, ["--instrument", "sphere:0.004", "--law", "hooke", "--body", "none.stl"], "--law hooke"),
        ({}, ["--instrument", "sphere:4"], "give both in metres, or the ball with its unit"),
        ({}, ["--instrument", "sphere:4mm", "--thickness", "8"], "--thickness is 8 m"),
        ({"thickness_m": 0.02}, ["--instrument", "sphere:4mm", "--thickness", "8mm:12mm"], "correct or leave out"),
        ({"depth_m": list(range(10, 0, -1)) * 8}, ["--instrument", "sphere:0.004"], "depth"),
    ],
)
def test_what_cannot_be_used_gets_one_sentence_and_leaves_nothing(layer, tmp_path, capsys, change, words, expected):
    file = write(tmp_path / "presses.csv", drawn(layer), **change)
    assert main(["identify", file, *words]) == 1
    said = capsys.readouterr().err
    assert expected in said and said.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["presses.csv"]
