"""Answer a touch with a network of springs on the edges of a level, whose nodes a penalty keeps out of the instrument.

Springs have the moduli of the material (Van Gelder 1998), and with a volume force its bulk modulus, too. All are then
multiplied by one factor, by which forces fit those of calibrating touches.
"""

import numpy as np

from palpate.benchmark.model import Setting, on_own_levels, refuse_bed, refuse_regions
from palpate.benchmark.touch import Touch, TouchCase, Touched
from palpate.bodies.particles import particles_of
from palpate.effects.instrument import Pose
from palpate.effects.instrument_penalty import NodeContact
from palpate.effects.springs import make
from palpate.effects.volume_preservation import Volume
from palpate.linalg.multigrid import Factor
from palpate.models.springs.fitness import volume_stiffness
from palpate.models.springs.mass_spring import LoadedSprings
from palpate.models.springs.spring_motion import spring_model
from palpate.models.touch.pushing import NodeTouch, Relaxing, calibration, force_scale
from palpate.solvers.pressed_descent import STILL, PressedDescent

LAW = "springs"
PENALTY, TOLERANCE, MEMORY = 100.0, 1e-6, 8
"""Stiffness of a node's contact over its own; residual relative to the push before a step; and steps remembered."""
CALIBRATING_ITERATIONS = 100
"""Iterations with which springs are calibrated: a factor is that of springs at rest, whatever a setting affords."""


def settings(case: TouchCase, volume: bool) -> list[Setting]:
    """List levels that the body has, and iterations."""
    return on_own_levels(case, case.grid.springs)


class SpringsTouch(NodeTouch):
    """A network that makes so many quasi-Newton iterations at each step of the instrument.

    InputError for a body that nothing holds, LeftOut for one on a bed, NotConverged for one of several stiffnesses.
    """

    def __init__(self, case: TouchCase, level: int, iterations: int, volume: bool):
        refuse_bed(case, "springs that are calibrated under an instrument")  # a factor would stiffen the bed
        refuse_regions(case, "springs")
        super().__init__(case, level)
        particles = particles_of(case.body, level, surface=False)
        network, springs = LoadedSprings(particles), make(particles, None)
        kappa = volume_stiffness(spring_model(particles), particles.material) if volume else 0.0
        volumes = {"volume": Volume(particles, kappa)} if kappa > 0.0 else {}
        network.act(springs, **volumes)
        matrix = network.stiffness(network.rest)
        self._penalty = PENALTY * matrix.diagonal().reshape(-1, 3).mean(axis=1)
        self._solve, self._own = Factor(matrix).solve, [springs, *volumes.values()]
        self._iterations, self._scale = CALIBRATING_ITERATIONS, 1.0
        self._scale = case.share(("factor of springs", level, volume), lambda: self._fitted(case))
        self._iterations = iterations

    def _fitted(self, case: TouchCase) -> float:
        touches, right = zip(*calibration(case), strict=True)
        return force_scale([self.respond(touch) for touch in touches], right)

    def respond(self, touch: Touch) -> Touched:
        found = super().respond(touch)
        return found._replace(force_n=self._scale * found.force_n, reaction_n=self._scale * found.reaction_n)

    def begin(self, nodes: np.ndarray, pose: Pose) -> Relaxing:
        contact = NodeContact(nodes, self._penalty[nodes], pose)
        descent = PressedDescent(self._own, contact, self.held, self._solve, isotropic=False)
        return Relaxing(contact, lambda x: descent.relax(x, self._iterations, MEMORY, TOLERANCE), contact.pushes)

    def supported(self, x: np.ndarray) -> np.ndarray:
        force = np.zeros_like(x)
        for effect in self._own:
            effect.add_force(x, STILL, force)
        return force[self.held].sum(axis=0)


online = SpringsTouch
