"""Separate boxes of particles under shape matching, one step of which is timed (paper 3's figure 3.12)."""

from collections.abc import Callable
from functools import cache

import numpy as np

from palpate.bodies.material import Material
from palpate.bodies.particles import Particles, merge_particles, solid_particles
from palpate.bodies.simple_shapes import box
from palpate.effects import settings, shape_matching
from palpate.solvers import goal_position
from palpate.solvers.system import System

SPACING_M, STEP_S = 0.02, 0.01

DIVISIONS = {100: (3, 4, 4), 1000: (9, 9, 9), 10_000: (19, 19, 24), 100_000: (39, 49, 49)}
"""Cells of a box by its number of particles."""

EDGES = {8: 0.6, 18: 0.5}
"""Sides of the cubes / the box's longest side, by the number of clusters; 18 for 100 particles only."""


@cache
def _objects(particles: int, objects: int) -> Particles:
    """Make ``objects`` separate boxes of ``particles`` each, side by side in one body."""
    divisions = DIVISIONS[particles]
    mesh = box([SPACING_M * n for n in divisions], list(divisions))
    free = solid_particles(mesh, np.empty(0, dtype=np.int64), Material(3000.0, 0.3, 1000.0), "boxes")
    shifts = [[2 * SPACING_M * divisions[0] * number, 0.0, 0.0] for number in range(objects)]
    return merge_particles([free] * objects, shifts, "boxes")


def stepper(
    particles: int, objects: int, clusters: int, mode: str
) -> tuple[Callable[[], None], shape_matching.ShapeMatching]:
    """Return a function without arguments that takes one step of perturbed ``objects``, and their shape matching."""
    bodies = _objects(particles, objects)
    described = settings.Clusters()
    if clusters > 1:
        edge = EDGES[clusters] * SPACING_M * max(DIVISIONS[particles])
        described = settings.Clusters(kind="cubes", edge_m=edge, overlap=0.25)
    matching = shape_matching.make(bodies, settings.ShapeMatching.model_validate({"mode": mode, "clusters": described}))
    integrator = goal_position.make(System(bodies, {"shape_matching": matching}))
    perturbation = 0.1 * SPACING_M * np.random.default_rng(0).normal(size=bodies.nodes.shape)
    x, v = bodies.nodes + perturbation, np.zeros_like(perturbation)

    def step() -> None:
        nonlocal x, v
        x, v = integrator.step(x, v, STEP_S)

    step()
    return step, matching
