"""A body in few coordinates that an instrument is pushed into: elastic energy of cubature points, contact at points."""

from collections.abc import Sequence

import numba
import numpy as np
from scipy import sparse

from palpate.benchmark.touch import Touch, TouchDoubted, Touched
from palpate.effects.instrument import Pose
from palpate.models.reduced.energy import ReducedEnergy
from palpate.models.reduced.search import settle
from palpate.solvers.indentation import ContactPoints


@numba.njit(cache=True, error_model="numpy")
def settle_touching(q, body, base, points, tip, axes, shape, tolerance, iterations):
    """Settle ``q`` (r,) in place under an instrument; return its force (3,) [N], the area touched [m²], the residual.

    base, points, tip, axes, shape : as in ``search.touched``; the area is that at rest
    """
    count, force, area = len(points[2]), np.zeros(3), 0.0
    normals, pressures = np.empty((count, 3)), np.empty(count)
    touch = (base, *points, tip, axes, shape, np.empty((count, 3)), np.empty(count), normals, pressures)
    left = settle(q, q, body, touch, tolerance, iterations)
    for n in range(count):
        if pressures[n] > 0.0:
            area += points[2][n]
            for i in range(3):
                force[i] += points[2][n] * pressures[n] * normals[n, i]
    return force, area, left


RESIDUAL, ITERATIONS = 1e-3, 30
"""Residual of an answer over the force of contact, and most of Newton's iterations."""


STIFFER = 2.0
"""Penalty over that of the elements, whose multipliers are lacking."""


class ReducedTouch:
    """A reduced model of one place of a body, in r coordinates.

    model : its energy; modes : (n, 3, r) the motion of the nodes; points : of the surface, of which those ``near`` (q,)
        bool may be touched; rest : (n, 3) [m]; up : the map (n_surface, n) to the fine surface
    Its own ``points`` are what ``settle_touching`` takes; ``surface`` (3 n_surface, r) is the motion of the fine
    surface, in float32, as it takes long to read.
    """

    def __init__(
        self,
        model: ReducedEnergy,
        modes: np.ndarray,
        points: ContactPoints,
        near: np.ndarray,
        rest: np.ndarray,
        up: sparse.csr_array,
    ):
        count, flat, nodes = modes.shape[2], modes.reshape(len(rest), -1), points.interpolation[near]
        moved = (nodes @ flat).reshape(-1, count)
        self.points = (nodes @ rest).ravel(), moved, points.areas[near], STIFFER * points.penalty[near]
        self.model = model
        self.surface = (up @ flat).reshape(-1, count).astype(np.float32)

    @property
    def count(self) -> int:
        """The number of coordinates."""
        return len(self.model.rest)

    def settle(self, pose: Pose, q: np.ndarray) -> tuple[np.ndarray, float, float]:
        """Settle ``q`` (r,) in place; return the force (3,) [N], the area touched [m²] and the residual."""
        where = self.points, pose.tip, pose.axes, pose.instrument.shape
        return settle_touching(q, self.model.body, self.model.base, *where, RESIDUAL, ITERATIONS)

    def answer(self, touch: Touch, pose: Pose, q: np.ndarray, stretched: float = 1.0) -> Touched:
        """Answer ``touch``, which begins at ``pose``; the search begins at coordinates ``q`` (r,) and overwrites them.

        stretched : areas touched over those at rest. TouchDoubted where the search stops above its tolerance.
        """
        force, area, left = self.settle(pose.moved(touch.depth_m * touch.direction), q)
        if not left <= RESIDUAL:
            raise TouchDoubted(f"the reduced model stopped at a residual of {left:.1e}", [left])
        return Touched(
            (self.surface @ q.astype(np.float32)).reshape(-1, 3).astype(float),
            float(force @ touch.direction),
            stretched * area,
        )


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

    def __init__(self, deepest_m: float, ways: np.ndarray, states: np.ndarray):
        self._deepest, self._ways = deepest_m, ways / deepest_m
        self._weights = np.linalg.solve(_alike(self._ways, self._ways) + RIDGE * np.eye(len(ways)), states)

    def begin(self, push: np.ndarray) -> np.ndarray:
        """Return the coordinates (r,) that are expected under a ``push`` (3,) [m], where its search begins."""
        return _alike(push / self._deepest, self._ways) @ self._weights


def _alike(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return how alike ways (..., 3) and (m, 3) are, (..., m): the kernel of polynomials of the degrees 1 to 3."""
    product = a @ b.T
    return product + product**2 + product**3
