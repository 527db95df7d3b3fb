"""A body in few coordinates that an instrument is pushed into: elastic energy of cells, contact at points, one kernel.

x = X + Φ q with ΦᵀKΦ = I at rest. Contact is a penalty at points of the surface: few shapes cannot follow an instrument
at all points, and multipliers would make it press where they fail to.
"""

from collections.abc import Sequence

import numba
import numpy as np
from scipy import sparse

from palpate.benchmark.touch import Touch, TouchDoubted, Touched
from palpate.effects.instrument import Pose, curvatures, distances
from palpate.models.contact_modes.reduced_contact import ReducedContact, add_tangent, cell_stresses
from palpate.solvers.indentation import ContactPoints


@numba.njit(cache=True, error_model="numpy")
def contact(q, rest, modes, areas, penalty, tip, axes, shape, at, gaps, normals, pressures):
    """Write positions, gaps, normals and pressures of the points at ``q`` (r,); return the energy of contact [J].

    rest : (3 p,) [m] of p points; modes : (3 p, r); areas (p,) [m²]; penalty : (p,) [Pa/m]
    """
    moved, energy = rest + np.dot(modes, q), 0.0
    for n in range(len(areas)):
        for i in range(3):
            at[n, i] = moved[3 * n + i]
    distances(at, tip, axes, shape, gaps, normals)
    for n in range(len(areas)):
        pressures[n] = max(-penalty[n] * gaps[n], 0.0)
        energy += 0.5 * areas[n] * pressures[n] ** 2 / penalty[n]
    return energy


@numba.njit(cache=True, error_model="numpy")
def solve_positive(matrix, b):
    """Write the solution of ``matrix`` x = b into ``b`` (r,) by Cholesky's method, which spoils the matrix (r, r).

    Returns False, and leaves ``b``, where the symmetric matrix is not positive definite, or NaN.
    """
    r = len(b)
    for k in range(r):
        if not matrix[k, k] > 0.0:
            return False
        scale = 1.0 / np.sqrt(matrix[k, k])
        for j in range(k, r):
            matrix[k, j] *= scale
        for i in range(k + 1, r):
            share = matrix[k, i]
            for j in range(i, r):
                matrix[i, j] -= share * matrix[k, j]
    for k in range(r):
        b[k] /= matrix[k, k]
        for j in range(k + 1, r):
            b[j] -= b[k] * matrix[k, j]
    for k in range(r - 1, -1, -1):
        for j in range(k + 1, r):
            b[k] -= matrix[k, j] * b[j]
        b[k] /= matrix[k, k]
    return True


@numba.njit(cache=True, error_model="numpy")
def settle_touching(q, cells, base, stiff, points, tip, axes, shape, law, tolerance, iterations):
    """Minimise the energy of a body and of contact from ``q`` (r,) in place, by Newton's method.

    cells : flat slopes (9 k, r), the same as (9, k, r), volumes, μ and λ of k cells; base : (r, r) what of the tangent
    does not change; stiff : (r, r), what the cells' energy lacks at rest; points, tip, axes, shape : as in ``contact``
    Where the tangent is not positive definite, as where cells give way or are inverted, the body's stiffness at rest,
    the identity, stands for it. Returns the force (3,) [N] of the instrument, the area at rest that it touches [m²],
    the residual over the force of contact, and the iterations.
    """
    flat, slopes, volumes, mu, lam = cells
    rest, modes, areas, penalty = points
    r, k, p = len(q), len(volumes), len(areas)
    f, stress, energies = np.empty((9, k)), np.empty((9, k)), np.empty(k)
    accepted = np.empty(k, dtype=np.bool_)
    at, normals, bends = np.empty((p, 3)), np.empty((p, 3)), np.empty((1, 3, 3))
    gaps, pressures = np.empty(p), np.empty(p)
    kernel = (volumes, mu, lam, law[0], law[1], law[2], f, stress, energies, accepted)
    pulled = np.dot(stiff, q)
    energy = 0.5 * np.dot(q, pulled) + cell_stresses(q, flat, *kernel)
    energy += contact(q, rest, modes, areas, penalty, tip, axes, shape, at, gaps, normals, pressures)
    left, count, scale = np.inf, 0, 0.0
    while True:
        touched = np.flatnonzero(pressures > 0.0)
        m = len(touched)
        near, bent, pushes = np.empty((3 * m, r)), np.empty((3 * m, r)), np.empty(3 * m)
        for j in range(m):
            n = touched[j]
            for i in range(3):
                pushes[3 * j + i] = areas[n] * pressures[n] * normals[n, i]
                for h in range(r):
                    near[3 * j + i, h] = modes[3 * n + i, h]
        pull = np.dot(pushes, near)
        gradient = pulled - pull + np.dot(stress.ravel(), flat)
        scale = np.sqrt(np.dot(pull, pull)) if m > 0 else scale
        size = np.sqrt(np.dot(gradient, gradient))
        left = 0.0 if size == 0.0 else size / scale
        if left <= tolerance or count >= iterations:
            break
        count += 1
        step, curved = -gradient, True
        while True:
            for j in range(m):
                n = touched[j]
                one = slice(n, n + 1)
                curvatures(at[one], tip, axes, shape, gaps[one], normals[one], bends)
                push = areas[n] * pressures[n] if curved else 0.0
                firm = areas[n] * penalty[n]
                for i in range(3):
                    a = firm * normals[n, i] * normals[n, 0] - push * bends[0, i, 0]
                    b = firm * normals[n, i] * normals[n, 1] - push * bends[0, i, 1]
                    c = firm * normals[n, i] * normals[n, 2] - push * bends[0, i, 2]
                    for h in range(r):
                        bent[3 * j + i, h] = a * near[3 * j, h] + b * near[3 * j + 1, h] + c * near[3 * j + 2, h]
            tangent = np.dot(near.T, bent)
            if curved:
                tangent += base
                add_tangent(q, slopes, volumes, mu, lam, law[0], law[1], law[2], tangent)
            else:
                tangent += np.eye(r)
            if solve_positive(tangent, step) or not curved:
                break
            curved = False
        slope = np.dot(gradient, step)
        length, found = 1.0, False
        while slope < 0.0 and length > 1e-4:
            reached = q + length * step
            pulled = np.dot(stiff, reached)
            lower = 0.5 * np.dot(reached, pulled) + cell_stresses(reached, flat, *kernel)
            lower += contact(reached, rest, modes, areas, penalty, tip, axes, shape, at, gaps, normals, pressures)
            if lower <= energy + 1e-4 * length * slope + 1e-12 * abs(energy):
                found = True
                break
            length *= 0.5
        if not found:
            break
        q[:], energy = reached, lower
    force, area = np.zeros(3), 0.0
    for m in range(p):
        if pressures[m] > 0.0:
            area += areas[m]
            for i in range(3):
                force[i] += areas[m] * pressures[m] * normals[m, i]
    return force, area, left, count


RESIDUAL, ITERATIONS = 1e-3, 30
"""Residual of an answer over the force of contact, and most of Newton's iterations."""


STIFFER = 2.0
"""Penalty over that of the elements, whose multipliers are lacking."""


class ReducedTouch:
    """One place of a body in r coordinates.

    model : its energy; modes : (n, 3, r) the motion of the nodes; points : of the surface, those ``near`` (q,) bool
    are looked at; rest : (n, 3) [m]; up : the map (n_surface, n) to the fine surface
    Its ``points``, ``cells`` and ``rest`` are what ``settle_touching`` takes, the last as ``stiff``; ``surface``
    (3 n_surface, r) is the motion of the fine surface, in single precision, as it takes long to read.
    """

    def __init__(
        self,
        model: ReducedContact,
        modes: np.ndarray,
        points: ContactPoints,
        near: np.ndarray,
        rest: np.ndarray,
        up: sparse.csr_array,
    ):
        count, flat, nodes = modes.shape[2], modes.reshape(len(rest), -1), points.interpolation[near]
        moved = (nodes @ flat).reshape(-1, count)
        self.points = (nodes @ rest).ravel(), moved, points.areas[near], STIFFER * points.penalty[near]
        cells = model.cells
        self.cells = (cells.slopes.reshape(-1, count), cells.slopes, cells.volumes, cells.mu, cells.lam)
        self._base, self.rest, self._law = model.base, model.rest, tuple(model.law)
        self.surface = (up @ flat).reshape(-1, count).astype(np.float32)

    @property
    def count(self) -> int:
        """The number of coordinates."""
        return len(self.rest)

    def settle(self, pose: Pose, q: np.ndarray) -> tuple[np.ndarray, float, float]:
        """Settle ``q`` (r,) in place; return the force (3,) [N], the area touched [m²] and the residual."""
        where = self.points, pose.tip, pose.axes, pose.instrument.shape
        force, area, left, _ = settle_touching(
            q, self.cells, self._base, self.rest, *where, self._law, RESIDUAL, ITERATIONS
        )
        return force, area, left

    def answer(self, touch: Touch, pose: Pose, q: np.ndarray, stretched: float = 1.0) -> Touched:
        """Return the answer to ``touch``, which begins at ``pose``, from coordinates ``q`` (r,), which are settled.

        stretched : areas that touch over those at rest. TouchDoubted where the search stops above its tolerance.
        """
        force, area, left = self.settle(pose.moved(touch.depth_m * touch.direction), q)
        if not left <= RESIDUAL:
            raise TouchDoubted(f"the reduced model stopped at a residual of {left:.1e}", [left])
        return Touched(
            (self.surface @ q.astype(np.float32)).reshape(-1, 3).astype(float),
            float(force @ touch.direction),
            stretched * area,
        )

    def energy(self, pose: Pose, q: np.ndarray) -> float:
        """Return the energy [J] of the body and of contact at ``q`` (r,)."""
        flat, _, volumes, mu, lam = self.cells
        k, p = len(volumes), len(self.points[2])
        f, stress, energies, accepted = np.empty((9, k)), np.empty((9, k)), np.empty(k), np.empty(k, dtype=bool)
        shape, measure, volume = self._law
        stored = cell_stresses(q, flat, volumes, mu, lam, shape, measure, volume, f, stress, energies, accepted)
        stored += 0.5 * q @ self.rest @ q
        touched = np.empty((p, 3)), np.empty(p), np.empty((p, 3)), np.empty(p)
        return float(stored + contact(q, *self.points, pose.tip, pose.axes, pose.instrument.shape, *touched))


TILT = 45.0
"""Largest angle [degrees] to the straight push for which a place is prepared."""
LOOKED_AT = 0.15
"""Share of the deepest within which a point comes to the instrument in some push, or is not looked at."""
ROUNDING = 1.0 + 1e-9
RIDGE = 1e-6
"""Part of the identity that is added to the kernel by which pushes are told apart."""


def tilted(axes: np.ndarray, tilt: float, turn: float) -> np.ndarray:
    """Return the unit vector (3,) into the body, ``tilt`` [degrees] off straight in and turned about that by ``turn``.

    axes : (3, 3), of an upright instrument
    """
    tilt, turn = np.deg2rad(tilt), np.deg2rad(turn)
    return np.array([np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), -np.cos(tilt)]) @ axes


def tilted_ways(axes: np.ndarray, tilts: Sequence[float], around: int) -> np.ndarray:
    """Return straight in, and for each of ``tilts`` [degrees] so many ways ``around``: (1 + around · tilts, 3)."""
    turns = 360.0 / around * np.arange(around)
    return np.array([tilted(axes, 0.0, 0.0), *(tilted(axes, tilt, turn) for tilt in tilts for turn in turns)])


def doubt_beyond(touch: Touch, outward: np.ndarray, deepest_m: float) -> None:
    """Raise TouchDoubted for a ``touch`` that is deeper than ``deepest_m`` or tilted by more than TILT."""
    if touch.depth_m > ROUNDING * deepest_m:
        raise TouchDoubted(f"{1e3 * touch.depth_m:.3g} mm is deeper than what was prepared", [])
    if -ROUNDING * float(outward @ touch.direction) < np.cos(np.deg2rad(TILT)):
        raise TouchDoubted(f"the direction is more than {TILT:g} degrees off the normal", [])


class Pushes:
    """Pushes that a place was prepared by, between which a search begins.

    deepest_m : of the pushes [m]; ways : (k, 3) [m]; states : (k, r), where they came to
    """

    def __init__(self, deepest_m: float, ways: np.ndarray, states: np.ndarray):
        self._deepest, self._ways = deepest_m, ways / deepest_m
        self._weights = np.linalg.solve(_alike(self._ways, self._ways) + RIDGE * np.eye(len(ways)), states)

    def begin(self, push: np.ndarray) -> np.ndarray:
        """Return the coordinates (r,) at which the search for what a ``push`` (3,) [m] comes to begins."""
        return _alike(push / self._deepest, self._ways) @ self._weights


def _alike(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return how alike ways (..., 3) and (m, 3) are, (..., m): the kernel of polynomials of the degrees 1 to 3."""
    product = a @ b.T
    return product + product**2 + product**3
