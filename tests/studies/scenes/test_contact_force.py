"""How deep an instrument is, and what it feels, from a motion."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from palpate.scenes.motion import Motion, Moved, load, save
from palpate.studies.scenes.measurements import closed, contact_force, nearest


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


def test_nearest_is_signed_and_forgets_no_change_of_sides(box):
    mesh = box([4, 2, 2], [0.2, 0.1, 0.08])
    corners = mesh.nodes[mesh.triangles]
    ways = np.array([[0.1, 0.05, 0.07], [0.1, 0.05, 0.1], [0.23, 0.14, 0.04], [0.1, 0.05, 0.04], [0.1, 0.05, 0.05]])
    assert nearest(np.zeros((1, 3)), ways, corners) == pytest.approx([-0.01, 0.02, 0.05, -0.04, -0.03], abs=1e-12)
    rng = np.random.default_rng(3)
    points, walk = rng.uniform(0.0, 0.1, (5, 3)), rng.normal(0.0, 0.01, (60, 3)).cumsum(axis=0)
    outside = np.maximum(np.abs(points + walk[:, None] - [0.1, 0.05, 0.04]) - [0.1, 0.05, 0.04], 0.0)
    depth = (np.array([0.1, 0.05, 0.04]) - np.abs(points + walk[:, None] - [0.1, 0.05, 0.04])).min(axis=2)
    signed = np.where(depth > 0.0, -depth, np.linalg.norm(outside, axis=2))
    assert nearest(points, walk, corners) == pytest.approx(signed.min(axis=1), abs=1e-12)


def test_a_floor_and_an_open_surface_give_no_depth(motion, box):
    finger, floor = motion.obstacles
    up = replace(floor, positions=floor.positions + 0.01 * motion.times[:, None, None] * [0.0, 0.0, 1.0])
    seen = motion.observed.assign(floor_1_z_m=0.01 * motion.observed["time_s"])
    felt = contact_force(replace(motion, obstacles=(finger, up), observed=seen))
    assert felt.groupby("instrument")["depth_m"].count().to_dict() == {"finger": 10, "floor_1": 0}
    assert closed(motion.triangles) and not closed(motion.triangles[1:])
    felt = contact_force(replace(motion, triangles=motion.triangles[1:]))
    assert felt["depth_m"].isna().all() and (felt["force_n"] == 5.0).all()


def test_what_comes_home_at_every_kept_frame_still_moves(motion):
    """Frames are kept seldom; the steps between them show that the finger went somewhere."""
    finger = motion.obstacles[0]
    still = replace(finger, positions=finger.positions[:1].repeat(6, axis=0))
    assert len(contact_force(replace(motion, obstacles=(still,)))) == 10


def test_a_motion_keeps_its_instruments_and_contacts(motion, tmp_path):
    save(motion, tmp_path / "motion.h5")
    again = load(tmp_path / "motion.h5")
    assert [(t.name, t.kind, t.radius_m) for t in again.obstacles] == [
        ("finger", "capsule", 0.01),
        ("floor_1", "floor", 0.0),
    ]
    np.testing.assert_array_equal(again.obstacles[0].positions, motion.obstacles[0].positions)
    pd.testing.assert_frame_equal(again.contacts, motion.contacts, check_dtype=False)
    pd.testing.assert_frame_equal(contact_force(again), contact_force(motion))
