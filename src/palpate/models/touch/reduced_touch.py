"""A body in few coordinates that an instrument is pushed into: elastic energy of cells, contact at points, one kernel.

x = X + Φ q with ΦᵀKΦ = I at rest. Contact is a penalty at points of the surface: few shapes cannot follow an instrument
at all points, and multipliers would make it press where they fail to.
"""

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
    distances(at, tip, axes, shape[0], shape[1], shape[2], shape[3], gaps, normals)
    for n in range(len(areas)):
        pressures[n] = max(-penalty[n] * gaps[n], 0.0)
        energy += 0.5 * areas[n] * pressures[n] ** 2 / penalty[n]
    return energy


@numba.njit(cache=True, error_model="numpy")
def settle_touching(q, cells, base, stiff, points, tip, axes, shape, law, tolerance, iterations):
    """Minimise the energy of a body and of contact from ``q`` (r,) in place, by Newton's method.

    cells : flat slopes (9 k, r), the same as (9, k, r), volumes, μ and λ of k cells; base : (r, r) what of the tangent
    does not change; stiff : (r, r), what the cells' energy lacks at rest; points, tip, axes, shape : as in ``contact``
    Returns the force (3,) [N] of the instrument, the area at rest that it touches [m²], the residual over the force of
    contact, and the iterations.
    """
    flat, slopes, volumes, mu, lam = cells
    rest, modes, areas, penalty = points
    r, k, p = len(q), len(volumes), len(areas)
    f, stress, energies = np.empty((9, k)), np.empty((9, k)), np.empty(k)
    accepted = np.empty(k, dtype=np.bool_)
    at, normals, bends = np.empty((p, 3)), np.empty((p, 3)), np.empty((1, 3, 3))
    gaps, pressures = np.empty(p), np.empty(p)
    kernel = (volumes, mu, lam, law[0], law[1], law[2], f, stress, energies, accepted)
    energy = cell_stresses(q, flat, *kernel) + 0.5 * np.dot(q, np.dot(stiff, q))
    energy += contact(q, rest, modes, areas, penalty, tip, axes, shape, at, gaps, normals, pressures)
    left, count, scale = np.inf, 0, 0.0
    while True:
        touched = np.flatnonzero(pressures > 0.0)
        pushes = np.zeros(3 * p)
        for n in touched:
            for i in range(3):
                pushes[3 * n + i] = areas[n] * pressures[n] * normals[n, i]
        pull = np.dot(pushes, modes)
        gradient = np.dot(stress.ravel(), flat) + np.dot(stiff, q) - pull
        scale = np.sqrt(np.dot(pull, pull)) if len(touched) > 0 else scale
        size = np.sqrt(np.dot(gradient, gradient))
        left = size / scale if size > 0.0 else 0.0
        if left <= tolerance or count >= iterations:
            break
        count += 1
        tangent = base.copy()
        add_tangent(q, slopes, volumes, mu, lam, law[0], law[1], law[2], tangent)
        along, curved = np.empty((len(touched), r)), np.empty((3 * len(touched), r))
        bent = np.empty((3 * len(touched), r))
        for m in range(len(touched)):
            n = touched[m]
            one = slice(n, n + 1)
            curvatures(at[one], tip, axes, shape[0], shape[1], shape[2], shape[3], gaps[one], normals[one], bends)
            root = np.sqrt(areas[n] * penalty[n])
            for j in range(r):
                a, b, c = modes[3 * n, j], modes[3 * n + 1, j], modes[3 * n + 2, j]
                along[m, j] = root * (normals[n, 0] * a + normals[n, 1] * b + normals[n, 2] * c)
                for i in range(3):
                    curved[3 * m + i, j] = modes[3 * n + i, j]
                    push = areas[n] * pressures[n]
                    bent[3 * m + i, j] = push * (bends[0, i, 0] * a + bends[0, i, 1] * b + bends[0, i, 2] * c)
        tangent += np.dot(along.T, along)
        step = np.linalg.solve(tangent - np.dot(curved.T, bent), -gradient)
        slope = np.dot(gradient, step)
        if not slope < 0.0:
            step = np.linalg.solve(tangent, -gradient)
            slope = np.dot(gradient, step)
        length, found = 1.0, False
        while length > 1e-4:
            reached = q + length * step
            lower = cell_stresses(reached, flat, *kernel) + 0.5 * np.dot(reached, np.dot(stiff, reached))
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
    (3 n_surface, r) is the motion of the fine surface.
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
        self.surface = np.ascontiguousarray((up @ flat).reshape(-1, count))

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
        return Touched((self.surface @ q).reshape(-1, 3), float(force @ touch.direction), stretched * area)

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
