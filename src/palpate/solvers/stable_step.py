"""How long a step of symplectic Euler may be."""

import math

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import eigsh

from palpate.solvers.system import System

SMALL = 120
"""Unknowns up to which all eigenvalues are found at once: the iteration needs more of them."""


def stable_step(system: System, taken: float = 0.0) -> float:
    """The step h [s] with h² λ_K + 2 h λ_C = 4 − ``taken``, λ being the largest eigenvalues of M⁻¹K and M⁻¹C at rest.

    A mode of frequency² a and damping rate c is multiplied by the roots of z² − (2 − hc − h²a) z + (1 − hc) each
    step, which are in the unit circle up to h² a + 2 h c = 4; without damping up to 2 sqrt(m/k) (paper 3). In any
    mode of the whole a and c are means over the body, a ≤ λ_K and c ≤ λ_C: the limit is sufficient. A decay of
    velocities that effects project at the end of the step takes the right side to 2 at worst. ``taken`` is the part
    that goals take, α.
    inf if nothing has stiffness or damping.
    """
    rest, free = system.particles.nodes, system.free
    scale = 1.0 / np.sqrt(np.repeat(system.masses[free], 3))
    unknowns = np.repeat(free, 3)
    a = _largest(system.stiffness(rest, definite=True), unknowns, scale)
    c = _largest(system.damping(rest, explicit=True), unknowns, scale)
    if a + c == 0.0:
        return math.inf
    decays = any(hasattr(effect, "add_damping") for _, effect in system.offering("project"))
    room = (2.0 if decays else 4.0) - taken
    return room / (c + math.sqrt(c * c + room * a))  # the root without cancellation, also for a = 0


def _largest(matrix: sparse.bsr_array | None, unknowns: np.ndarray, scale: np.ndarray) -> float:
    """The largest eigenvalue of M⁻¹ ``matrix`` on the ``unknowns`` (3n,) bool, ``scale`` being M^(−1/2)."""
    if matrix is None or not len(scale):
        return 0.0
    matrix = matrix.tocsr()[unknowns][:, unknowns]
    matrix = (sparse.diags_array(scale) @ matrix @ sparse.diags_array(scale)).tocsr()
    if not matrix.data.any():
        return 0.0
    if len(scale) <= SMALL:
        return float(np.linalg.eigvalsh(matrix.toarray())[-1])
    # a start of its own, so that the result repeats; not of ones, which a translation makes a mode without stiffness
    start = np.random.default_rng(0).normal(size=len(scale))
    return float(eigsh(matrix, k=1, which="LA", v0=start, tol=1e-5, return_eigenvectors=False)[0])
