"""Free bodies that have to return to their shape while they drift, so that a body at rest is not the answer."""

from collections.abc import Callable
from typing import Any

import numpy as np

from palpate.bodies.particles import Particles
from palpate.studies.hard_cases.hard_case import Answer
from palpate.studies.hard_cases.stage import MODELS, SHAPES, Stepper, edge_error

TRAVEL_M = np.array([0.1, 0.0, 0.0])
"""Distance over which a free body drifts."""
STEPS = (0.01, 2000), (0.05, 400)
"""Step [s] and number of steps of shape matching and of the other models: 20 s."""


def returns(
    model: str, particles: Particles, x: np.ndarray, more: dict[str, Any] | None = None, measure: Callable | None = None
) -> Answer:
    """Simulate a free body from ``x`` (n, 3) [m] for 20 s, with a drift over TRAVEL_M.

    The error is the larger one of ``measure`` at the end, by default that of the edges, and of the centre's place,
    relative to the way that it had to go.
    """
    step_s, steps = STEPS[model not in SHAPES]
    travel = travel_s(model, step_s, steps)
    found, _ = Stepper(model, particles, more).go(x, np.tile(TRAVEL_M / travel, (len(x), 1)), step_s, steps)
    centre = _centre(particles, x) + TRAVEL_M
    shape = measure or (lambda a: edge_error(particles, a))

    def error(a: np.ndarray) -> float:
        strayed = np.linalg.norm(_centre(particles, a) - centre) / np.linalg.norm(TRAVEL_M)
        return max(shape(a), float(strayed))

    return Answer(found, x, error, zero=particles.nodes)


def travel_s(model: str, step_s: float, steps: int) -> float:
    """Return the way [m] of a body that is thrown at 1 m/s, under the model's damping of velocities."""
    decay = float(np.exp(-MODELS[model][1].get("velocity_damping", {}).get("rate_1_s", 0.0) * step_s))
    return step_s * float(np.sum(decay ** np.arange(steps)))


def _centre(particles: Particles, x: np.ndarray) -> np.ndarray:
    return particles.masses @ x / particles.masses.sum()
