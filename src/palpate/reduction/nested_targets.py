"""Correct a reduced answer by what snapshots change from one level to the next."""

from typing import NamedTuple

import numpy as np
from scipy import sparse

from palpate.reduction.columns import linear_columns
from palpate.reduction.contact_snapshots import ContactSnapshots
from palpate.reduction.elements_at_rest import ElementsAtRest

STEPS, RESIDUAL = 20, 1e-4
"""Steps of L-BFGS on the coarser level, which is cheap, and the residual that ends them."""
SMOOTH = 0.005
"""Weight of the fit's penalty, over the largest singular value of what it is fitted to."""


class CoarserLevel(NamedTuple):
    """The level before that of the snapshots, and what a snapshot changes on the way.

    linear : (n_surface, 3, 3) [m/N], the columns of the level before
    bent : (n_surface, 3, s) [m], the part of each snapshot beyond its linear one: its change from that level
    """

    linear: np.ndarray
    bent: np.ndarray


def coarser_level(
    snapshots: ContactSnapshots,
    coarse: ElementsAtRest,
    carried: tuple[np.ndarray, np.ndarray],
    up: sparse.csr_array,
    up_coarse: sparse.csr_array,
) -> CoarserLevel:
    """Press the contact on the level before, under the forces of ``snapshots``.

    carried : nodes (k,) and shares (k,) of the disc on ``coarse``; up, up_coarse : from either level's nodes to the
        surface, (n_surface, ·)
    """
    linear, count = linear_columns(coarse, *carried), len(coarse.rest)
    moved = [
        coarse.settle(coarse.nodal(*carried, force), snapshots.answers[:count, :, s].copy(), STEPS, RESIDUAL)
        for s, force in enumerate(snapshots.forces)
    ]
    before = np.stack(moved, axis=2) - linear @ snapshots.forces.T
    after = snapshots.answers - snapshots.linear @ snapshots.forces.T
    bent = to_surface(up, after) - to_surface(up_coarse, before)
    return CoarserLevel(to_surface(up_coarse, linear), bent)


def to_surface(up: sparse.csr_array, moved: np.ndarray) -> np.ndarray:
    """Return (n_surface, 3, k) of displacements ``moved`` (n, 3, k) by the interpolation ``up`` (n_surface, n)."""
    return (up @ moved.reshape(len(moved), -1)).reshape(-1, *moved.shape[1:])


def fitted(seen: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Fit the matrix (n, 3, r) whose products with ``seen`` (r, s) are ``wanted`` (n, 3, s), by penalised squares.

    Each of the s pairs counts over its size, so that weak presses are met as well as hard ones.
    """
    norms = np.linalg.norm(seen, axis=0)
    weights = np.divide(1.0, norms, out=np.zeros_like(norms), where=norms > 0.0)
    left, sizes, right = np.linalg.svd(seen * weights, full_matrices=False)
    damped = sizes / (sizes**2 + (SMOOTH * sizes[0]) ** 2)
    return (((wanted * weights) @ right.T) * damped) @ left.T
