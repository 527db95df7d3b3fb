"""The paper's cube, 10 mm and soft, pressed from above for 24 ms."""

from types import SimpleNamespace

import numpy as np
import pytest

from palpate.models.springs.cube_experiment import experiment, paper_cube
from palpate.models.springs.spring_motion import simulate
from palpate.studies.springs.settings import Settings

KEYS = [[0.005, 0.005, 0.01], [0.0, 0.0, 0.01], [0.01, 0.003, 0.006], [0.005, 0.004, 0.005]]


@pytest.fixture(scope="session")
def cube():
    """particles, model, press, settings, and the fitness of a motion that springs of 1500 Pa make."""
    asked = Settings(rise_s=0.01, duration_s=0.024, step_s=0.0004, damping_ratio=0.2, key_points_m=KEYS)
    made = experiment(asked, 0.25)
    press = made.presses["top"]
    motion = simulate(made.model, np.full(120, 1500.0), press, made.settings)
    fitness = made.fitness("top", {"top": motion})
    mesh = paper_cube(0.01)
    return SimpleNamespace(**vars(made), mesh=mesh, press=press, motion=motion, fitness=fitness)
