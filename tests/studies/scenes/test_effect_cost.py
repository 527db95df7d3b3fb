"""What an effect costs, and what leaving it out does."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.bodies.particles import Particles, particles_of
from palpate.scenes.run_scene import run
from palpate.scenes.scene import Scene
from palpate.studies.scenes.measurements import REST, cost, left_out

LOAD = {"at_m": [0.2, 0.1, 0.08], "force_n": [0, 0, 0], "radius_m": 0.0, "start_s": 0, "press_s": 0.1}
LOAD |= {"hold_s": 1, "release_s": 0.1}
SETTINGS = {
    "gravity": {"acceleration_m_s2": [0.0, 0.0, -0.5]},
    "rayleigh": {"mass_1_s": 5.0, "stiffness_s": 0.02},
    "push": {"loads": [LOAD]},
}
EFFECTS = ["corotational", "gravity", "held", "push", "rayleigh"]
SAG = Scene("sag", EFFECTS, "backward_euler", 0.02, 1.0, frames=20, settings=SETTINGS)


@pytest.fixture(scope="module")
def particles(slab) -> Particles:
    return particles_of(slab, 0, surface=False)


@pytest.fixture(scope="module")
def errors(particles):
    return left_out(SAG, particles, run(SAG, particles).motion).set_index("effect")


def test_without_weight_a_sagging_body_stays_put(errors):
    # no displacement instead of one that is near its peak for most of the time and grows along the body
    assert 0.2 < errors.loc["gravity", "error_if_left_out"] < 1.0


def test_without_anchors_a_body_falls_farther_than_it_bends(errors):
    assert errors.loc["held", "error_if_left_out"] > errors.loc["gravity", "error_if_left_out"]


def test_an_effect_of_no_strength_is_not_missed(errors):
    assert errors.loc["push", "error_if_left_out"] == 0.0


def test_what_cannot_be_left_out_says_why(errors, particles):
    assert list(errors.index) == EFFECTS
    assert np.isnan(errors.loc["corotational", "error_if_left_out"])
    assert errors.loc["corotational", "note"] == "it holds the body together"
    assert (errors["note"].iloc[1:] == "").all()
    assert (errors["scene"] == "sag").all()
    hasty = replace(
        SAG, integrator="symplectic_euler", step_s=1e-4, duration_s=1e-3, effects=["corotational", "gravity"]
    )
    whole = run(hasty, particles).motion
    table = left_out(replace(hasty, step_s=0.05), particles, whole).set_index("effect")
    assert np.isnan(table.loc["gravity", "error_if_left_out"])
    assert "stable up to" in table.loc["gravity", "note"]


def test_shares_make_a_whole_step(particles):
    table = cost(replace(SAG, duration_s=0.1), particles, repeats=3).set_index("effect")
    assert list(table.index) == [*EFFECTS, REST]
    assert table["share_of_step"].sum() == pytest.approx(1.0, rel=1e-12)
    assert (table["ms_per_step"] >= 0.0).all()
    np.testing.assert_allclose(table["ms_per_step"] / table["ms_per_step"].sum(), table["share_of_step"], rtol=1e-12)
    assert table.loc["held", "ms_per_step"] == 0.0


def test_memory_is_what_an_effect_holds_itself(particles):
    memory = cost(replace(SAG, duration_s=0.04), particles, repeats=1).set_index("effect")["memory_kb"]
    assert memory["held"] == 0.0  # its anchors are the body's
    # a force a node, and the acceleration
    assert memory["gravity"] == pytest.approx((particles.nodes.nbytes + 24) / 1024, rel=0.01)
    assert memory["corotational"] >= (4 * 3 + 1) * 8 * len(particles.tetrahedra) / 1024  # gradients and volumes
    assert np.isnan(memory[REST])


def test_a_scene_that_stands_still_has_no_error_and_says_why(particles):
    still = replace(SAG, effects=["corotational", "held", "push"], duration_s=0.1)
    table = left_out(still, particles, run(still, particles).motion).set_index("effect")
    assert np.isnan(table.loc["push", "error_if_left_out"])
    assert table.loc["push", "note"] == "the scene is still"
