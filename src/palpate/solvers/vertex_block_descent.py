"""Relax a body vertex by vertex: vertex block descent for the static equilibrium of corotational linear elements.

After Chen, Liu, Yang and Yuksel (2024): each vertex in turn takes the step of Newton's method that it would take if all
others stood still, with a block of the Hessian in which the elements' rotations stand still, too: it is definite.
Without inertia the fixed point is the equilibrium itself. Contact is a penalty, with its own part of the block.

In motion (``make``) the fixed point is backward Euler's step; sweeps begin at the paper's adaptive guess. Its damping
resists each vertex' own motion, and so that of the whole body, too; here the change of each element's strain is
resisted, as Rayleigh's damping does for small strain. Contact is projected at the end of each step.
"""

from typing import NamedTuple

import numba
import numpy as np

from palpate.effects import settings
from palpate.effects.bed import BedSprings
from palpate.effects.instrument import distances
from palpate.effects.instrument_penalty import NodeContact
from palpate.effects.linear_elements import LinearElements, deformation_gradient
from palpate.effects.settings import Stepping
from palpate.linalg.polar import nearest
from palpate.solvers.relaxed_parts import FlatElements, LinearSprings, RelaxedParts
from palpate.solvers.system import System


class Inertia(NamedTuple):
    """The terms that a step in time adds to the descent.

    inertia : mass over the squared step (n,) [N/m]; target : positions (n, 3) [m] that inertia and loads alone lead to
    slow : β over the step; stresses : β over the step times the stresses at its start, in the rest frame (m, 3, 3) [Pa]
    """

    inertia: np.ndarray
    target: np.ndarray
    slow: float
    stresses: np.ndarray


class VertexBlockDescent:
    """Sweeps over the free nodes of ``elements`` in the order of their numbers.

    held : (n,) bool; bed : springs under the nodes, or None
    """

    def __init__(
        self,
        elements: LinearElements | FlatElements,
        held: np.ndarray,
        bed: BedSprings | LinearSprings | None = None,
    ):
        self._elements, self._free = elements, np.flatnonzero(~held)
        couples = elements.tetrahedra
        by_node = np.argsort(couples.ravel(), kind="stable")
        self._around = by_node // 4, by_node % 4
        self._starts = np.searchsorted(couples.ravel()[by_node], np.arange(len(held) + 1))
        self._springs = None if bed is None else (bed.scalar.indptr, bed.scalar.indices, bed.scalar.data, bed.rest)

    def relax(
        self,
        x: np.ndarray,
        load: np.ndarray,
        sweeps: int,
        radius: float,
        before: np.ndarray | None = None,
        contact: NodeContact | None = None,
        moving: Inertia | None = None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return positions (n, 3) [m] after so many ``sweeps`` from ``x`` (n, 3) [m], and those a sweep before.

        load : (n, 3) [N]; before : positions a sweep before ``x``, from which a descent is continued, or None
        radius : the spectral radius of a sweep that Chebyshev's semi-iterative method assumes (Wang 2015); 0 for none.
            The method starts again where a sweep opposes its extrapolation (O'Donoghue and Candès 2015), so that a
            radius which is too large does no harm.
        contact : with an instrument, or None; nodes that touch are not extrapolated
        moving : of a step in time, None for an equilibrium
        """
        elements, turns = self._elements, np.zeros((len(self._elements.tetrahedra), 4))
        count, weight = (0, 1.0) if before is None else (DELAY, 1.0)
        x, before = x.copy(), x if before is None else before
        touched = None if contact is None else _for_sweeps(contact, len(x))
        for _ in range(sweeps):
            swept = x.copy()
            _sweep(
                swept, load, self._free, self._starts, *self._around, elements.tetrahedra, elements.gradients,
                elements.volumes, *elements.moduli, turns, self._springs, touched, moving,
                isinstance(elements, FlatElements),
            )  # fmt: skip
            if np.vdot(swept - x, x - before) < 0.0:
                count = 0
            weight = chebyshev(count, radius, weight)
            extrapolated = before + weight * (swept - before)
            if contact is not None:
                touching = contact.nodes[contact.overlaps(swept)[0] > 0.0]
                extrapolated[touching] = swept[touching]
            x, before, count = extrapolated, x, count + 1
        return x, before


class BlockDescentSteps(RelaxedParts):
    """Time steps of vertex block descent, with the ``sweeps`` and the ``radius`` of the scene's settings."""

    def __init__(self, system: System, stepping: Stepping):
        super().__init__(system, "vertex_block_descent")
        given = stepping.vertex_block_descent or settings.VertexBlockDescent()
        self._sweeps, self._radius = given.sweeps, given.radius
        self._descent = VertexBlockDescent(self.elements, self.still, self.springs)
        count = len(self.elements.tetrahedra)
        self._turns, self._stresses = np.zeros((count, 4)), np.zeros((count, 3, 3))
        self._before: np.ndarray | None = None

    def step(self, x: np.ndarray, v: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray]:
        elements, start = self.elements, x
        slower, damped = 1.0 / (1.0 + h * self.mass_rate), self.stiffness_time / h
        force = self.outer(start, v) + self.pushes
        acceleration = self.inverse_masses[:, None] * force
        if damped > 0.0:
            _stresses(
                start, elements.tetrahedra, elements.gradients, *elements.moduli, self.flat, self._turns, damped,
                self._stresses,
            )  # fmt: skip
        inertia = self.system.masses / (slower * h**2)
        moving = Inertia(inertia, start + slower * (h * v + h**2 * acceleration), damped, self._stresses)
        guess = start + h * v + h**2 * self._followed(acceleration, v, h)
        self._before = v
        x = self._descent.relax(guess, np.zeros_like(x), self._sweeps, self._radius, moving=moving)[0]
        return self.end(start, x, v, h)

    def _followed(self, pushed: np.ndarray, v: np.ndarray, h: float) -> np.ndarray:
        """Return the part of the accelerations ``pushed`` (n, 3) [m/s²] by loads that nodes had in the last step.

        It is between none and all of them (Chen et al. 2024, section 3.7).
        """
        if self._before is None:
            return np.zeros_like(v)
        sizes = np.linalg.norm(pushed, axis=1)
        parts = np.einsum("ni,ni->n", (v - self._before) / h, pushed) / np.maximum(sizes, 1e-300)
        return (np.clip(parts, 0.0, sizes) / np.maximum(sizes, 1e-300))[:, None] * pushed


make = BlockDescentSteps


def _for_sweeps(contact: NodeContact, count: int) -> tuple:
    """Return the penalties of all ``count`` nodes, 0 where one cannot touch, and the instrument, for the kernel."""
    penalty = np.zeros(count)
    penalty[contact.nodes] = contact.stiffness_n_m
    return penalty, contact.pose.tip, contact.pose.axes, contact.pose.instrument.shape


def chebyshev(number: int, radius: float, weight: float) -> float:
    """Return Chebyshev's weight of iteration ``number``, from 0 on, after one of ``weight`` (Wang 2015, equation 10).

    It is 1, without effect, in the first iterations, whose residuals fall faster than the radius says.
    """
    if radius == 0.0 or number < DELAY:
        return 1.0
    return 2.0 / (2.0 - radius**2) if number == DELAY else 4.0 / (4.0 - radius**2 * weight)


DELAY = 10
"""Iterations before Chebyshev's weights begin."""


@numba.njit(cache=True, error_model="numpy")
def _sweep(
    x, load, free, starts, around, corners, tetrahedra, gradients, volumes, mu, lam, turns, springs, touched, moving,
    flat,
):  # fmt: skip
    """Move each of the ``free`` nodes of ``x`` in turn, in place, by ``block``⁻¹ ``force``, a step of Newton's method.

    starts, around, corners : the elements around each node, ``around[starts[n] : starts[n + 1]]``, and its corner there
    """
    f, r, scratch = np.empty((3, 3)), np.empty((3, 3)), np.empty((4, 3, 3))
    block, force, vector = np.empty((3, 3)), np.empty(3), np.empty(3)  # the last is R g, then the node's step
    for node in free:
        block[:] = 0.0
        force[:] = load[node]
        for k in range(starts[node], starts[node + 1]):
            e, g = around[k], gradients[around[k], corners[k]]
            deformation_gradient(x, tetrahedra[e], gradients[e], f)
            nearest(f, turns[e], scratch, r)
            if flat:
                f[:, 2] = r[:, 2]
            trace, square, share = -3.0, 0.0, volumes[e]
            if moving is not None:
                share *= 1.0 + moving.slow
            for i in range(3):
                square += g[i] * g[i]
                for j in range(3):
                    trace += r[i, j] * f[i, j]
            for i in range(3):
                vector[i] = r[i, 0] * g[0] + r[i, 1] * g[1] + r[i, 2] * g[2]
                stretched = f[i, 0] * g[0] + f[i, 1] * g[1] + f[i, 2] * g[2]
                force[i] -= share * (2.0 * mu[e] * (stretched - vector[i]) + lam[e] * trace * vector[i])
            if moving is not None:  # compiled without a branch
                _give_back(moving.stresses[e], volumes[e], g, r, force)
            for i in range(3):
                block[i, i] += 2.0 * mu[e] * share * square
                for j in range(3):
                    block[i, j] += lam[e] * share * vector[i] * vector[j]
        if moving is not None:
            for i in range(3):
                force[i] += moving.inertia[node] * (moving.target[node, i] - x[node, i])
                block[i, i] += moving.inertia[node]
        if springs is not None:
            _resist(x, node, springs, block, force)
        if touched is not None:
            _push_out(x, node, touched, block, force)
        _step(block, force, vector)
        for i in range(3):
            x[node, i] += vector[i]


@numba.njit(cache=True, error_model="numpy")
def _give_back(stress, volume, g, r, force):
    """Add the force of the ``stress`` at the step's start, turned by ``r``: damping resists the change since then."""
    for j in range(3):
        part = volume * (stress[j, 0] * g[0] + stress[j, 1] * g[1] + stress[j, 2] * g[2])
        for i in range(3):
            force[i] += r[i, j] * part


@numba.njit(cache=True, error_model="numpy")
def _stresses(x, tetrahedra, gradients, mu, lam, flat, turns, factor, stresses):
    """Write ``factor`` times the stresses 2 μ (RᵀF − I) + λ tr(RᵀF − I) I into ``stresses`` (m, 3, 3) [Pa]."""
    f, r, work = np.empty((3, 3)), np.empty((3, 3)), np.empty((4, 3, 3))
    for e in range(len(tetrahedra)):
        deformation_gradient(x, tetrahedra[e], gradients[e], f)
        nearest(f, turns[e], work, r)
        if flat:
            f[:, 2] = r[:, 2]
        trace = -3.0
        for i in range(3):
            for j in range(3):
                stretch = r[0, i] * f[0, j] + r[1, i] * f[1, j] + r[2, i] * f[2, j]
                stresses[e, i, j] = 2.0 * mu[e] * factor * stretch
                if i == j:
                    trace += stretch
        for i in range(3):
            stresses[e, i, i] += factor * (lam[e] * trace - 2.0 * mu[e])


@numba.njit(cache=True, error_model="numpy")
def _resist(x, node, springs, block, force):
    """Add the springs of the bed at ``node`` to its ``block`` (3, 3) and its ``force`` (3,)."""
    starts, others, stiffness, rest = springs
    for k in range(starts[node], starts[node + 1]):
        other = others[k]
        for i in range(3):
            force[i] -= stiffness[k] * (x[other, i] - rest[other, i])
            if other == node:
                block[i, i] += stiffness[k]


@numba.njit(cache=True, error_model="numpy")
def _push_out(x, node, touched, block, force):
    """Add the penalty of ``node``, if it is inside the instrument, to its ``block`` (3, 3) and its ``force``."""
    penalties, tip, axes, shape = touched
    penalty = penalties[node]
    if penalty == 0.0:
        return
    gap, normal = np.empty(1), np.empty((1, 3))
    distances(x[node : node + 1], tip, axes, shape, gap, normal)
    if gap[0] < 0.0:
        for i in range(3):
            force[i] -= penalty * gap[0] * normal[0, i]
            for j in range(3):
                block[i, j] += penalty * normal[0, i] * normal[0, j]


@numba.njit(cache=True, error_model="numpy")
def _step(block, force, step):
    """Solve the symmetric ``block`` (3, 3) for ``force`` (3,), into ``step`` (3,), by Cramer's rule."""
    a, b, c, d, e, g = block[0, 0], block[0, 1], block[0, 2], block[1, 1], block[1, 2], block[2, 2]
    first, second, third = d * g - e * e, c * e - b * g, b * e - c * d
    determinant = a * first + b * second + c * third
    step[0] = (first * force[0] + second * force[1] + third * force[2]) / determinant
    step[1] = (second * force[0] + (a * g - c * c) * force[1] + (b * c - a * e) * force[2]) / determinant
    step[2] = (third * force[0] + (b * c - a * e) * force[1] + (a * d - b * b) * force[2]) / determinant
