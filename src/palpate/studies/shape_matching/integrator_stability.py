"""Growth of a spring's oscillation in a step of each integrator: by paper 3's matrices, and in a simulation.

The growth of a simulation is the slope of the logarithm of its amplitude over many steps, because ratios of single
steps oscillate. The amplitude is the norm of displacement and velocity / frequency, in which a free oscillation is
nearly a circle. It is reset to a small value after each step, so that the spring stays linear and nothing overflows.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pandas as pd

from palpate.bodies.material import Material
from palpate.bodies.particles import Particles
from palpate.effects.held import Held
from palpate.effects.settings import Stepping
from palpate.effects.springs import Springs
from palpate.solvers import backward_euler, goal_position, symplectic_euler
from palpate.solvers.system import Integrator, System
from palpate.table_declaration import Table

MASS_KG, STIFFNESS_N_M, REST_M, SIZE_M = 0.04, 25.0, 1.0, 1e-5
FREQUENCY = math.sqrt(STIFFNESS_N_M / MASS_KG)
RELATIVE_STEPS = np.geomspace(0.01, 100.0, 41)
"""Values of h/sqrt(m/k) in the table."""
LENGTH = 400
"""Number of steps of a simulation."""
NODES = np.array([[-REST_M, 0.0, 0.0], [0.0, 0.0, 0.0]])
"""Held end of the spring, and the mass; its rest is the origin, where displacements lose no digits."""

STABILITY = Table(
    "integrator_stability",
    "The predicted and the measured growth of an oscillator under each time integrator, over the length of the step.",
    """
    scheme alpha h_over_sqrt_m_k: an integrator, α of its goals, and the step / sqrt(m/k)
    spectral_radius growth_measured: growth a step, of the scheme's matrix and in a simulation
    limit_stated blow_up_measured: step / sqrt(m/k) at the limit of stability, inf where there is none
    """,
)


def measure(alphas: list[float]) -> pd.DataFrame:
    """Measure the rows of integrator_stability.csv: growth a step and limits of each scheme over h/sqrt(m/k).

    alphas : stiffnesses of the goal-position schemes
    The measured limit is searched by bisection between the smallest and the largest step of the table.
    """
    rows = []
    for case in cases(alphas):
        integrator = case.integrator()
        stated, measured = FREQUENCY * integrator.limit_s, _blow_up(case, integrator)
        for step in RELATIVE_STEPS:
            growth = math.exp(np.polyfit(np.arange(LENGTH), _log_amplitudes(case, integrator, step), 1)[0])
            rows.append((case.scheme, case.alpha, step, case.radius(step), growth, stated, measured))
    return STABILITY.frame(rows)


@dataclass(frozen=True)
class Case:
    """One scheme: its constructor, its matrix (2, 2) by h/sqrt(m/k) and α, and the α of its goals or nan.

    The matrix leads from velocity over frequency and displacement to those after a step.
    """

    scheme: str
    make: Callable
    matrix: Callable[[float, float], np.ndarray | list[list[float]]]
    alpha: float = math.nan

    def radius(self, step: float) -> float:
        """Return the spectral radius of the matrix for ``step``, h/sqrt(m/k): the growth of a step."""
        return float(np.abs(np.linalg.eigvals(np.array(self.matrix(step, self.alpha)))).max())

    def integrator(self):
        """Make the scheme's integrator for a mass on a spring along x or, for goal positions, with its goal at rest."""
        none, material = np.empty((0, 3), dtype=np.int64), Material(1.0, 0.0, 1.0)
        particles = Particles("spring", NODES, np.full(2, MASS_KG), np.array([0]), none, none, material)
        spring = Springs(np.array([[0, 1]]), np.array([STIFFNESS_N_M]), np.array([REST_M]))
        elastic = spring if math.isnan(self.alpha) else _Goal(self.alpha)
        return self.make(
            System(particles, {"elastic": elastic, "held": Held(particles.held)}), Stepping(step_s=1.0, duration_s=1.0)
        )

    def frequency(self, h: float) -> float:
        """Return the frequency [1/s]: sqrt(k/m), or sqrt(α)/h, since goals have the stiffness α m/h²."""
        return FREQUENCY if math.isnan(self.alpha) else math.sqrt(self.alpha) / h


class _Goal:
    """The goal of paper 3's scheme for one particle: its rest position."""

    def __init__(self, alpha: float):
        self.alpha = alpha

    def goals(self, x: np.ndarray, out: np.ndarray) -> None:
        out[:] = NODES


def cases(alphas: list[float]) -> list[Case]:
    """Return the schemes that are compared."""
    return [
        Case("symplectic_euler", symplectic_euler.make, lambda s, a: [[1.0, -s], [s, 1.0 - s**2]]),
        *(Case("goal_position", goal_position.make, lambda s, a: [[1.0, -a], [1.0, 1.0 - a]], each) for each in alphas),
        Case("backward_euler", backward_euler.make, lambda s, a: np.linalg.inv([[1.0, s], [-s, 1.0]])),
    ]


def _log_amplitudes(case: Case, integrator: Integrator, step: float) -> np.ndarray:
    """Return the logarithm of the amplitude / SIZE_M after each of LENGTH steps of ``step`` sqrt(m/k), (LENGTH,)."""
    h = step / FREQUENCY
    frequency, logs, log_growth = case.frequency(h), np.empty(LENGTH), 0.0
    displacement, scaled_velocity = SIZE_M, 0.0
    for i in range(LENGTH):
        x, v = NODES.copy(), np.zeros((2, 3))
        x[1, 0], v[1, 0] = displacement, frequency * scaled_velocity
        x, v = integrator.step(x, v, h)
        displacement, scaled_velocity = x[1, 0], v[1, 0] / frequency
        amplitude = math.hypot(displacement, scaled_velocity)
        log_growth += math.log(amplitude / SIZE_M)
        logs[i] = log_growth
        displacement, scaled_velocity = SIZE_M * displacement / amplitude, SIZE_M * scaled_velocity / amplitude
    return logs


def _blow_up(case: Case, integrator: Integrator) -> float:
    """Search the smallest h/sqrt(m/k), to 1e-4, at which the amplitude grows by a factor of 1000; inf if none does.

    At the double eigenvalue −1 the amplitude grows linearly, by a much smaller factor, which does not count.
    """
    stable, unstable = math.log(RELATIVE_STEPS[0]), math.log(RELATIVE_STEPS[-1])
    if _log_amplitudes(case, integrator, RELATIVE_STEPS[-1])[-1] < math.log(1e3):
        return math.inf
    while unstable - stable > 1e-4:
        middle = 0.5 * (stable + unstable)
        if _log_amplitudes(case, integrator, math.exp(middle))[-1] < math.log(1e3):
            stable = middle
        else:
            unstable = middle
    return math.exp(unstable)
