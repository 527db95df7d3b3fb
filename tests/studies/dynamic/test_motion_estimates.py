"""What a model says of its own motion is about as much as it is wrong by, without a reference."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from fixtures.poked_bar import poked
from scipy.linalg import eigh

from palpate.effects.settings import Loads, Rayleigh
from palpate.scenes.run_scene import compose
from palpate.studies.dynamic import accuracy
from palpate.studies.dynamic.compared_scene import ComparedScene
from palpate.studies.dynamic.elsewhere import measure_places, moved_pushes
from palpate.studies.dynamic.estimates import estimate, mesh_residual
from palpate.studies.dynamic.fitted import Fitted
from palpate.studies.dynamic.reference import reference

MODES = {"vibrations": 10, "bent": 3, "missed": 0.02, "tolerances": []}
FINE = {"steps_per_frame": [1], "tolerances": []}


@pytest.fixture(scope="module")
def pressed(box):
    return poked(box)


@pytest.fixture(scope="module")
def truth(pressed):
    return reference(pressed, None, 0.01, 5)


@pytest.mark.slow
def test_estimates_of_elements_and_modes_are_near_their_errors(pressed, truth):
    grid = {"fem_coarse": {"steps_per_frame": [2], "tolerances": [], "gaps": []}}
    grid |= {"moving_modes": MODES | {"steps_per_frame": [2]}, "fem_fine": FINE}
    names = ("fem_coarse", "moving_modes", "detail_correction")
    table = accuracy.measure(pressed, None, truth, grid, names)[0]
    told = table[table["varied"] == "step"].set_index("model")
    ratio = (told["estimate_of_peak"] / told["rmse_of_peak"]).groupby(level=0).last()
    assert 0.4 < ratio["fem_coarse"] < 2.5 and 0.2 < ratio["fem_fine"] < 5.0
    assert told["estimate_of_peak"]["moving_modes"] < 0.5 * told["estimate_of_peak"]["fem_coarse"]
    assert np.isnan(ratio["detail_correction"]), "its answer is known on the surface alone"


def test_the_residual_of_a_slow_press_is_what_the_finer_mesh_adds(pressed):
    """Pressed slowly, a body is in equilibrium: what two meshes differ by is what one Newton step of the finer adds."""
    push = pressed.scale_loads(0.2).loads.pushes[0].but(press_s=4.0, hold_s=4.0)
    slow = replace(pressed, loads=Loads(push={"loads": [push]}), duration_s=6.0, frames=6)
    (coarse, run), (fine, _) = (slow.move(slow.fem(24), level) for level in (0, 1))
    middle = int(np.linalg.norm(coarse[:-1], axis=2).max(axis=1).argmax())
    off = np.sqrt(np.mean(np.sum((coarse[middle] - fine[middle]) ** 2, axis=1)))
    assert mesh_residual(slow, 0, run.motion) == pytest.approx(off, rel=0.05)


def test_the_residual_of_a_free_vibration_is_what_frames_lose_of_its_inertia(pressed):
    """Frames h apart see of its acceleration −ω² u the share (2 − 2 cos ωh)/(ωh)², and K u = ω² M u lacks the rest."""
    free = replace(pressed, loads=Loads(), rayleigh=Rayleigh(mass_1_s=0.0, stiffness_s=0.0))
    particles = free.particles(1)
    system = compose(free.fem(free.frames), particles)
    unknowns = np.flatnonzero(np.repeat(system.free, 3))
    matrix = system.stiffness(particles.nodes, definite=True).toarray()[np.ix_(unknowns, unknowns)]
    (squared,), shape = eigh(matrix, np.diag(np.repeat(system.masses, 3)[unknowns]), subset_by_index=[0, 0])
    moved = np.zeros((3, 3 * len(particles.nodes)))
    moved[:, unknowns] = 1e-7 * np.outer(np.cos([-1.0, 0.0, 1.0]), shape[:, 0] / np.abs(shape).max())
    moved = moved.reshape(3, -1, 3)
    times = np.arange(3) / np.sqrt(squared)
    motion = SimpleNamespace(positions=particles.nodes + moved, rest=particles.nodes, times=times)
    surface = np.sqrt(np.mean(np.sum(moved[1, free.body.fine.surface] ** 2, axis=1)))
    assert mesh_residual(free, 1, motion) == pytest.approx((2.0 * np.cos(1.0) - 1.0) * surface, rel=1e-3)


def test_steps_of_half_the_length_are_said_to_be_better(pressed):
    fitted = Fitted(ComparedScene.fem, pressed.body.material.young_pa, 0.0, level=-1)
    said = []
    for count in (2, 4, 8):
        moved, run = pressed.move(pressed.fem(count * pressed.frames), 1)
        said.append(estimate(pressed, fitted, count * pressed.frames, run.motion, moved).estimate_of_peak)
    assert said[0] > 2.0 * said[1] > 4.0 * said[2] > 0.0


def test_pushes_elsewhere_are_as_hard_and_inward(pressed):
    found, again = (moved_pushes(pressed, 5, [0, 45], 1) for _ in range(2))
    fine, own = pressed.body.fine, pressed.loads.pushes[0]
    assert len(found) == 5 and not set(found) & set(pressed.body.anchors[0])
    for number, (contact, there) in enumerate(found.items()):
        push, newtons = there.loads.pushes[0], np.linalg.norm(own.force_n)
        assert np.linalg.norm(push.force_n) == pytest.approx(newtons)
        inward = -np.array(push.force_n) @ fine.normals[contact] / newtons
        assert inward == pytest.approx(np.cos(np.radians([0, 45][number % 2])))
        assert push.at_m == fine.nodes[contact].tolist() and push.press_s == own.press_s
        assert push == again[contact].loads.pushes[0]


@pytest.mark.slow
def test_models_are_measured_at_each_place_and_places_that_are_not_resolved_have_no_model(pressed):
    own = {"places": 2, "tilts_degrees": [0], "change_of_peak": 0.05, "max_halvings": 4, "steps_per_frame": [1]}
    grid = {"fem_coarse": {"tolerances": [0.1], "gaps": []}, "moving_modes": MODES, "fem_fine": FINE}
    table = measure_places(pressed, own, grid, 1)
    assert table["contact"].nunique() == 2 and not table["failures"].any()
    assert set(table["model"]) == {"fem_fine", "fem_coarse", "detail_correction", "moving_modes"}
    assert (table["rmse_of_peak"] > 0.0).all()
    assert set(table["reference"]) == {"fem_fine"} and table["reference_error"].isna().all()
    never = measure_places(pressed, own | {"change_of_peak": 1e-9, "max_halvings": 2}, grid, 1)
    assert len(never) == 2 and pd.isna(never["model"]).all()
