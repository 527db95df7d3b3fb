"""Presses of one contact that its model is made from: in nine directions as hard as tissue bears."""

import numpy as np

from palpate.models.reduction.reduced_contact import ReducedContact

TILTS = [(0.0, 1, 0.0), (25.0, 4, 45.0), (45.0, 4, 0.0)]
"""Angle to the inward normal, number of directions, and where the first of them points [degrees]."""
CORNERS = (0, 5, 6, 7, 8)
"""Numbers of the straight direction and the most tilted ones."""
SHARES = (1.0, 0.5)
"""Parts of the hardest press in a direction of which snapshots are taken."""
PRESSURE, PEAK, SQUEEZED = 0.25, 0.2, 0.5
"""The hardest press: peak pressure over Young's modulus and peak displacement over the body's size, neither of which
it exceeds, and the smallest det F, which no cell falls below. Presses of the trade-off are limited alike."""
FALL, FALLS = 0.8, 20
"""Factor by which a press that is too hard is lowered, and how often."""


def directions(normal: np.ndarray) -> np.ndarray:
    """Return the unit vectors (9, 3) of the presses on a surface of outward ``normal`` (3,)."""
    return np.array([_tilted(-normal, tilt, turn + 360.0 * k / n) for tilt, n, turn in TILTS for k in range(n)])


def likeness(known: np.ndarray, force: np.ndarray, order: int) -> np.ndarray:
    """Return weights (s,) of what is ``known`` under forces (s, 3) [N], whose sum is expected under ``force`` (3,) [N].

    It grows with the power ``order`` of the force, and the next one: kernel ridge regression with a kernel of these.
    """
    scale = np.linalg.norm(known, axis=1).max()

    def kernel(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        product = a @ b.T / scale**2
        return product**order + product ** (order + 1)

    return np.linalg.solve(kernel(known, known) + 1e-3 * np.eye(len(known)), kernel(known, force))


def hardest(model: ReducedContact, moved: np.ndarray, direction: np.ndarray, newtons: float, size: float) -> np.ndarray:
    """Return the force (3,) [N] along ``direction`` (3,), of at most ``newtons``, that PEAK and SQUEEZED allow.

    moved : (k, 3, r) [m], displacements of the surface by coordinate; size : of the body [m]
    """
    for _ in range(FALLS):
        found = model.settle(newtons * direction, 1e-3)
        peak = np.linalg.norm(moved @ found.q, axis=1).max()
        if found.residual <= 1e-3 and found.least_det >= SQUEEZED and peak <= PEAK * size:
            break
        newtons *= FALL
    return newtons * direction


def _tilted(axis: np.ndarray, tilt: float, turn: float) -> np.ndarray:
    across = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
    across /= np.linalg.norm(across)
    a, b = np.deg2rad(tilt), np.deg2rad(turn)
    return np.cos(a) * axis + np.sin(a) * (np.cos(b) * across + np.sin(b) * np.cross(axis, across))
