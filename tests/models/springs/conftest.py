"""The paper's cube, 10 mm and soft, pressed from above for 24 ms."""

from types import SimpleNamespace

import numpy as np
import pytest

from palpate.bodies.material import Material
from palpate.bodies.particles import solid_particles
from palpate.models.springs.cube_experiment import middle, paper_cube
from palpate.models.springs.fitness import Fitness
from palpate.models.springs.spring_motion import Press, Settings, key_points, simulate, spring_model

KEYS = [[0.005, 0.005, 0.01], [0.0, 0.0, 0.01], [0.01, 0.003, 0.006], [0.005, 0.004, 0.005]]


@pytest.fixture(scope="session")
def cube():
    """particles, model, press, settings, and the fitness of a motion that springs of 1500 Pa make."""
    mesh = paper_cube(0.01)
    particles = solid_particles(mesh, np.flatnonzero(mesh.nodes[:, 2] == 0.0), Material(1000.0, 0.25, 1000.0), "cube")
    model = spring_model(particles)
    node, inward = middle(mesh, "top")
    press = Press("top", node, 0.001 * inward, 0.01)
    keys = key_points(mesh.nodes, mesh.tetrahedra, KEYS)
    settings = Settings(0.0004, 60, 0.2, keys)
    motion = simulate(model, np.full(120, 1500.0), press, settings)
    fitness = Fitness(model, press, settings, *motion)
    return SimpleNamespace(
        mesh=mesh, particles=particles, model=model, press=press, settings=settings, motion=motion, fitness=fitness
    )
