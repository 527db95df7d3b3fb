"""Two scenes as one would write them for just their effects: no names, clocks or choices.

Newton's method and what it solves with are palpate's own; what calls an effect is by hand.
"""

from collections.abc import Callable

import numpy as np

from palpate.bodies.particles import Particles
from palpate.effects import held, kelvin, linear_elements, push, rayleigh, springs, volume_preservation
from palpate.linalg.block_pattern import hold, shared_pattern
from palpate.scenes.settings import Scene
from palpate.solvers.backward_euler import BackwardEuler


def cube_poke(scene: Scene, particles: Particles) -> Callable[[], np.ndarray]:
    """Return the loop of springs, a volume and dampers by symplectic Euler."""
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
            if not (np.isfinite(x).all() and np.isfinite(v).all()):
                raise FloatingPointError
        return x

    return steps


class Pressed:
    """What backward Euler asks of linear elements with Rayleigh damping that are pushed."""

    bounded = False

    def __init__(self, particles: Particles, scene: Scene):
        self.particles, self.masses = particles, particles.masses
        self.elastic = linear_elements.make(particles, None)
        self.push = push.make(particles, scene.push, self.elastic)
        self.rayleigh = rayleigh.make(particles, scene.rayleigh, self.elastic)
        self.fixed = held.make(particles, None, self.elastic).fixed
        self.free = np.ones(len(particles.nodes), dtype=bool)
        self.free[self.fixed] = False
        self.held = ~self.free
        self.pattern = shared_pattern([self.elastic.couples, self.rayleigh.couples], len(particles.nodes))
        self.blocks = (len(self.pattern.indices), 3, 3)

    def energy(self, x):
        return self.elastic.energy(x)

    def force(self, effect, x):
        force = np.zeros_like(x)
        effect.add_force(x, None, force)
        force[self.fixed] = 0.0
        return force

    def potential_force(self, x):
        return self.force(self.elastic, x)

    def outer_force(self, x, v):
        return self.force(self.push, x)

    def magnitude(self, x, most):
        return float(np.linalg.norm(self.potential_force(x)) + np.linalg.norm(self.outer_force(x, None)))

    def stiffness(self, x, definite):
        values = np.zeros(self.blocks)
        self.elastic.add_stiffness(x, definite, self.pattern.slots[0], values)
        return self.pattern.matrix(values)

    def damping(self, x):
        values = np.zeros(self.blocks)
        self.rayleigh.add_damping(x, self.pattern.slots[1], values)
        return self.pattern.matrix(values)

    def hold(self, matrix):
        hold(matrix.indptr, matrix.indices, matrix.data, self.held)

    def begin(self, x, h):
        return x

    def touching(self, x, definite):
        return None

    def add_work(self, load, motion):
        """Count nothing: this loop reports no energies."""

    def end(self, x):
        """Do nothing: no obstacle is moved."""


def liver_press(scene: Scene, particles: Particles) -> Callable[[], np.ndarray]:
    """Return the loop of elements by backward Euler."""
    system = Pressed(particles, scene)
    integrator = BackwardEuler(system, scene.tolerance)

    def steps():
        x, v, h = particles.nodes.copy(), np.zeros_like(particles.nodes), scene.step_s
        for step in range(scene.steps):
            system.push.at((step + 1) * h)
            x, v = integrator.step(x, v, h)
        return x

    return steps
