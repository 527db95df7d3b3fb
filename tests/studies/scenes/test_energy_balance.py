"""What counts as work, and when a scene's energy balance holds."""

import warnings
from dataclasses import replace

import pandas as pd
import pytest

from palpate.scenes.scene import Scene
from palpate.studies.scenes.measurements import FAILS, HOLDS, UNKNOWN, energy_balance, warn_of_gain
from palpate.studies.scenes.tables import TABLES

ROWS = {"scene": "a", "time_s": [0.0, 1.0, 2.0], "kinetic_j": 0.0, "springs_j": [0.0, 1.0, 0.5]}
ROWS |= {"outer_work_j": [0.0, 2.0, 1.0], "total_j": [0.0, 1.0, 0.5], "gain_j": 0.0}


def judged(**changed):
    found = energy_balance(pd.DataFrame(ROWS | changed), {"a": "symplectic_euler"})
    assert list(found) == TABLES["energy_balance"].columns.split()
    return found.iloc[0]


@pytest.mark.parametrize(("gain", "verdict"), [(0.0, HOLDS), (1.9e-6, HOLDS), (2.1e-6, FAILS)])
def test_a_millionth_of_the_largest_work_is_allowed(gain, verdict):
    row = judged(gain_j=[0.0, gain, gain])
    assert (row["verdict"], row["work_j"], row["gain_of_work"]) == (verdict, 2.0, gain / 2.0)
    assert not row["guaranteed"]


def test_the_weight_does_work_too_and_the_potentials_zero_does_not_matter():
    assert judged(gravity_j=[7.0, 6.0, 4.0], outer_work_j=0.0)["work_j"] == 3.0
    assert judged(gravity_j=[7.0, 6.0, 4.0])["work_j"] == 4.0


def test_a_scene_without_work_is_measured_by_the_range_of_its_energy():
    assert judged(outer_work_j=0.0, gain_j=0.1)["gain_of_work"] == 0.1
    assert judged(outer_work_j=0.0, total_j=3.0)["verdict"] == HOLDS


def test_nothing_is_known_without_the_elastic_energy():
    row = energy_balance(pd.DataFrame(ROWS | {"gain_j": 1.0}).drop(columns="springs_j"), {"a": "goal_position"}).iloc[0]
    assert row["verdict"] == UNKNOWN and row[["gain_j", "gain_of_work"]].isna().all()


def test_a_run_warns_of_energy_that_an_integrator_without_proof_made():
    scene = Scene("a", ["springs"], "bdf2", 0.1, 1.0)
    energies = pd.DataFrame(ROWS | {"gain_j": 0.1}).drop(columns="scene")
    with pytest.warns(UserWarning, match=r"^scenes\.a: nothing proves that steps of bdf2 make no energy, and one made"):
        warn_of_gain(scene, energies)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warn_of_gain(replace(scene, integrator="backward_euler"), energies)
        warn_of_gain(scene, energies.assign(gain_j=1e-9))
