"""The natural frequency of a settled body in the shape in which its release sets it swinging."""

import numpy as np
from scipy import sparse

from palpate.errors import NotConverged
from palpate.linalg.conjugate_gradients import conjugate_gradients
from palpate.studies.measured.specimen import Specimen

STEPS, ENOUGH, SOLVED = 60, 1e-4, 0.03
"""Most steps; relative error of ω² that ends them; relative residual of the linear solve in each."""


def natural_frequency(
    specimen: Specimen, x: np.ndarray, masses: sparse.csr_array, stiffer: float = 1.0
) -> tuple[float, np.ndarray]:
    """Return the frequency [Hz] of small oscillations around the equilibrium ``x`` (n, 3) [m], and their shape (n, 3).

    The smallest eigenvalue ω² of ``stiffer`` K v = ω² M v by inverse iteration, with Rayleigh's quotient and inexact
    solves, from the way that the release goes: it begins near the mode that the release excites, and keeps the
    symmetry of that, though a beam as wide as high has another mode of the same frequency across. With the residual
    r = ω² M v − K v, the relative error of ω² is about r·K⁻¹r / v·K v, which ends the steps.

    Raises NotConverged if it does not become small, and if the stiffness is not positive definite.
    """
    multiply, precondition = specimen.linearise(x)
    history: list[float] = []
    shape = x - specimen.rest
    shape[specimen.held] = 0.0
    for _ in range(STEPS):
        shape = shape / np.sqrt(np.vdot(shape, masses @ shape))
        pull = multiply(shape)
        squared = float(np.vdot(shape, pull))
        left = squared * (masses @ shape) - pull
        left[specimen.held] = 0.0
        change, _, positive = conjugate_gradients(multiply, precondition, left, SOLVED, 1000)
        if not positive:
            raise NotConverged(
                "a body that has come to rest has a way to give in; its equilibrium is not stable", history
            )
        history.append(float(np.vdot(left, change)) / squared)
        if history[-1] <= ENOUGH:
            return float(np.sqrt(stiffer * squared)) / (2 * np.pi), shape
        shape = shape + change
    raise NotConverged(f"a frequency is still wrong by {history[-1]:.1e} after {STEPS} steps", history)
