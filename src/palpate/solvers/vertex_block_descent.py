"""Relax a body vertex by vertex: vertex block descent for the static equilibrium of corotational linear elements.

After Chen, Liu, Yang and Yuksel (2024): each vertex in turn takes the step of Newton's method that it would take if all
others stood still, with a block of the Hessian in which the elements' rotations stand still, too: it is definite.
Without inertia the fixed point is the equilibrium itself. Contact is a penalty, with its own part of the block.
"""

import numba
import numpy as np

from palpate.effects.bed import BedSprings
from palpate.effects.instrument import distances
from palpate.effects.linear_elements import LinearElements, deformation_gradient
from palpate.effects.node_contact import NodeContact
from palpate.linalg.polar import nearest


class VertexBlockDescent:
    """Sweeps over the free nodes of ``elements``, in their order.

    held : (n,) bool; bed : what they lie on, or None
    """

    def __init__(self, elements: LinearElements, held: np.ndarray, bed: BedSprings | None = None):
        self._elements, self._free = elements, np.flatnonzero(~held)
        couples = elements.tetrahedra
        around = np.argsort(couples.ravel(), kind="stable")
        self._around = around // 4, around % 4
        self._starts = np.searchsorted(couples.ravel()[around], np.arange(len(held) + 1))
        self._springs = None if bed is None else (bed.scalar.indptr, bed.scalar.indices, bed.scalar.data, bed.rest)

    def relax(
        self,
        x: np.ndarray,
        load: np.ndarray,
        sweeps: int,
        radius: float,
        before: np.ndarray | None = None,
        contact: NodeContact | None = None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return positions after so many sweeps from ``x`` (n, 3) [m], and those a sweep before, (n, 3) [m].

        load : (n, 3) [N]; before : positions a sweep before ``x``, with which a descent goes on, or None for none
        radius : the spectral radius that Chebyshev's semi-iterative method assumes of a sweep (Wang 2015); 0 for none.
            It starts anew where a sweep goes against what it adds (O'Donoghue and Candès 2015), so that a radius which
            is too large does no harm.
        contact : with an instrument, or None; nodes that touch are not accelerated
        """
        elements, turns = self._elements, np.zeros((len(self._elements.tetrahedra), 4))
        number, weight = (0, 1.0) if before is None else (DELAY, 1.0)
        x, before = x.copy(), x if before is None else before
        touched = None if contact is None else _for_sweeps(contact, len(x))
        for _ in range(sweeps):
            reached = x.copy()
            _sweep(
                reached, load, self._free, self._starts, *self._around, elements.tetrahedra, elements.gradients,
                elements.volumes, *elements.moduli, turns, self._springs, touched,
            )  # fmt: skip
            if np.vdot(reached - x, x - before) < 0.0:
                number = 0
            weight = chebyshev(number, radius, weight)
            ahead = before + weight * (reached - before)
            if contact is not None:
                touching = contact.nodes[contact.overlaps(reached)[0] > 0.0]
                ahead[touching] = reached[touching]
            x, before, number = ahead, x, number + 1
        return x, before


def _for_sweeps(contact: NodeContact, count: int) -> tuple:
    """Return what the kernel takes: the penalty of each of ``count`` nodes, most of them 0, and the place."""
    penalty = np.zeros(count)
    penalty[contact.nodes] = contact.stiffness_n_m
    return penalty, contact.pose.tip, contact.pose.axes, *contact.pose.instrument.shape


def chebyshev(number: int, radius: float, weight: float) -> float:
    """Return the weight of iteration ``number``, from 0 on, after one of ``weight`` (Wang 2015, equation 10).

    The first ten iterations have none, as they depart from what the method assumes.
    """
    if radius == 0.0 or number < DELAY:
        return 1.0
    return 2.0 / (2.0 - radius**2) if number == DELAY else 4.0 / (4.0 - radius**2 * weight)


DELAY = 10
"""Iterations before Chebyshev's weights begin."""


@numba.njit(cache=True, error_model="numpy")
def _sweep(x, load, free, starts, around, corners, tetrahedra, gradients, volumes, mu, lam, turns, springs, touched):
    f, r, work = np.empty((3, 3)), np.empty((3, 3)), np.empty((4, 3, 3))
    block, slope, along = np.empty((3, 3)), np.empty(3), np.empty(3)
    for node in free:
        block[:] = 0.0
        slope[:] = load[node]
        for k in range(starts[node], starts[node + 1]):
            e, g = around[k], gradients[around[k], corners[k]]
            deformation_gradient(x, tetrahedra[e], gradients[e], f)
            nearest(f, turns[e], work, r)
            trace, square = -3.0, 0.0
            for i in range(3):
                square += g[i] * g[i]
                for j in range(3):
                    trace += r[i, j] * f[i, j]
            for i in range(3):
                along[i] = r[i, 0] * g[0] + r[i, 1] * g[1] + r[i, 2] * g[2]
                moved = f[i, 0] * g[0] + f[i, 1] * g[1] + f[i, 2] * g[2]
                slope[i] -= volumes[e] * (2.0 * mu[e] * (moved - along[i]) + lam[e] * trace * along[i])
            for i in range(3):
                block[i, i] += 2.0 * mu[e] * volumes[e] * square
                for j in range(3):
                    block[i, j] += lam[e] * volumes[e] * along[i] * along[j]
        if springs is not None:  # compiled without a branch
            _resist(x, node, springs, block, slope)
        if touched is not None:
            _push_out(x, node, touched, block, slope)
        _step(block, slope, along)
        for i in range(3):
            x[node, i] += along[i]


@numba.njit(cache=True, error_model="numpy")
def _resist(x, node, springs, block, slope):
    """Add the springs of the bed at ``node`` to its ``block`` (3, 3) and its force ``slope`` (3,)."""
    starts, others, stiffness, rest = springs
    for k in range(starts[node], starts[node + 1]):
        other = others[k]
        for i in range(3):
            slope[i] -= stiffness[k] * (x[other, i] - rest[other, i])
            if other == node:
                block[i, i] += stiffness[k]


@numba.njit(cache=True, error_model="numpy")
def _push_out(x, node, touched, block, slope):
    """Add the penalty of ``node``, if it is inside the instrument, to its ``block`` (3, 3) and its force ``slope``."""
    penalties, tip, axes, kind, radius, edge, half = touched
    penalty = penalties[node]
    if penalty == 0.0:
        return
    gap, normal = np.empty(1), np.empty((1, 3))
    distances(x[node : node + 1], tip, axes, kind, radius, edge, half, gap, normal)
    if gap[0] < 0.0:
        for i in range(3):
            slope[i] -= penalty * gap[0] * normal[0, i]
            for j in range(3):
                block[i, j] += penalty * normal[0, i] * normal[0, j]


@numba.njit(cache=True, error_model="numpy")
def _step(block, slope, step):
    """Solve the symmetric ``block`` (3, 3) for ``slope`` (3,), into ``step`` (3,), by Cramer's rule."""
    a, b, c, d, e, g = block[0, 0], block[0, 1], block[0, 2], block[1, 1], block[1, 2], block[2, 2]
    first, second, third = d * g - e * e, c * e - b * g, b * e - c * d
    determinant = a * first + b * second + c * third
    step[0] = (first * slope[0] + second * slope[1] + third * slope[2]) / determinant
    step[1] = (second * slope[0] + (a * g - c * c) * slope[1] + (b * c - a * e) * slope[2]) / determinant
    step[2] = (third * slope[0] + (b * c - a * e) * slope[1] + (a * d - b * b) * slope[2]) / determinant
