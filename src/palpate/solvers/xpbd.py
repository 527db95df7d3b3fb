"""Extended position-based dynamics: a body of corotational linear elements relaxed to equilibrium by its constraints.

The two terms of the law are constraints of each element with a compliance (Macklin and Müller 2021, for a neo-Hookean
law): ‖F − R‖ with 1/(2 μ V), tr(RᵀF) − 3 with 1/(λ V). Both are met at once, by the two equations that couple them
(Ton-That, Kry and Andrews 2023). Multipliers accumulate over the iterations of a step (Macklin, Müller, Chentanez
2016). To reach equilibrium without a damping that would have to be chosen, nodes are stopped whenever their kinetic
energy falls. With too few iterations a step ends elsewhere; shorter steps need fewer. The springs of a bed are
constraints of its triangles: three combinations of the corners' displacements, whose squares are the energy. An
instrument is an inequality of each node, without compliance.
"""

import numba
import numpy as np

from palpate.effects import settings
from palpate.effects.bed import BedSprings
from palpate.effects.instrument import Pose
from palpate.effects.linear_elements import LinearElements, deformation_gradient
from palpate.effects.settings import Stepping
from palpate.linalg.polar import nearest
from palpate.solvers.relaxed_parts import FlatElements, LinearSprings, RelaxedParts
from palpate.solvers.system import System

LEAST_DISTANCE = 1e-12
"""Below this ‖F − R‖ has no direction, and the constraint is met."""


class InstrumentConstraints:
    """The constraints that keep ``nodes`` (k,) out of an instrument at a ``pose``, without friction.

    multipliers : (k,) [kg m], of the last step; never negative, as contact has no tension
    """

    def __init__(self, nodes: np.ndarray, pose: Pose):
        self.nodes, self.pose, self.multipliers = nodes, pose, np.zeros(len(nodes))

    def keep_out(self, x: np.ndarray, inverse: np.ndarray) -> None:
        """Correct ``x`` (n, 3) [m] once, in place; inverse : one over each node's mass (n,) [1/kg]."""
        gaps, normals = self.pose.gaps(x[self.nodes])
        multipliers = np.maximum(self.multipliers - gaps / inverse[self.nodes], 0.0)
        x[self.nodes] += (inverse[self.nodes] * (multipliers - self.multipliers))[:, None] * normals
        self.multipliers = multipliers

    def pushes(self, x: np.ndarray, step_s: float) -> np.ndarray:
        """Return the forces (k, 3) [N] on the nodes in the last step."""
        return (self.multipliers / step_s**2)[:, None] * self.pose.gaps(x[self.nodes])[1]


class Constraints:
    """The constraints of ``elements``, and of ``springs`` unless None, and their multipliers."""

    def __init__(self, elements: LinearElements | FlatElements, springs: BedSprings | LinearSprings | None):
        self._elements, self._springs, self._flat = elements, springs, isinstance(elements, FlatElements)
        count = len(elements.tetrahedra)
        self._multipliers, self._turns = np.zeros((count, 2)), np.zeros((count, 4))
        self._pulls = None if springs is None else np.zeros((*springs.roots.shape[:2], 3))

    def begin(self) -> None:
        """Begin a step, with multipliers of zero."""
        self._multipliers[:] = 0.0
        if self._pulls is not None:
            self._pulls[:] = 0.0

    def meet(
        self, x: np.ndarray, inverse: np.ndarray, step_s: float, start: np.ndarray, damping_s: float = 0.0
    ) -> None:
        """Correct ``x`` (n, 3) [m] by each constraint once, in place.

        inverse : one over each node's mass (n,) [1/kg]; step_s : length of the step [s]
        start : positions (n, 3) [m] at its start; damping_s : β of Rayleigh damping
        """
        elements, springs, turns = self._elements, self._springs, self._turns
        parts = elements.tetrahedra, elements.gradients, elements.volumes, *elements.moduli, self._flat
        _meet(x, *parts, self._multipliers, turns, inverse, step_s, start, damping_s / step_s)
        if springs is not None:
            _pull(x, springs.rest, springs.couples, springs.roots, self._pulls, inverse, step_s)


class Xpbd:
    """The relaxation of ``elements`` by the constraints of each in turn.

    masses : (n,) [kg]; held : (n,) bool; bed : springs under the nodes, or None
    """

    def __init__(self, elements: LinearElements, masses: np.ndarray, held: np.ndarray, bed: BedSprings | None = None):
        self._elements, self._masses, self._bed = elements, masses, bed
        self._inverse = np.where(held, 0.0, 1.0 / masses)

    def relax(
        self,
        x: np.ndarray,
        load: np.ndarray,
        steps: int,
        iterations: int,
        step_s: float,
        before: np.ndarray | None = None,
        obstacle: InstrumentConstraints | None = None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return positions (n, 3) [m] after ``steps`` of ``step_s`` [s] from ``x`` (n, 3) [m], and those a step before.

        load : (n, 3) [N]; iterations : of each step
        before : positions a step before ``x``, from which a motion is continued, or None
        obstacle : an instrument, or None; afterwards it has the multipliers of the last step
        """
        x, constraints = x.copy(), Constraints(self._elements, self._bed)
        pushed = step_s**2 * self._inverse[:, None] * load
        moved = np.zeros_like(x) if before is None else x - before
        energy = self._energy(moved)
        for _ in range(steps):
            start = x.copy()
            x += moved + pushed
            constraints.begin()
            if obstacle is not None:
                obstacle.multipliers = np.zeros(len(obstacle.nodes))
            for _ in range(iterations):
                constraints.meet(x, self._inverse, step_s, start)
                if obstacle is not None:
                    obstacle.keep_out(x, self._inverse)
            moved = x - start
            energy_before, energy = energy, self._energy(moved)
            if energy < energy_before:
                moved[:], energy = 0.0, 0.0
        return x, x - moved

    def _energy(self, moved: np.ndarray) -> float:
        """Return twice the kinetic energy, times the step squared."""
        return float(np.sum(self._masses[:, None] * moved**2))


class XpbdSteps(RelaxedParts):
    """Time steps of XPBD, with the ``iterations`` of the scene's settings."""

    def __init__(self, system: System, stepping: Stepping):
        super().__init__(system, "xpbd")
        self._iterations = (stepping.xpbd or settings.Xpbd()).iterations
        self._constraints = Constraints(self.elements, self.springs)

    def step(self, x: np.ndarray, v: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray]:
        start, slower = x, 1.0 / (1.0 + h * self.mass_rate)
        inverse = slower * self.inverse_masses
        x = start + slower * h * v + h**2 * inverse[:, None] * (self.outer(start, v) + self.pushes)
        self._constraints.begin()
        for iteration in range(self._iterations):
            self._constraints.meet(x, inverse, h, start, self.stiffness_time)
            for cord in self.cords:
                cord.correct(x, inverse, h, iteration == 0)
        return self.end(start, x, v, h)


make = XpbdSteps


@numba.njit(cache=True, error_model="numpy")
def _constraints(x, element, gradients, flat, turn, work, f, r, shape, swell):
    """Return ‖F − R‖ and tr(RᵀF) − 3 of an element; write their gradients by nodes to ``shape``, ``swell`` (4, 3)."""
    deformation_gradient(x, element, gradients, f)
    nearest(f, turn, work, r)
    if flat:
        f[:, 2] = r[:, 2]
    square, trace = 0.0, -3.0
    for i in range(3):
        for j in range(3):
            trace += r[i, j] * f[i, j]
            f[i, j] -= r[i, j]
            square += f[i, j] * f[i, j]
    away = np.sqrt(square)
    scale = 1.0 / away if away > LEAST_DISTANCE else 0.0
    for a in range(4):
        for i in range(3):
            shape[a, i], swell[a, i] = 0.0, 0.0
            for j in range(3):
                shape[a, i] += scale * f[i, j] * gradients[a, j]
                swell[a, i] += r[i, j] * gradients[a, j]
    return away, trace


@numba.njit(cache=True, error_model="numpy")
def _meet(x, tetrahedra, gradients, volumes, mu, lam, flat, multipliers, turns, inverse, step_s, start, slow):
    """Correct ``x`` by both constraints of each element once (Macklin, Müller, Chentanez 2016, equation 26, for two).

    The changes d of both multipliers solve [[a, b], [b, c]] (d_shape, d_swell) = −(left_shape, left_swell).
    slow : β over the step, 0 without damping
    """
    f, r, work = np.empty((3, 3)), np.empty((3, 3)), np.empty((4, 3, 3))
    shape, swell = np.empty((4, 3)), np.empty((4, 3))
    for e in range(len(tetrahedra)):
        away, trace = _constraints(x, tetrahedra[e], gradients[e], flat, turns[e], work, f, r, shape, swell)
        compliance = 1.0 / (2.0 * mu[e] * volumes[e] * step_s**2)
        a, b, c, left_shape, left_swell = compliance, 0.0, 0.0, away + compliance * multipliers[e, 0], 0.0
        resists = lam[e] > 0.0
        if resists:
            c = 1.0 / (lam[e] * volumes[e] * step_s**2)
            left_swell = trace + c * multipliers[e, 1]
        for k in range(4):
            mobility = (1.0 + slow) * inverse[tetrahedra[e, k]]
            for i in range(3):
                a += mobility * shape[k, i] * shape[k, i]
                if resists:
                    b += mobility * shape[k, i] * swell[k, i]
                    c += mobility * swell[k, i] * swell[k, i]
                if slow > 0.0:
                    damped = slow * (x[tetrahedra[e, k], i] - start[tetrahedra[e, k], i])
                    left_shape += shape[k, i] * damped
                    left_swell += swell[k, i] * damped
        d_shape, d_swell = -left_shape / a, 0.0
        if resists:
            det = a * c - b * b
            d_shape, d_swell = (b * left_swell - c * left_shape) / det, (b * left_shape - a * left_swell) / det
        multipliers[e, 0] += d_shape
        multipliers[e, 1] += d_swell
        for k in range(4):
            mobility = inverse[tetrahedra[e, k]]
            for i in range(3):
                x[tetrahedra[e, k], i] += mobility * (shape[k, i] * d_shape + swell[k, i] * d_swell)


@numba.njit(cache=True, error_model="numpy")
def _pull(x, rest, couples, roots, multipliers, inverse, step_s):
    """Correct ``x`` once by each constraint of springs: a row of ``roots`` times displacements is 0, compliance 1."""
    compliance = 1.0 / step_s**2
    for t in range(len(couples)):
        for c in range(roots.shape[1]):
            row, total = roots[t, c], compliance
            for k in range(couples.shape[1]):
                total += inverse[couples[t, k]] * row[k] ** 2
            for i in range(3):
                left = compliance * multipliers[t, c, i]
                for k in range(couples.shape[1]):
                    left += row[k] * (x[couples[t, k], i] - rest[couples[t, k], i])
                change = -left / total
                multipliers[t, c, i] += change
                for k in range(couples.shape[1]):
                    x[couples[t, k], i] += inverse[couples[t, k]] * row[k] * change
