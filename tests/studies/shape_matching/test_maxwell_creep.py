"""The closed solution is that of the equations, and the scene that is shipped creeps as it says."""

from pathlib import Path

import numpy as np
import pytest
from fixtures.shipped import completed
from scipy.integrate import solve_ivp

from palpate.bodies.make_body import make_body
from palpate.bodies.particles import particles_of
from palpate.errors import InputError
from palpate.scenes.run_scene import run
from palpate.studies.shape_matching.maxwell_creep import closeness, creep, measure
from palpate.studies.shape_matching.settings import Creep, check

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def shipped():
    config = completed()
    scene = config.scenes[config.shape_matching.creep.scene]
    body = make_body(scene.body, config.bodies[scene.body])
    return scene, particles_of(body, scene.level, scene.surface), config


def test_a_sudden_load_that_stays_gives_the_textbook_curve():
    times = np.linspace(0.0, 5.0, 2001)
    found = creep(times, np.ones_like(times), 2.0, 0.4)
    assert found == pytest.approx(1.0 - 2.0 / 3.0 * np.exp(-times / (0.4 * 3.0)), abs=1e-12)


def test_a_load_that_changes_gives_what_the_equations_integrate_to():
    """k u + r k (u − s) = f and ds/dt = (u − s)/τ, by another integrator."""
    ratio, tau = 0.7, 0.3
    times = np.linspace(0.0, 3.0, 3001)

    def load(t):
        return np.sin(2.0 * t) ** 2

    def slope(t, s):
        return ((load(t) + ratio * s) / (1.0 + ratio) - s) / tau

    s = solve_ivp(slope, (0.0, 3.0), [0.0], t_eval=times, rtol=1e-10, atol=1e-12).y[0]
    assert creep(times, load(times), ratio, tau) == pytest.approx((load(times) + ratio * s) / (1.0 + ratio), abs=1e-6)


def test_the_shipped_scene_creeps_as_the_closed_solution(shipped):
    scene, particles, _ = shipped
    table = measure(scene, particles, run(scene, particles).motion)
    assert closeness(table) < 0.02
    held = table[table["load"] > 1.0 - 1e-9]
    assert held["creep_m"].iloc[-1] > 1.3 * held["creep_m"].iloc[0]  # it creeps
    assert 0.1 < table["creep_m"].iloc[-1] / table["creep_m"].max() < 0.5  # and comes back slowly
    wrong = scene.but(maxwell={"stiffness_ratio": 1.0, "relaxation_s": 0.8})
    assert closeness(measure(wrong, particles, run(scene, particles).motion)) > 0.04


def test_a_scene_that_does_not_creep_is_refused(shipped):
    _, _, config = shipped

    def naming(creep):
        return config.model_copy(update={"shape_matching": config.shape_matching.but(creep=creep)})

    for name, says in (("nothing", "is unknown"), ("bar_sag", "lacks springs, push, maxwell")):
        with pytest.raises(InputError, match=f"{name}, which {says}"):
            check(naming(Creep(scene=name)), ROOT / "config.yaml")
    check(naming(None), ROOT / "config.yaml")
