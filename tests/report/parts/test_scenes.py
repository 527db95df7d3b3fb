"""Sentences about the scenes follow from their tables."""

import pandas as pd
import pytest
from fixtures.material import numbers


def test_the_scenes_need_no_other_tables(scene_results):
    found = numbers("scenes", scene_results, scenes=["press", "sag"])
    assert found["energy_growth"] == "press: 0 %; sag: 0 %"
    assert found["costliest"] == "press: springs takes 75 % of 1 ms; sag: corotational takes 60 % of 5 ms"
    assert found["needed"] == "press: push (100 %); sag: held (4000 %)"
    assert found["unneeded"] == "press: kelvin (< 0.001 %); sag: gravity (100 %)"
    assert found["headline"].endswith("A step takes: press 1 ms, sag 5 ms.")


def test_energy_from_nowhere_is_reported(scene_results):
    table = scene_results["energy"]
    energy = pd.concat([table, table.query("scene == 'sag'").assign(scene="free")])
    late = (energy["scene"] == "free") & (energy["time_s"] > 0.55)
    energy.loc[late, "total_j"] += 1e-3  # half of what gravity gives; the sum falls by 1 mJ in all without it
    assert numbers("scenes", scene_results | {"energy": energy}, scenes=["sag"])["energy_growth"] == "sag: 0 %"
    more = {name: scene_results[name] for name in ("effects", "scene_effects")}
    more = {name: pd.concat([table, table.assign(scene="free")]) for name, table in more.items()}
    found = numbers("scenes", more | {"energy": energy}, scenes=["free"])
    rise = float(found["energy_growth"].removeprefix("free: ").removesuffix(" %"))
    assert rise == pytest.approx(45, abs=10)


def test_a_scene_of_which_nothing_can_be_left_out(scene_results):
    effects = scene_results["effects"].query("scene == 'press'").iloc[:1]
    found = numbers("scenes", scene_results | {"effects": effects}, scenes=["press"])
    assert found["needed"] == found["unneeded"] == "press: nothing can be left out"
