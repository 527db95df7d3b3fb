"""The part about scenes follows from their tables."""

import pandas as pd
from fixtures.material import page

from palpate.studies.scenes.measurements import energy_balance


def test_energy_from_nowhere_is_reported(scene_results):
    more = {name: table.query("scene == 'press'") for name, table in scene_results.items()}
    more = {name: pd.concat([table, table.assign(scene="free")]) for name, table in more.items()}
    more["energy"].loc[more["energy"]["scene"] == "free", "gain_j"] = 1e-3
    more["energy_balance"] = energy_balance(more["energy"], {"press": "symplectic_euler", "free": "backward_euler"})
    text = " ".join(page("scenes", more, scenes=["press", "free"]).split())
    # of the 2 mJ that press gets
    assert "This holds for press." in text and "It does not hold for free (50 %)." in text
