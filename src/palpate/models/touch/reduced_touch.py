"""Settle a body in few coordinates under an instrument; the pushes that prepare it, and predict where it settles."""

from collections.abc import Sequence

import numba
import numpy as np

from palpate.benchmark.touch import Touch, TouchDoubted
from palpate.models.reduced.search import settle


@numba.njit(cache=True, error_model="numpy")
def settle_touching(q, body, base, points, tip, axes, shape, tolerance, iterations):
    """Settle coordinates ``q`` (r,) in place under an instrument; return its force [N], area touched [m²], residual.

    base, points, tip, axes, shape : as in ``search.touched``; the area is that at rest
    """
    count, force, area = len(points[2]), np.zeros(3), 0.0
    normals, pressures = np.empty((count, 3)), np.empty(count)
    touch = (base, *points, tip, axes, shape, np.empty((count, 3)), np.empty(count), normals, pressures)
    residual = settle(q, q, body, touch, tolerance, iterations)
    for n in range(count):
        if pressures[n] > 0.0:
            area += points[2][n]
            for i in range(3):
                force[i] += points[2][n] * pressures[n] * normals[n, i]
    return force, area, residual


TILT = 45.0
"""Largest angle [degrees] to the straight push for which a place is prepared."""
LOOKED_AT = 0.15
"""Share of the deepest within which a point comes to the instrument in some push, or is not looked at."""
ROUNDING = 1.0 + 1e-9
RIDGE = 1e-6
"""Part of the identity that is added to the kernel by which pushes are told apart."""


def tilted(axes: np.ndarray, tilt: float, turn: float) -> np.ndarray:
    """Return the unit vector (3,) into the body, ``tilt`` [degrees] off the normal and turned about it by ``turn``.

    axes : (3, 3), of an upright instrument
    """
    tilt, turn = np.deg2rad(tilt), np.deg2rad(turn)
    return np.array([np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), -np.cos(tilt)]) @ axes


def tilted_ways(axes: np.ndarray, tilts: Sequence[float], around: int) -> np.ndarray:
    """Return straight in, and for each of ``tilts`` [degrees] ``around`` directions: (1 + around · tilts, 3)."""
    turns = 360.0 / around * np.arange(around)
    return np.array([tilted(axes, 0.0, 0.0), *(tilted(axes, tilt, turn) for tilt in tilts for turn in turns)])


def doubt_beyond(touch: Touch, outward: np.ndarray, deepest_m: float) -> None:
    """Raise TouchDoubted for a ``touch`` that is deeper than ``deepest_m`` or tilted by more than TILT."""
    if touch.depth_m > ROUNDING * deepest_m:
        raise TouchDoubted(f"{1e3 * touch.depth_m:.3g} mm is deeper than what was prepared", [])
    if -ROUNDING * float(outward @ touch.direction) < np.cos(np.deg2rad(TILT)):
        raise TouchDoubted(f"the direction is more than {TILT:g} degrees off the normal", [])


class Pushes:
    """Pushes of one place whose results are known, from which the state under another push is predicted.

    deepest_m : of the pushes [m]; ways : (k, 3) [m], their displacements; states : (k, r), their results
    """

    def __init__(self, deepest_m: float, displacements: np.ndarray, states: np.ndarray):
        self._deepest, self._ways = deepest_m, displacements / deepest_m
        self._weights = np.linalg.solve(_alike(self._ways, self._ways) + RIDGE * np.eye(len(displacements)), states)

    def begin(self, push: np.ndarray) -> np.ndarray:
        """Return the coordinates (r,) that are expected under a ``push`` (3,) [m], where its search begins."""
        return _alike(push / self._deepest, self._ways) @ self._weights


def _alike(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the polynomial kernel of degrees 1 to 3 of displacements (..., 3) and (m, 3), (..., m)."""
    product = a @ b.T
    return product + product**2 + product**3
