"""No step gains more energy than the work that is done in it: loads, weight and moved instruments."""

import numpy as np
import pytest
from fixtures.shipped import completed

from palpate.bodies.body import nest
from palpate.bodies.make_body import make_body
from palpate.bodies.material import Material
from palpate.bodies.particles import particles_of
from palpate.bodies.settings import Solid
from palpate.bodies.simple_shapes import box
from palpate.errors import NotConverged
from palpate.scenes.moved_particles import particles_in
from palpate.scenes.run_scene import run
from palpate.scenes.settings import Scene
from palpate.solvers import backward_euler
from palpate.studies.scenes.measurements import HOLDS, UNKNOWN, energy_balance

SHORTER = {
    "liver_press": {"level": 0, "step_s": 0.05},
    "liver_palpation": {"level": 0, "step_s": 0.02},
    "tumour_palpation": {"level": 0},
    "liver_incision": {"level": 0},
    "cube_pile": {"duration_s": 0.15},
    "bar_sag": {"duration_s": 0.3},
    "cube_poke": {},
    "strip_creep": {"duration_s": 1.0},
    "sheet_drape": {"duration_s": 0.1},
    "clay_dent": {"duration_s": 0.6, "step_s": 0.04},
    "clay_shapes": {"duration_s": 0.6},
}
"""The shipped scenes, each as far as its work or its weight has acted, some coarser or in longer steps."""
QUICK = ("liver_press", "cube_pile", "bar_sag", "cube_poke", "strip_creep", "clay_dent", "clay_shapes")
FINGER = {"kind": "sphere", "name": "finger", "center_m": [0.025, 0.025, 0.0615], "radius_m": 0.01}
PATH = {"times_s": [0.0, 0.1, 0.2, 0.3], "shifts_m": [[0, 0, 0], [0, 0, -0.008], [0.01, 0, -0.008], [0.01, 0, 0.01]]}
SETTINGS = {"contact": {"instruments": [FINGER | PATH], "friction": 0.3}}
SETTINGS |= {"rayleigh": {"mass_1_s": 1.0, "stiffness_s": 0.02}}
GRASPED = {"radius_m": 0.02, "start_s": 0.02, "pull_s": 0.1, "hold_s": 0.03}
SEWN = {
    "hooks": [
        {"at_m": [0.05, 0.025, 0.05], "shift_m": [0.006, 0, 0.006], "release_s": 0.1} | GRASPED,
        {"at_m": [0.0, 0.025, 0.05], "force_n": [-0.3, 0, 0.3], "release_s": 0.0} | GRASPED,
    ],
    "threads": [
        {"ends_m": [[0.01, y, 0.05], [0.04, y, 0.05]], "stiffness_n_m": 1e3, "start_s": 0.05, "tighten_s": 0.1}
        | {"tightened_to": 0.8}
        for y in (0.01, 0.04)
    ],
}
"""A cube whose top is pulled apart, by a shift and by a force, and sewn together."""
POKED = Scene(name="poked", body="cube", step_s=0.01, duration_s=0.3, **SETTINGS)


CONFIG = completed()


@pytest.fixture(scope="module")
def cube():
    mesh = box([0.05, 0.05, 0.05], [3, 3, 3])
    held = np.flatnonzero(mesh.nodes[:, 2] < 1e-9)
    return particles_of(nest("cube", mesh, 0, held, Material(5000.0, 0.3, 100.0)), 0, surface=False)


@pytest.mark.parametrize(
    "name",
    [name if name in QUICK else pytest.param(name, marks=pytest.mark.slow) for name in CONFIG.scenes],
)
def test_no_step_of_a_shipped_scene_gains_more_than_a_millionth_of_the_work(name):
    scene = CONFIG.scenes[name].but(name=name, **SHORTER[name])
    asked = [CONFIG.bodies[body] for body in scene.bodies]
    asked = [each.but(refinements=scene.level) if isinstance(each, Solid) else each for each in asked]
    made = list(map(make_body, scene.bodies, asked))
    energy = run(scene, particles_in(scene, made)).motion.energy.assign(scene=name)
    (judged,) = energy_balance(energy, {name: scene.integrator}).itertuples()
    assert judged.verdict == (UNKNOWN if name == "clay_shapes" else HOLDS), judged
    assert judged.work_j > 1e-5
    # by loads or an instrument
    assert energy["outer_work_j"].any() == (name not in ("cube_pile", "bar_sag", "sheet_drape"))


def test_no_step_gains_energy_where_an_instrument_presses_tissue_that_creeps(cube):
    series = {"shares": [0.4, 0.2], "times_s": [0.02, 0.2]}
    energy = run(POKED.but(prony=series), cube).motion.energy.assign(scene="poked")
    assert energy_balance(energy, {"poked": "backward_euler"})["verdict"].item() == HOLDS
    assert energy["prony_j"].max() > 0.01 * energy["corotational_j"].max()


@pytest.mark.parametrize("integrator", ["backward_euler", "bdf2"])
def test_no_step_gains_energy_where_hooks_pull_and_threads_are_tightened(cube, integrator):
    energy = run(POKED.but(integrator=integrator, contact=None, **SEWN), cube).motion.energy.assign(scene="poked")
    judged = energy_balance(energy, {"poked": integrator})
    assert judged["gain_of_work"].item() <= (1e-6 if integrator == "backward_euler" else 1e-2)
    rise = np.diff(energy["total_j"]).max()  # without the work it does not hold
    assert rise > 0.05 * energy["outer_work_j"].max() and energy["threads_j"].max() > 1e-6


def test_without_the_work_of_an_instrument_the_balance_is_seen_not_to_hold(cube):
    energy = run(POKED, cube).motion.energy.assign(scene="poked")
    assert energy_balance(energy, {"poked": "backward_euler"})["verdict"].item() == HOLDS
    rise = np.diff(energy["total_j"]).max()
    assert rise > 0.05 * energy["outer_work_j"].max()


@pytest.mark.parametrize(
    ("name", "ends", "acting"),
    [("finger", None, {}), ("hook_0", 25, {"contact": None, "hooks": SEWN["hooks"][:1]})],  # steps of 10 ms
)
def test_the_work_is_the_force_that_is_felt_times_the_way(cube, name, ends, acting):
    """The trapezoidal rule over what is observed knows nothing of the counting; both agree as steps get shorter."""
    apart = []
    for parts in (1, 2, 4):
        found = run(POKED.but(**acting, step_s=0.01 / parts), cube).motion
        names = [[f"{name}_{axis}_m" for axis in "xyz"], [f"{name}_force_{axis}_n" for axis in "xyz"]]
        places, forces = (found.observed[columns].to_numpy()[: ends and ends * parts] for columns in names)
        felt = -np.sum(0.5 * (forces[1:] + forces[:-1]) * np.diff(places, axis=0))
        apart.append(abs(found.energy["outer_work_j"].iloc[-1] / felt - 1.0))
    assert apart[0] < 0.5 and apart[2] < 0.15
    assert apart[0] > 1.5 * apart[1] > 2.25 * apart[2]


@pytest.mark.parametrize("given", [{"contact": {"instruments": [FINGER | PATH]}}, SEWN], ids=["poked", "sewn"])
def test_what_is_worked_is_stored_or_damped_as_steps_get_shorter(cube, monkeypatch, given):
    """Without friction the rest is the scheme's own damping, of first order but for the touch itself."""
    lost = []
    step = backward_euler.BackwardEuler.step
    for parts in (1, 2, 4):
        damped = []

        def noted(self, x, v, h, damped=damped):
            """Step, and append what dampers take in it [J]."""
            reached, after = step(self, x, v, h)
            force = np.zeros_like(x)
            self._system.effects["rayleigh"].add_force(x, after, force)
            damped.append(-h * float(np.vdot(force, after)))
            return reached, after

        monkeypatch.setattr(backward_euler.BackwardEuler, "step", noted)
        energy = run(POKED.but(**{"contact": None} | given, step_s=0.01 / parts), cube).motion.energy.iloc[-1]
        lost.append((energy["outer_work_j"] - energy["total_j"] - sum(damped)) / energy["outer_work_j"])
    assert 0.3 > lost[0] > 1.6 * lost[1] > 2.56 * lost[2] > 0.0


def test_the_work_of_halved_steps_is_counted_half_by_half(cube, monkeypatch):
    short = run(POKED.but(step_s=0.005), cube).motion.energy.iloc[-1]

    def refuse(step, *rest, minimise=backward_euler.minimise_by_newton):
        if step._h > 0.006:
            raise NotConverged("too long", [])
        return minimise(step, *rest)

    monkeypatch.setattr(backward_euler, "minimise_by_newton", refuse)
    halved = run(POKED, cube).motion.energy.iloc[-1]
    assert halved["outer_work_j"] == pytest.approx(short["outer_work_j"], rel=1e-9)
    assert halved["gain_j"] <= 1e-6 * halved["outer_work_j"]
