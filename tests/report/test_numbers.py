"""The numbers that captions name."""

import pandas as pd
import pytest

from palpate.report.numbers import numbers


def test_the_scenes_need_no_other_tables(scene_results):
    found = {k: v.replace("\u00a0", " ") for k, v in numbers(scene_results, {}, ["scenes"], ["press", "sag"]).items()}
    assert found["energy_growth"] == "press: 0 %; sag: 0 %"
    assert found["dearest"] == "press: springs takes 75 % of 1 ms; sag: corotational takes 60 % of 5 ms"
    assert found["missed"] == "press: push (100 %); sag: held (4000 %)"
    assert found["unmissed"] == "press: kelvin (< 0.001 %); sag: gravity (100 %)"
    assert "source" not in found


def test_the_soft_bodies_numbers_come_from_their_tables(soft_body_results):
    published = {"soft_bodies": {"source": "a thesis", "steps_1_s": 50}}
    found = numbers(soft_body_results, published, ["soft_bodies"], [])
    found = {name: text.replace("\u00a0", " ") for name, text in found.items()}
    assert "quadratic clusters each take 1.6 ms a step on one core (the thesis: 20 ms)" in found["headline_soft_bodies"]
    assert found["blow_up"] == "2.0010 sqrt(m/k), 0.05 % from 2"
    assert found["never"] == "goal position"
    assert found["growth_off"] == "0.2 %"
    assert found["bent"] == "2.8 cm with 1, 8.4 cm with 2"
    assert found["column_particles"] == "3"
    assert found["slopes"] == "quadratic 1.00 to 1.00"
    assert found["poked"] == (
        "without: 20 mm deep, 30 of 30 nodes moved, 20 % left; 10 N/m: 20 mm deep, 12 of 30 nodes moved, 0 % left"
    )


def test_energy_from_nowhere_is_told(scene_results):
    table = scene_results["energy"]
    energy = pd.concat([table, table.query("scene == 'sag'").assign(scene="free")])
    late = (energy["scene"] == "free") & (energy["time_s"] > 0.55)
    energy.loc[late, "total_j"] += 1e-3  # half of what gravity gives; the sum falls by 1 mJ in all without it
    found = numbers(scene_results | {"energy": energy}, {}, ["scenes"], ["sag"])
    assert found["energy_growth"].replace("\u00a0", " ") == "sag: 0 %"
    effects = pd.concat([scene_results["effects"], scene_results["effects"].assign(scene="free")])
    found = numbers(scene_results | {"energy": energy, "effects": effects}, {}, ["scenes"], ["free"])
    rise = float(found["energy_growth"].removeprefix("free: ").removesuffix("\u00a0%"))
    assert rise == pytest.approx(45, abs=10)


def test_a_scene_of_which_nothing_can_be_left_out(scene_results):
    effects = scene_results["effects"].query("scene == 'press'").iloc[:1]
    found = numbers(scene_results | {"effects": effects}, {}, ["scenes"], ["press"])
    assert found["missed"] == found["unmissed"] == "press: nothing can be left out"
