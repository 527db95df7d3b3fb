"""A release as a scene computes it, step by step, with linear elements and backward Euler."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from palpate.bodies.body import Body
from palpate.bodies.particles import Particles, particles_of
from palpate.effects.effect import Effect, Energy
from palpate.effects.elements import locking_is_measured
from palpate.effects.gravity import Gravity
from palpate.effects.held import Held
from palpate.scenes.effect_registry import effect
from palpate.solvers.backward_euler import make
from palpate.solvers.system import System
from palpate.studies.measured.experiment import Weight
from palpate.studies.measured.loads import hung_masses, nodal_loads
from palpate.studies.measured.oscillation import Oscillation, fit_oscillation
from palpate.studies.measured.specimen import Bench

TOLERANCE = 1e-6
"""Relative residual of each step."""


@dataclass(frozen=True, eq=False)
class Release:
    """A body that is let go from rest at once, and how that is computed.

    bench : linear elements on a ``level`` of ``body``, for the markers; softness : how many times softer it is
    prony : settings of the effect of that name, or None
    """

    body: Body
    level: int
    bench: Bench
    softness: float
    step_s: float
    duration_s: float
    prony: Mapping[str, Any] | None = None

    def swing(self, weights: Sequence[Weight], gravity: np.ndarray) -> Oscillation:
        """Compute the release under ``gravity`` (3,) [m/s²] and ``weights``, and fit the mean way of the markers.

        Raises NotConverged as ``BackwardEuler``, InputError if nothing swings.
        """
        system = self._system(weights, gravity)
        integrator = make(system, {"tolerance": TOLERANCE})
        x = self.bench.specimen.rest.copy()
        v, way = np.zeros_like(x), [self.bench.moves(x).mean(axis=0)]
        steps = int(np.ceil(self.duration_s / self.step_s))
        for step in range(steps):
            system.at((step + 1) * self.step_s)
            x, v = integrator.step(x, v, self.step_s)
            system.relax(x, self.step_s)
            way.append(self.bench.moves(x).mean(axis=0))
        along = np.array(way) @ (way[-1] / np.linalg.norm(way[-1]))
        first, times = int(np.argmax(along)), self.step_s * np.arange(steps + 1)
        place = f"{self.body.name}: a release in steps of {self.step_s:g} s"
        return fit_oscillation(times[first:], along[first:], place, creeps=self.prony is not None)

    def _system(self, weights: Sequence[Weight], gravity: np.ndarray) -> System:
        """Compose elements, masses and loads.

        What hangs on the body adds to the masses of nodes, and so to their weight. In place of softer elements, which
        regions of a body would need one by one, masses and loads are larger: the motion is the same.
        """
        particles, mesh = particles_of(self.body, self.level, surface=False), self.body.levels[self.level]
        size = float(np.linalg.norm(gravity))
        hung = hung_masses(mesh, weights, size, order=1).sum(axis=1)
        particles = replace(particles, masses=self.softness * (particles.masses + hung))
        law = particles.material.law
        with locking_is_measured():
            elastic = effect(law).make(particles, {}, None)
        effects: dict[str, Effect] = {
            law: elastic,
            "gravity": Gravity(particles, gravity),
            "held": Held(particles.held),
        }
        if forces := [weight for weight in weights if weight.force_n is not None]:
            load = self.softness * nodal_loads(mesh, forces, gravity / size, order=1)
            effects["load"] = DeadLoad(particles, load)
        if self.prony is not None:
            effects["prony"] = effect("prony").make(particles, dict(self.prony), elastic)
        return System(particles, effects)


class DeadLoad(Energy):
    """A constant force on each node, (n, 3) [N]; its energy is zero at rest."""

    def __init__(self, particles: Particles, force: np.ndarray):
        self._force, self._rest = force, particles.nodes

    def energy(self, x: np.ndarray) -> float:
        """Return minus the work of the load [J] at ``x`` (n, 3) [m]."""
        return -float(np.vdot(self._force, x - self._rest))

    def add_force(self, x: np.ndarray, v: np.ndarray, force: np.ndarray) -> None:
        """Add the load to ``force`` (n, 3) [N]."""
        force += self._force
