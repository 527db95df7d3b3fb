"""Modes that a motion is reduced to: vibrations, answers to loads at some places, and how those bend as they grow."""

from collections.abc import Callable, Sequence
from itertools import combinations_with_replacement

import numpy as np
from scipy import sparse

from palpate.effects.elements import Elements

STEP = 0.01
"""Largest displacement of a column at which its bend is measured, in sizes of the body."""
SMALL = 1e-9
"""Columns count as dependent below this eigenvalue of their Gram matrix, in parts of its largest."""

Solve = Callable[[np.ndarray], np.ndarray]
"""The inverse of the stiffness at rest: forces (n, 3) [N] to displacements (n, 3) [m], zero at held nodes."""


def bends(elastic: Elements, rest: np.ndarray, solve: Solve, columns: np.ndarray, size: float) -> np.ndarray:
    """Compute the static derivatives −K⁻¹ ∂²f[a, b] of all pairs of ``columns`` (k, n, 3): (k (k + 1) / 2, n, 3).

    Columns are scaled to a peak of 1 before; ∂²f, f being the elastic restoring force, is by central differences at
    STEP · ``size`` [m] (Idelsohn and Cardona 1985; Barbič and James 2005, section 4).
    """
    scaled = columns / np.linalg.norm(columns, axis=2).max(axis=1)[:, None, None]
    h = STEP * size

    def curvature(u: np.ndarray) -> np.ndarray:
        return -(elastic.force(rest + h * u) + elastic.force(rest - h * u)) / h**2

    own = [curvature(u) for u in scaled]
    found = []
    for a, b in combinations_with_replacement(range(len(scaled)), 2):
        mixed = own[a] if a == b else 0.5 * (curvature(scaled[a] + scaled[b]) - own[a] - own[b])
        found.append(-solve(mixed))
    return np.array(found).reshape(-1, *rest.shape)


def orthonormal(columns: Sequence[np.ndarray], stiffness: sparse.sparray) -> np.ndarray:
    """Return columns (3n, r) that span those given, each (k, n, 3), and are orthonormal in ``stiffness`` (3n, 3n).

    Columns that depend on others are left out, so r may be less than the number given.
    """
    v = np.concatenate([each.reshape(len(each), -1) for each in columns if len(each)]).T
    v = v[:, np.abs(v).max(axis=0) > 0.0]
    v = v / np.sqrt(np.einsum("ij,ij->j", v, stiffness @ v))
    values, turns = np.linalg.eigh(v.T @ (stiffness @ v))
    kept = values > SMALL * values[-1]
    return v @ (turns[:, kept] / np.sqrt(values[kept]))


def uncoupled(columns: np.ndarray, masses: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Turn ``columns`` (3n, r), so that mass couples them no longer; return them, and the mass (r,) of each.

    masses : (n,) [kg]. Columns that are orthonormal in the stiffness stay so.
    """
    own, turns = np.linalg.eigh(columns.T @ (np.repeat(masses, 3)[:, None] * columns))
    return np.ascontiguousarray(columns @ turns), own
