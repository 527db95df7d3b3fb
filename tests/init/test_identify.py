"""``palpate identify``: presses in a file, and out sentences, tables and a picture; or a sentence on what is wrong."""

from dataclasses import replace

import meshio
import numpy as np
import pandas as pd
import pytest
import yaml
from fixtures.pressed_layer import Layer, draw_presses

from palpate.benchmark.touch import Touch
from palpate.benchmark.touch_mesh import TouchedMeshes
from palpate.bodies.simple_shapes import box
from palpate.cli import main
from palpate.effects.instrument import Instrument
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
        ({}, ["--instrument", "sphere:0.004", "--hold", "below"], "give --body"),
        ({}, ["--instrument", "sphere:0.004", "--law", "hooke", "--body", "none.stl"], "--law hooke"),
        ({}, ["--instrument", "sphere:4"], "give both in metres, or the ball with its unit"),
        ({}, ["--instrument", "sphere:4in"], "such as sphere:8mm"),
        ({}, ["--instrument", "sphere:4mm", "--thickness", "8"], "--thickness is 8 m"),
        ({"thickness_m": 0.02}, ["--instrument", "sphere:4mm", "--thickness", "8mm:12mm"], "correct or leave out"),
        ({}, ["--instrument", "sphere:4mm", "--offset", "0:1"], "--offset -0.2mm:0.1mm"),
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


@pytest.mark.slow
def test_a_mesh_file_that_lies_on_a_bed_gives_back_the_modulus(tmp_path, capsys):
    """Presses by elements that are a third as long as those of the fit, on the body that the mesh file becomes."""
    block, ball = box([60.0, 60.0, 40.0], [3, 3, 2]), Instrument("sphere", 0.012)
    file = tmp_path / "block.stl"
    meshio.write_points_cells(file, block.nodes, [("triangle", block.triangles)])
    body = identify_command.body_of(str(file), None, 1e-3, "below")
    tissue = replace(body, material=replace(body.material, law="neo_hookean"))
    depth, way, rows = 0.012 * np.array([0.15, 0.25, 0.35, 0.45, 0.55]), np.array([0.0, 0.0, -1.0]), []
    for name, at in (("a", (0.02, 0.02, 0.04)), ("b", (0.04, 0.02, 0.04))):
        node = int(np.linalg.norm(body.fine.nodes - at, axis=1).argmin())
        meshes, touch = TouchedMeshes(tissue), Touch(ball, node, way, float(depth[-1]))
        mesh = meshes.around(touch, 0, meshes.level_for(touch, 1.0) + 1)
        for state in mesh.contact.push(way, list(depth), 1e-3):
            force = 1.4 * float(state.force @ way)
            rows.append((name, *body.fine.nodes[node], *way, state.depth_m, force))
    columns = ["press", "x_m", "y_m", "z_m", "direction_x", "direction_y", "direction_z", "depth_m", "force_n"]
    pd.DataFrame(rows, columns=columns).to_csv(tmp_path / "presses.csv", index=False)
    asked = f"--body {file} --scale 0.001 --hold below --instrument sphere:0.012 --law neo_hookean --poisson 0.3:0.3"
    more = ["--sticking", "0:0", "--offset", "0:0", "-o", str(tmp_path / "out")]
    assert main(["identify", str(tmp_path / "presses.csv"), *asked.split(), *more]) == 0
    table = pd.read_csv(tmp_path / "out/identified.csv").set_index("quantity")
    young = 1.4 * body.material.young_pa
    assert table.loc["young_pa", "best"] == pytest.approx(young, rel=0.05)
    assert table.loc["young_pa", "low"] < young < table.loc["young_pa", "high"]
    written = yaml.safe_load((tmp_path / "out/engines/block_palpate.yaml").read_text())["bodies"]["block"]
    stiffer = written["young_pa"] / body.material.young_pa
    assert written["bed"]["stiffness_n_m3"] == pytest.approx(stiffer * body.bed.stiffness_n_m3, rel=1e-3)
    assert "lies on is assumed to be as stiff" in capsys.readouterr().out
