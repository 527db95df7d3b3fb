"""Reference motion that springs are fitted to: the pressed body with implicit corotational finite elements."""

import numpy as np

from palpate.bodies.particles import Particles
from palpate.effects.held import Held
from palpate.effects.linear_elements import LinearElements
from palpate.effects.rayleigh import Rayleigh
from palpate.models.springs.calibration.spring_model import Press, SpringModel
from palpate.models.springs.calibration.spring_motion import Settings, dampings, stiffnesses
from palpate.solvers.backward_euler import BackwardEuler
from palpate.solvers.system import System

TOLERANCE = 1e-8
"""Relative tolerance of the force balance in each implicit step."""


def reference_motion(
    particles: Particles, model: SpringModel, press: Press, settings: Settings, substeps: int
) -> tuple[np.ndarray, np.ndarray]:
    """Compute positions [m] and velocities [m/s] of the key points after each of the springs' steps, (steps, p, 3).

    particles : those of ``model``, or of a finer level with a ``press`` of its own, whose first nodes are the same
    Damping is that of ``damping_time``. Backward Euler takes ``substeps`` steps in each of the springs': its numerical
    damping, ω h/2 of critical for a mode of frequency ω, is not to be fitted. Raises NotConverged where a step is not
    found.
    """
    elastic = LinearElements(particles, particles.tissue)
    time = damping_time(model, particles.material.young_pa, settings.damping_ratio)
    load = Load(press)
    effects = {"corotational": elastic, "held": Held(particles.held), "push": load}
    system = System(particles, effects | {"rayleigh": Rayleigh(particles.masses, 0.0, time, elastic)})
    integrator = BackwardEuler(system, TOLERANCE)
    x, v = particles.nodes, np.zeros_like(particles.nodes)
    positions, velocities = [], []
    for load.factor in press.factors(settings.step_s / substeps, settings.steps * substeps):
        x, v = integrator.step(x, v, settings.step_s / substeps)
        positions.append(x)
        velocities.append(v)
    recorded = slice(substeps - 1, None, substeps)
    return settings.keys.of(np.array(positions[recorded])), settings.keys.of(np.array(velocities[recorded]))


def damping_time(model: SpringModel, young_pa: float, ratio: float) -> float:
    """Compute β = Σ μ l²/Σ k l² [s] of the springs with one modulus, for damping β K with the FEM stiffness K.

    Then a body that swells at a constant rate loses as much power in C = β K as in the dampers.
    """
    stiffness = stiffnesses(model, np.full(len(model.masses), float(young_pa)))
    squares = model.rest_m**2
    return float((dampings(model, stiffness, ratio) * squares).sum() / (stiffness * squares).sum())


class Load:
    """A press as an effect, whose factor the loop sets."""

    outer = True

    def __init__(self, press: Press):
        self._press, self.factor = press, 0.0

    def add_force(self, x: np.ndarray, v: np.ndarray, force: np.ndarray) -> None:
        """Add the load to ``force`` (n, 3) [N]."""
        force[self._press.node] += self.factor * self._press.force_n
