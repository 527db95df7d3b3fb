"""The part about scenes follows from their tables."""

import pandas as pd
import pytest
from fixtures.material import numbers, page

from palpate.studies.scenes.measurements import energy_balance


def test_the_scenes_need_no_other_tables(scene_results):
    press, sag = numbers("scenes", scene_results, scenes=["press", "sag"])["scenes"]
    assert (press["costliest"], press["share"], press["step_s"]) == ("springs", 0.75, pytest.approx(1e-3))
    assert (sag["costliest"], sag["share"], sag["step_s"]) == ("corotational", 0.6, pytest.approx(5e-3))
    assert [name for name, _ in press["missed"] + sag["missed"]] == ["push", "kelvin", "held", "gravity"]
    assert [error for _, error in sag["missed"]] == [pytest.approx(40.0), pytest.approx(1.0)]
    text = " ".join(page("scenes", scene_results, scenes=["press", "sag"]).split())
    assert "A step takes: press 1 ms, sag 5 ms." in text and "This holds for press, sag." in text


def test_energy_from_nowhere_is_reported(scene_results):
    more = {name: table.query("scene == 'press'") for name, table in scene_results.items()}
    more = {name: pd.concat([table, table.assign(scene="free")]) for name, table in more.items()}
    more["energy"].loc[more["energy"]["scene"] == "free", "gain_j"] = 1e-3
    more["energy_balance"] = energy_balance(more["energy"], {"press": "symplectic_euler", "free": "backward_euler"})
    held, failed = numbers("scenes", more, scenes=["press", "free"])["verdicts"]
    assert [name for name, _ in held[1]] == ["press"] and failed[1][0][0] == "free"
    assert failed[1][0][1] == pytest.approx(0.5, abs=0.01)  # of the 2 mJ that press gets


def test_the_force_of_a_truth_stands_beside_that_of_the_scenes_mesh(scene_results):
    force = {"force_x_n": 0.0, "force_y_n": 0.3, "force_z_n": [0.2, 0.4, 0.9], "setting": "limit", "scene": "press"}
    table = pd.DataFrame(force | {"model": ["fem_p2", "fem_p2", "fem_fine"]})
    more = scene_results | {"dynamic_force": table}
    press, sag = numbers("scenes", more, scenes=["press", "sag"])["scenes"]
    assert (press["true_n"], sag["true_n"]) == (pytest.approx(0.5), 0.0)
