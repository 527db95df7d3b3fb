"""The scenes of explicit integrators as one would write them for just their effects: no names, clocks or choices."""

from collections.abc import Callable

import numpy as np

from palpate.bodies.particles import Particles
from palpate.effects import (
    held,
    kelvin,
    plasticity,
    push,
    shape_matching,
    springs,
    velocity_damping,
    volume_preservation,
)
from palpate.scenes.settings import Scene
from palpate.solvers.goal_position import _advance


def cube_poke(scene: Scene, particles: Particles) -> Callable[[], np.ndarray]:
    elastic = springs.make(particles, scene.springs)
    pushed = push.make(particles, scene.push, elastic)
    solid = volume_preservation.make(particles, scene.volume, elastic)
    dampers = kelvin.make(particles, scene.kelvin, elastic)
    h = scene.step_s
    pace = h * (1.0 / particles.masses)[:, None]
    pace[held.make(particles, None, elastic).fixed] = 0.0

    def steps():
        x, v, force = particles.nodes.copy(), np.zeros_like(particles.nodes), np.zeros_like(particles.nodes)
        load, work = np.zeros_like(x), 0.0
        for step in range(scene.steps):
            pushed.at((step + 1) * h)
            force[:] = load[:] = 0.0
            pushed.add_force(x, v, load)
            elastic.add_force(x, v, force)
            force += load
            solid.add_force(x, v, force)
            dampers.add_force(x, v, force)
            v += pace * force
            start, x = x, x + h * v
            work += float(np.vdot(load, x - start))  # a scene's table of energies has it
            _check(x, v)
        return x

    return steps


def clay_shapes(scene: Scene, particles: Particles) -> Callable[[], np.ndarray]:
    h = scene.step_s
    elastic = shape_matching.make(particles, scene.shape_matching)
    pushed = push.make(particles, scene.push, elastic)
    flow = plasticity.make(particles, scene.plasticity, elastic)
    drag = velocity_damping.make(particles, scene.velocity_damping, elastic)
    fixed = held.make(particles, None, elastic).fixed
    free = np.ones(len(particles.nodes), dtype=bool)
    free[fixed] = False
    mobility = 1.0 / particles.masses
    mobility[fixed] = 0.0

    def steps():
        x, v, force = particles.nodes.copy(), np.zeros_like(particles.nodes), np.zeros_like(particles.nodes)
        goals = np.zeros_like(x)
        for step in range(scene.steps):
            pushed.at((step + 1) * h)
            force[:] = 0.0
            pushed.add_force(x, v, force)
            elastic.goals(x, goals)
            _advance(x, v, goals, force, mobility, free, elastic.alpha, h)
            drag.project(x, x, v, h)
            _check(x, v)
            flow.relax(x, h)
        return x

    return steps


def _check(x, v):
    if not (np.isfinite(x).all() and np.isfinite(v).all()):
        raise FloatingPointError
