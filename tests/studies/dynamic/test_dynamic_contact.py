"""Scenes that need a motion of their own to fit models to: bodies that fall and meet something, sheets, plasticity."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.bodies.body import Body, nest
from palpate.bodies.material import Material
from palpate.effects.settings import ShapeMatching
from palpate.models.shape_matching import cubes
from palpate.scenes.settings import Scene
from palpate.stores import store, stored
from palpate.studies.dynamic import accuracy
from palpate.studies.dynamic.compared_scene import Compared, ComparedScene, training_of
from palpate.studies.dynamic.linear_limit import LinearLimit, linear_limit
from palpate.studies.dynamic.reference import reference, tabulate
from palpate.studies.dynamic.settings import Training

FLOOR = {"instruments": [{"kind": "floor", "height_m": -0.005}], "friction": 0.5}
ACTING = {"gravity": {"acceleration_m_s2": [0, 0, -9.81]}, "contact": FLOOR, "rayleigh": {}}
DROP = Scene(name="drop", body="block", held=False, step_s=0.01, duration_s=1.0, **ACTING)
PILE = DROP.but(name="pile", others=[{"body": "block", "shift_m": [0.022, 0.004, 0.045]}])
LOWER = {"contact": {"instruments": [{"kind": "floor", "height_m": -0.003}]}}
GRID = {"springs": {"shares_of_stable_step": [0.8], "evaluations": 3}}
GRID |= {"shape_matching": {"steps_per_frame": [4], "evaluations": 5}}
FALL_S = np.sqrt(2 * 0.005 / 9.81)


@pytest.fixture(scope="module")
def block(box) -> Body:
    mesh = box([2, 2, 2], [0.04, 0.04, 0.04])
    return nest("block", mesh, 0, np.flatnonzero(mesh.nodes[:, 2] == 0.0), Material(20000.0, 0.3, 1000.0))


@pytest.fixture(scope="module")
def falling(block) -> tuple[ComparedScene, ComparedScene]:
    own = {"duration_s": 0.06, "frames": 6, "level": 0, "training": {"duration_s": 0.04} | LOWER}
    return Compared(scene=DROP, own=own).and_training(block)


def test_until_it_lands_the_reference_falls_freely_and_then_stays_above_the_floor(falling):
    found = reference(*falling, 0.05, 6)
    times = found.duration_s * np.arange(1, found.frames + 1) / found.frames
    heights = found.truth[..., 2]
    free = times < FALL_S
    assert free.sum() == 3
    # the mass-proportional damping of 1/s takes off g t³/6
    fallen = 0.5 * 9.81 * times[free] ** 2 - 9.81 * times[free] ** 3 / 6
    assert heights[free] == pytest.approx(np.broadcast_to(-fallen[:, None], heights[free].shape), rel=0.01)
    rest = falling[0].body.coarse.nodes[falling[0].body.coarse.surface, 2]
    assert (rest + heights > -0.005 - 0.02 * found.peak).all() and heights.min() < -0.0045
    table = tabulate(falling[0], found)
    assert table["resolved"].sum() == found.frames * len(found.changes)
    assert table.loc[table["resolved"] & (table["step_s"] == found.step_s), "change_of_peak"].max() <= 0.05


def test_meshes_agree_on_a_fall_and_their_steps_differ_by_what_the_scheme_leaves(block):
    """In steps of h backward Euler falls g t h/2 too far, and the same on all meshes."""
    compared = ComparedScene.of(DROP, block, 0.03, 6, 1)
    found = linear_limit(compared, 4, 0.2)
    assert (found.levels, found.steps) == (2, 24) and found.until_s == pytest.approx(0.03)
    space, time = found.own[:2, 1]
    times, h = 0.005 * np.arange(1, 7), 0.005 / 8
    peak = 0.5 * 9.81 * 0.03**2
    assert space < 1e-6 and time == pytest.approx(np.sqrt(np.mean((0.5 * 9.81 * times * h) ** 2)) / peak, rel=0.03)
    assert found.own[3, 1] == pytest.approx(time, rel=1e-6) and np.isnan(found.own_force)
    assert found.peaks_m[:2] == pytest.approx(peak - 9.81 * 0.03**3 / 6, rel=1e-3)


@pytest.mark.slow
def test_models_are_judged_until_meshes_part_beside_what_these_say_of_the_standard(block, tmp_path):
    """Which falls a little short on the coarser mesh: by how far that is from the finer one, and what that errs by."""
    compared, coarse = (ComparedScene.of(PILE, block, 0.2, 10, level) for level in (1, 0))
    limit = linear_limit(compared, 2, 0.06)
    store(limit, tmp_path / "truth.h5")
    limit = stored(LinearLimit, tmp_path / "truth.h5")
    assert isinstance(limit, LinearLimit) and 0.0 < limit.until_s < 0.2
    found = reference(coarse, None, 0.05, 4)
    grid = GRID | {"fem_coarse": {"steps_per_frame": [1], "tolerances": [], "gaps": []}}
    judged, forces = accuracy.measure(coarse, None, found, grid, ["fem_coarse"], limit=limit)
    frames = round(limit.until_s / 0.02)
    assert judged["resolved_s"].tolist() == pytest.approx([limit.until_s] * len(judged))
    space, _, _, whole = limit.own[:, 1]
    assert judged["reference_error"].tolist() == pytest.approx([space + whole] * len(judged))
    kept = found.truth[:frames]
    off = np.sqrt(np.mean(np.sum((found.tried[-1][:frames] - kept) ** 2, axis=2))) / np.linalg.norm(kept, axis=2).max()
    assert judged.iloc[len(found.tried) - 1]["rmse_of_peak"] == pytest.approx(off)
    # a force that nobody knows is compared with none
    unsure = replace(limit, own_force=0.9)
    table, forces = accuracy.measure(coarse, None, found, grid, ["fem_coarse"], limit=unsure)
    assert table["force_rms_of_peak"].isna().all() and forces.empty
    # and where meshes part at once the whole motion is told, with what they say
    table = accuracy.measure(coarse, None, found, grid, ["fem_coarse"], limit=replace(limit, until_s=0.0))[0]
    assert table["resolved_s"].iloc[0] == pytest.approx(found.duration_s) and table["reference_error"].isna().all()
    assert table["parted"].str.startswith("two meshes agree at no time: largest displacement ").all()


def test_the_floor_hands_over_the_momentum_that_the_weight_takes(falling):
    compared = replace(falling[0], duration_s=0.4, frames=20)
    mass, frame_s = float(compared.particles(0).masses.sum()), 0.02
    matching = ShapeMatching(clusters=cubes(compared.body.coarse))
    for scene in (compared.fem(40), compared.shapes(400, matching, 0.0)):
        run = compared.move(scene, 0)[1]
        forces = run.motion.instrument_forces()
        assert forces.shape == (20, 1, 3) and not forces[0].any()  # it falls
        handed = forces[:, 0, 2].sum() * frame_s
        velocity = (run.motion.positions[-1] - run.motion.positions[-2]).mean(axis=0)[2] / frame_s
        lost = mass * 9.81 * 0.4 - handed  # and what the damping of 1/s takes of the momentum, a hundredth
        assert lost == pytest.approx(mass * velocity, abs=0.03 * mass * 9.81 * 0.4)
        assert forces[-1, 0, 2] == pytest.approx(mass * 9.81, rel=0.35)  # it sways on


def test_forces_are_compared_with_those_of_the_standard(falling):
    found = reference(*falling, 0.05, 6)
    assert found.force.shape == (found.frames, 1, 3) and found.force_change < 0.2
    grid = GRID | {"fem_coarse": {"steps_per_frame": [1], "tolerances": [], "gaps": []}}
    table, forces = accuracy.measure(*falling, found, grid, ["shape_matching"])
    assert table["force_rms_of_peak"].between(1e-6, 1.0).all()
    last = table.iloc[len(found.tried) - 1]
    felt = forces[(forces["model"] == "fem_fine") & (forces["setting"] == last["setting"])]["force_z_n"].to_numpy()
    true = forces[forces["setting"] == "limit"]["force_z_n"].to_numpy()
    assert len(true) == found.frames and (true >= 0.0).all()
    assert last["force_rms_of_peak"] == pytest.approx(np.sqrt(np.mean((felt - true) ** 2)) / true.max(), rel=0.05)
    assert last["force_peak_error"] == pytest.approx(felt.max() / true.max() - 1.0, abs=0.02)
    assert table["reference_force_error"].isna().all()


def test_what_nothing_can_be_fitted_to_is_a_failure(falling, monkeypatch):
    monkeypatch.setattr("palpate.studies.dynamic.fitted.error_of", lambda *_: 1.0)
    found = reference(*falling, 0.05, 6)
    grid = GRID | {"fem_coarse": {"steps_per_frame": [1], "tolerances": [], "gaps": []}}
    assert set(accuracy.measure(*falling, found, grid, ["fem_coarse"])[0]["model"]) == {"fem_fine"}
    table = accuracy.measure(*falling, found, grid)[0]
    failed = table[table["failures"] == 1]
    assert list(failed["model"]) == ["springs", "springs_volume", "shape_matching"] and failed["rmse_m"].isna().all()


def test_the_motion_that_is_fitted_to_has_frames_of_the_same_length(block):
    others = [{"body": "block", "shift_m": [0, 0, 0.05]}] * 2
    made = ComparedScene.of(DROP.but(others=others), block, 0.2, 10, 0)
    lesson = training_of(made, Training(duration_s=0.07, others=others[:1], **LOWER), 0.5)
    assert (lesson.frames, lesson.duration_s) == (4, pytest.approx(0.08))
    assert lesson.loads == made.loads.but(contact=FLOOR | LOWER["contact"])
    assert (made.nodes(0), lesson.nodes(0)) == (81, 54)
    gap = made.widen(4.0).loads.contact.gap_m
    assert gap == pytest.approx(4.0 * 1e-3 * 0.04)
