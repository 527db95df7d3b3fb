"""What an effect costs, and what leaving it out does."""

import warnings
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from palpate.bodies.particles import Particles, particles_of
from palpate.scenes.motion import Motion, Moved
from palpate.scenes.run_scene import run
from palpate.scenes.settings import Scene
from palpate.studies.scenes import measurements
from palpate.studies.scenes.contact_force import contact_force, least_signed_distance
from palpate.studies.scenes.measurements import DOUBTED, FAILS, HOLDS, UNKNOWN, energy_balance, left_out

LOAD = {"at_m": [0.2, 0.1, 0.08], "force_n": [0, 0, 0], "radius_m": 0.0, "start_s": 0, "press_s": 0.1}
LOAD |= {"hold_s": 1, "release_s": 0.1}
SETTINGS = {"gravity": {"acceleration_m_s2": [0.0, 0.0, -0.5]}, "push": {"loads": [LOAD]}}
SETTINGS |= {"rayleigh": {"mass_1_s": 5.0, "stiffness_s": 0.02}}
EFFECTS = ["corotational", "gravity", "held", "push", "rayleigh"]
SAG = Scene(name="sag", body="slab", step_s=0.02, duration_s=1.0, frames=20, **SETTINGS)


@pytest.fixture(scope="module")
def particles(slab) -> Particles:
    return particles_of(slab, 0, surface=False)


def test_errors_are_those_of_what_is_missing(particles):
    errors = left_out(SAG, particles, run(SAG, particles).motion).set_index("effect")
    assert list(errors.index) == EFFECTS and (errors["scene"] == "sag").all()
    assert errors["note"].tolist() == ["it holds the body together", "", "", "", ""]
    missing = errors["error_if_left_out"]
    assert np.isnan(missing["corotational"])
    # no displacement instead of one that is near its peak for most of the time and grows along the body
    assert 0.2 < missing["gravity"] < 1.0
    # without anchors it falls farther than it bends
    assert missing["held"] > missing["gravity"]
    # an effect of no strength
    assert missing["push"] == 0.0


def test_what_has_no_error_says_why(particles):
    hasty = SAG.but(integrator="symplectic_euler", held=False, push=None, rayleigh=None, step_s=1e-4, duration_s=1e-3)
    whole = run(hasty, particles).motion
    table = left_out(hasty.but(step_s=0.05), particles, whole).set_index("effect")
    assert np.isnan(table.loc["gravity", "error_if_left_out"])
    assert "takes steps of up to" in table.loc["gravity", "note"]
    still = SAG.but(gravity=None, rayleigh=None, duration_s=0.1)
    table = left_out(still, particles, run(still, particles).motion).set_index("effect")
    assert np.isnan(table.loc["push", "error_if_left_out"]) and table.loc["push", "note"] == "the scene is still"


ROWS = {"scene": "a", "time_s": [0.0, 1.0, 2.0], "kinetic_j": 0.0, "springs_j": [0.0, 1.0, 0.5]}
ROWS |= {"outer_work_j": [0.0, 2.0, 1.0], "total_j": [0.0, 1.0, 0.5], "gain_j": 0.0}


def judged(**changed):
    found = energy_balance(pd.DataFrame(ROWS | changed), {"a": "symplectic_euler"})
    assert list(found) == measurements.ENERGY_BALANCE.columns
    return found.iloc[0]


@pytest.mark.parametrize(("gain", "verdict"), [(0.0, HOLDS), (1.9e-6, HOLDS), (2.1e-6, FAILS)])
def test_a_millionth_of_the_largest_work_is_allowed(gain, verdict):
    row = judged(gain_j=[0.0, gain, gain])
    assert (row["verdict"], row["work_j"], row["gain_of_work"]) == (verdict, 2.0, gain / 2.0)
    assert not row["guaranteed"]


def test_the_weight_does_work_too_and_without_work_the_range_of_the_energy_counts():
    assert judged(gravity_j=[7.0, 6.0, 4.0], outer_work_j=0.0)["work_j"] == 3.0
    assert judged(gravity_j=[7.0, 6.0, 4.0])["work_j"] == 4.0
    assert judged(outer_work_j=0.0, gain_j=0.1)["gain_of_work"] == 0.1
    assert judged(outer_work_j=0.0, total_j=3.0)["verdict"] == HOLDS


def test_nothing_is_known_without_the_elastic_energy():
    row = energy_balance(pd.DataFrame(ROWS | {"gain_j": 1.0}).drop(columns="springs_j"), {"a": "goal_position"}).iloc[0]
    assert row["verdict"] == UNKNOWN and row[["gain_j", "gain_of_work"]].isna().all()


def test_a_run_warns_of_energy_that_an_integrator_without_proof_made():
    scene = Scene(name="a", body="slab", integrator="bdf2", step_s=0.1, duration_s=1.0)
    energies = pd.DataFrame(ROWS | {"gain_j": 0.1}).drop(columns="scene")
    with pytest.warns(UserWarning, match=r"^scenes\.a: nothing proves that steps of bdf2 make no energy, and one made"):
        measurements.warn_of_gain(scene, energies)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        measurements.warn_of_gain(scene.but(integrator="backward_euler"), energies)
        measurements.warn_of_gain(scene, energies.assign(gain_j=1e-9))


def test_a_motion_in_modes_warns_of_a_doubt_that_is_large_beside_its_peak(motion):
    scene, rest = Scene(name="a", body="slab", integrator="touching", step_s=0.1, duration_s=1.0), motion.rest
    moved = replace(motion, positions=np.array([rest, rest + np.array([0.0, 0.0, 0.01])]))
    for doubt, said in ((1.5 * DOUBTED * 0.01, "a doubt of 1.5% of the peak"), (np.inf, "without a limit")):
        energy = pd.DataFrame({"time_s": [0.0, 0.5, 1.0], "doubt_m": [0.0, doubt, 1e-9]})
        with pytest.warns(UserWarning, match=rf"^scenes\.a: at 0\.5 s its modes lack what moves there, {said}"):
            measurements.warn_of_doubt(scene, replace(moved, energy=energy))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        measurements.warn_of_doubt(scene, replace(moved, energy=energy.assign(doubt_m=0.5 * DOUBTED * 0.01)))
        measurements.warn_of_doubt(scene, moved)


@pytest.fixture
def motion(box) -> Motion:
    """A rod of radius 1 cm that comes down on a box of 20 × 10 × 8 cm, 3 cm into its top, and a floor at rest."""
    mesh = box([4, 2, 2], [0.2, 0.1, 0.08])
    times = np.linspace(0.0, 1.0, 6)
    rod = np.array([[0.08, 0.05, 0.1], [0.12, 0.05, 0.1]]) - np.array([0, 0, 0.04]) * times[:, None, None]
    floor = np.repeat(np.array([[[-1.0, -1, 0], [2, -1, 0], [-1, 2, 0]]]), 6, axis=0)
    things = (
        Moved("finger", "capsule", 0.01, rod, np.array([[0, 1, 1]])),
        Moved("floor_1", "floor", 0.0, floor, np.array([[0, 1, 2]])),
    )
    steps = np.linspace(0.1, 1.0, 10)
    observed = pd.DataFrame({"time_s": steps})
    for i, axis in enumerate("xyz"):
        observed[f"finger_{axis}_m"] = rod[0].mean(axis=0)[i] - 0.04 * steps * (axis == "z")
        observed[f"finger_force_{axis}_n"] = {"x": 3.0, "y": 0.0, "z": 4.0}[axis]
        observed[f"floor_1_{axis}_m"] = floor[0].mean(axis=0)[i]
        observed[f"floor_1_force_{axis}_n"] = 1.0
    contacts = pd.DataFrame({"first": ["box"], "second": ["finger"], "gap_m": [1e-4], "time_s": [1.0]})
    energy = pd.DataFrame({"time_s": times, "kinetic_j": 0.0})
    positions = np.repeat(mesh.nodes[None], 6, axis=0)
    cells = mesh.triangles, mesh.tetrahedra
    return Motion("press", times, positions, mesh.nodes, *cells, np.arange(3), energy, things, observed, contacts)


def test_depth_is_below_the_surface_at_rest_and_only_what_moves_feels(motion):
    felt = contact_force(motion)
    assert set(felt["instrument"]) == {"finger"} and len(felt) == 10
    # the rod's lowest line starts 1 cm above the top and comes down by 4 cm in a second
    assert felt["depth_m"].to_numpy() == pytest.approx(0.04 * felt["time_s"].to_numpy() - 0.01, abs=1e-12)
    assert felt["force_n"].to_numpy() == pytest.approx(5.0)


def test_forces_on_hooks_and_of_threads_are_told_too(motion):
    ends = np.tile([[0, 0, 0], [0, 0, 0.1]], (6, 1, 1))
    sewn = replace(motion, drawn=(Moved("thread_0", "capsule", 0.001, ends, np.empty((0, 3), dtype=int)),))
    seen = motion.observed.assign(thread_0_force_x_n=0.6, thread_0_force_y_n=0.0, thread_0_force_z_n=0.8)
    felt = contact_force(replace(sewn, observed=seen)).groupby("instrument")
    assert felt["force_n"].mean().to_dict() == pytest.approx({"finger": 5.0, "thread_0": 1.0})
    assert felt["depth_m"].count().to_dict() == {"finger": 10, "thread_0": 0}


def test_nearest_is_signed_and_forgets_no_change_of_sides(box):
    mesh = box([4, 2, 2], [0.2, 0.1, 0.08])
    corners = mesh.nodes[mesh.triangles]
    ways = np.array([[0.1, 0.05, 0.07], [0.1, 0.05, 0.1], [0.23, 0.14, 0.04], [0.1, 0.05, 0.04], [0.1, 0.05, 0.05]])
    assert least_signed_distance(np.zeros((1, 3)), ways, corners) == pytest.approx(
        [-0.01, 0.02, 0.05, -0.04, -0.03], abs=1e-12
    )
    rng = np.random.default_rng(3)
    points, walk = rng.uniform(0.0, 0.1, (5, 3)), rng.normal(0.0, 0.01, (60, 3)).cumsum(axis=0)
    beyond = np.abs(points + walk[:, None] - [0.1, 0.05, 0.04]) - [0.1, 0.05, 0.04]  # of the box's halves
    inside = beyond.max(axis=2)
    signed = np.where(inside < 0.0, inside, np.linalg.norm(np.maximum(beyond, 0.0), axis=2))
    assert least_signed_distance(points, walk, corners) == pytest.approx(signed.min(axis=1), abs=1e-12)


def test_a_floor_and_an_open_surface_give_no_depth(motion, box):
    finger, floor = motion.obstacles
    up = replace(floor, positions=floor.positions + 0.01 * motion.times[:, None, None] * [0.0, 0.0, 1.0])
    seen = motion.observed.assign(floor_1_z_m=0.01 * motion.observed["time_s"])
    felt = contact_force(replace(motion, obstacles=(finger, up), observed=seen))
    assert felt.groupby("instrument")["depth_m"].count().to_dict() == {"finger": 10, "floor_1": 0}
    felt = contact_force(replace(motion, triangles=motion.triangles[1:]))
    assert felt["depth_m"].isna().all() and (felt["force_n"] == 5.0).all()


def test_what_comes_home_at_every_kept_frame_still_moves(motion):
    """Frames are kept seldom; the steps between them show that the finger went somewhere."""
    finger = motion.obstacles[0]
    still = replace(finger, positions=finger.positions[:1].repeat(6, axis=0))
    assert len(contact_force(replace(motion, obstacles=(still,)))) == 10
