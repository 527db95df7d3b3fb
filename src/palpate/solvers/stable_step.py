"""The longest stable step of the explicit integrators."""

import math

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import eigsh

from palpate.effects.effect import Damping, Projection, offers
from palpate.solvers.system import System

SMALL = 120
"""Up to this number of unknowns all eigenvalues are computed, as the iterative method needs more unknowns."""


def stable_step(system: System, taken: float = 0.0) -> float:
    """Return the step h [s] with h² λ_K + 2 h λ_C = 4 − ``taken``; infinite without stiffness and damping.

    λ_K and λ_C are the largest eigenvalues of M⁻¹K and M⁻¹C at rest. In each step a mode of frequency² a and damping
    rate c is multiplied by the roots of z² − (2 − hc − h²a) z + (1 − hc), which are in the unit circle up to
    h² a + 2 h c = 4; without damping that is h = 2 sqrt(m/k) (paper 3). In a mode of the whole body a and c are means
    over it, a ≤ λ_K and c ≤ λ_C, so the condition is sufficient. A decay of velocities by a projection at the end of
    the step reduces the right side to 2 in the worst case.

    taken : the share of goal positions in the right side, α
    """
    rest, free = system.particles.nodes, system.free
    scale = 1.0 / np.sqrt(np.repeat(system.masses[free], 3))
    unknowns = np.repeat(free, 3)
    a = _largest(system.stiffness(rest, definite=True), unknowns, scale)
    c = _largest(system.damping(rest, explicit=True), unknowns, scale)
    if a + c == 0.0:
        return math.inf
    decays = any(offers(effect, Damping) for _, effect in system.offering(Projection))
    room = (2.0 if decays else 4.0) - taken
    return room / (c + math.sqrt(c * c + room * a))  # the root without cancellation, also for a = 0


def _largest(matrix: sparse.bsr_array | None, unknowns: np.ndarray, scale: np.ndarray) -> float:
    """Return the largest eigenvalue of M⁻¹ ``matrix`` on the ``unknowns`` (3n,) bool; ``scale`` is M^(−1/2)."""
    if matrix is None or not len(scale):
        return 0.0
    matrix = matrix.tocsr()[unknowns][:, unknowns]
    matrix = (sparse.diags_array(scale) @ matrix @ sparse.diags_array(scale)).tocsr()
    if not matrix.data.any():
        return 0.0
    if len(scale) <= SMALL:
        return float(np.linalg.eigvalsh(matrix.toarray())[-1])
    # a fixed start, so that the result is reproducible; not all ones: a translation has no stiffness
    start = np.random.default_rng(0).normal(size=len(scale))
    return float(eigsh(matrix, k=1, which="LA", v0=start, tol=1e-5, return_eigenvectors=False)[0])
