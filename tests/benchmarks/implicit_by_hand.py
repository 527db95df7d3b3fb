"""The scenes of backward Euler as one would write them for just their effects: no names, clocks or choices.

Newton's method and what it solves with are palpate's own; what calls an effect is by hand.
"""

from collections.abc import Callable

import numpy as np

from palpate.bodies.particles import Particles
from palpate.collision.contact import barrier_contact
from palpate.effects import bending, gravity, held, linear_elements, plasticity, push, rayleigh, triangles
from palpate.linalg.block_pattern import gather, hold, shared_pattern
from palpate.scenes.settings import Scene
from palpate.solvers.backward_euler import BackwardEuler


class ByHand:
    """What backward Euler asks of a system, as far as these scenes have it in common."""

    bounded = False

    def __init__(self, particles: Particles, scene: Scene):
        self.particles, self.masses = particles, particles.masses
        self.make(particles, scene)
        self.rayleigh = rayleigh.make(particles, scene.rayleigh, self.elastic)
        self.fixed = held.make(particles, None, self.elastic).fixed
        self.free = np.ones(len(particles.nodes), dtype=bool)
        self.free[self.fixed] = False
        self.held = ~self.free
        self.pattern = shared_pattern(self.couples(), len(particles.nodes))
        self.blocks = (len(self.pattern.indices), 3, 3)

    def couples(self) -> list[np.ndarray]:
        return [self.elastic.couples, self.rayleigh.couples]

    def stiffness(self, x, definite):
        values = np.zeros(self.blocks)
        self.elastic.add_stiffness(x, definite, self.pattern.slots[0], values)
        return self.pattern.matrix(values)

    def damping(self, x):
        values = np.zeros(self.blocks)
        self.rayleigh.add_damping(x, self.pattern.slots[1], values)
        return self.pattern.matrix(values)

    def outer_force(self, x, v):
        return np.zeros_like(x)

    def begin(self, x, h):
        return x

    def touching(self, x, definite):
        return None

    def add_work(self, load, motion):
        """Count nothing: these loops report no energies."""

    def end(self, x):
        """Do nothing: no obstacle is moved."""

    def hold(self, matrix):
        hold(matrix.indptr, matrix.indices, matrix.data, self.held)

    def norm(self, effect, x):
        force = np.zeros_like(x)
        effect.add_force(x, None, force)
        force[self.fixed] = 0.0
        return float(np.linalg.norm(force))


class Pushed(ByHand):
    def make(self, particles, scene):
        self.elastic = linear_elements.make(particles, None)
        self.push = push.make(particles, scene.push, self.elastic)

    def energy(self, x):
        return self.elastic.energy(x)

    def potential_force(self, x):
        force = np.zeros_like(x)
        self.elastic.add_force(x, None, force)
        force[self.fixed] = 0.0
        return force

    def outer_force(self, x, v):
        force = np.zeros_like(x)
        self.push.add_force(x, v, force)
        force[self.fixed] = 0.0
        return force

    def magnitude(self, x, most):
        return self.norm(self.elastic, x) + self.norm(self.push, x)


class Sagging(ByHand):
    def make(self, particles, scene):
        self.elastic = linear_elements.make(particles, None)
        self.gravity = gravity.make(particles, scene.gravity, self.elastic)

    def energy(self, x):
        return self.elastic.energy(x) + self.gravity.energy(x)

    def potential_force(self, x):
        force = np.zeros_like(x)
        self.elastic.add_force(x, None, force)
        self.gravity.add_force(x, None, force)
        force[self.fixed] = 0.0
        return force

    def magnitude(self, x, most):
        return self.norm(self.elastic, x) + self.norm(self.gravity, x)


class Draped(ByHand):
    bounded = True

    def make(self, particles, scene):
        self.elastic = triangles.make(particles, None)
        self.gravity = gravity.make(particles, scene.gravity, self.elastic)
        self.bending = bending.make(particles, None, self.elastic)
        self.contact = barrier_contact.make(particles, scene.contact, self.elastic)
        self.contact.hold(held.make(particles, None, self.elastic).fixed)
        self.begin, self.limit, self.end = self.contact.begin, self.contact.limit, self.contact.end

    def couples(self):
        return [*super().couples(), self.bending.couples]

    def touching(self, x, definite):
        return gather([self.contact.touching(x, definite)], len(x))

    def energy(self, x):
        return self.elastic.energy(x) + self.gravity.energy(x) + self.bending.energy(x) + self.contact.energy(x)

    def potential_force(self, x):
        force = np.zeros_like(x)
        self.elastic.add_force(x, None, force)
        self.gravity.add_force(x, None, force)
        self.bending.add_force(x, None, force)
        self.contact.add_force(x, None, force)
        force[self.fixed] = 0.0
        return force

    def magnitude(self, x, most):
        solid = self.norm(self.elastic, x) + self.norm(self.gravity, x)
        return solid + self.norm(self.bending, x) + min(self.norm(self.contact, x), most)

    def stiffness(self, x, definite):
        values = np.zeros(self.blocks)
        self.elastic.add_stiffness(x, definite, self.pattern.slots[0], values)
        self.bending.add_stiffness(x, definite, self.pattern.slots[2], values)
        return self.pattern.matrix(values)


def stepping(system: ByHand, scene: Scene, before: Callable, after: Callable) -> Callable[[], np.ndarray]:
    """Return the loop of a scene: what moves is moved to the end of each step, and what flows or slides does after."""
    integrator = BackwardEuler(system, scene.tolerance)

    def steps():
        x, v, h = system.particles.nodes.copy(), np.zeros_like(system.particles.nodes), scene.step_s
        for step in range(scene.steps):
            before((step + 1) * h)
            x, v = integrator.step(x, v, h)
            after(x, h)
        return x

    return steps


def nothing(*_) -> None:
    """Do nothing."""


def liver_press(scene: Scene, particles: Particles) -> Callable[[], np.ndarray]:
    system = Pushed(particles, scene)
    return stepping(system, scene, system.push.at, nothing)


def clay_dent(scene: Scene, particles: Particles) -> Callable[[], np.ndarray]:
    system = Pushed(particles, scene)
    flow = plasticity.make(particles, scene.plasticity, system.elastic)
    return stepping(system, scene, system.push.at, flow.relax)


def bar_sag(scene: Scene, particles: Particles) -> Callable[[], np.ndarray]:
    return stepping(Sagging(particles, scene), scene, nothing, nothing)


def sheet_drape(scene: Scene, particles: Particles) -> Callable[[], np.ndarray]:
    system = Draped(particles, scene)
    return stepping(system, scene, system.contact.at, system.contact.relax)
