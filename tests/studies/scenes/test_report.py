"""Sentences about the scenes follow from their tables."""

import pandas as pd
import pytest
from fixtures.material import numbers

from palpate.studies.scenes.measurements import energy_balance


def test_the_scenes_need_no_other_tables(scene_results):
    found = numbers("scenes", scene_results, scenes=["press", "sag"])
    assert found["energy_balance"] == "This holds for press and sag."
    assert found["costliest"] == "press: springs takes 75 % of 1 ms; sag: corotational takes 60 % of 5 ms"
    assert found["needed"] == "press: push (100 %); sag: held (4000 %)"
    assert found["unneeded"] == "press: kelvin (< 0.001 %); sag: gravity (100 %)"
    assert found["headline"].endswith("A step takes: press 1 ms, sag 5 ms.")


def test_energy_from_nowhere_is_reported(scene_results):
    more = {name: table.query("scene == 'press'") for name, table in scene_results.items()}
    more = {name: pd.concat([table, table.assign(scene="free")]) for name, table in more.items()}
    more["energy"].loc[more["energy"]["scene"] == "free", "gain_j"] = 1e-3
    more["energy_balance"] = energy_balance(more["energy"], {"press": "symplectic_euler", "free": "backward_euler"})
    found = numbers("scenes", more, scenes=["press", "free"])["energy_balance"]
    assert found.startswith("This holds for press. It does not hold for free (")
    share = float(found.split("free (")[1].removesuffix(" %)."))
    assert share == pytest.approx(50, abs=1)  # of the 2 mJ that press gets
    assert numbers("scenes", more, scenes=["press"])["energy_balance"] == "This holds for press."


def test_a_scene_of_which_nothing_can_be_left_out(scene_results):
    effects = scene_results["effects"].query("scene == 'press'").iloc[:1]
    found = numbers("scenes", scene_results | {"effects": effects}, scenes=["press"])
    assert found["needed"] == found["unneeded"] == "press: nothing can be left out"
