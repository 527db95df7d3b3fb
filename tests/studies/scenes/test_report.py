"""The part about scenes follows from their tables."""

import pandas as pd
import pytest
from fixtures.material import numbers, page

from palpate.studies.scenes.measurements import energy_balance


def test_energy_from_nowhere_is_reported(scene_results):
    more = {name: table.query("scene == 'press'") for name, table in scene_results.items()}
    more = {name: pd.concat([table, table.assign(scene="free")]) for name, table in more.items()}
    more["energy"].loc[more["energy"]["scene"] == "free", "gain_j"] = 1e-3
    more["energy_balance"] = energy_balance(more["energy"], {"press": "symplectic_euler", "free": "backward_euler"})
    text = " ".join(page("scenes", more, scenes=["press", "free"]).split())
    # of the 2 mJ that press gets
    assert "This holds for press." in text and "It does not hold for free (50 %)." in text


def test_the_force_of_a_truth_stands_beside_that_of_the_scenes_mesh(scene_results):
    force = {"force_x_n": 0.0, "force_y_n": 0.3, "force_z_n": [0.2, 0.4, 0.9], "setting": "limit", "scene": "press"}
    table = pd.DataFrame(force | {"model": ["fem_p2", "fem_p2", "fem_fine"]})
    more = scene_results | {"dynamic_force": table}
    true = numbers("scenes", more, scenes=["press", "sag"])["true_n"]
    assert true == {"press": pytest.approx(0.5), "sag": 0.0}
