"""Geometric multigrid on nested meshes: a preconditioner whose cost is linear in the number of nodes."""

from dataclasses import replace

import numba
import numpy as np
from scipy import sparse

from palpate.linalg.block_pattern import BlockPattern, hold
from palpate.linalg.factor import Factor


class Multigrid:
    """A symmetric V-cycle: Gauss–Seidel over nodes, Galerkin coarse matrices, a direct solve on the coarsest level.

    patterns : block pattern of each level, coarse first
    prolongations : (n_finer, n_coarser) sparse between neighbours, with at most two entries a row
    held : (n,) bool for each level
    """

    def __init__(self, patterns: list[BlockPattern], prolongations: list[sparse.csr_array], held: list[np.ndarray]):
        self.patterns = [replace(pattern, slots=()) for pattern in patterns]  # slots are large, and not needed here
        self.held = held
        self._parents = [_parents(p) for p in prolongations]
        self._slots = [
            _galerkin_slots(finer, parents, coarser)
            for finer, coarser, (parents, _) in zip(patterns[1:], patterns, self._parents, strict=False)
        ]

    def update(self, stiffness: sparse.bsr_array) -> None:
        """Set the fine matrix, whose held rows are those of the identity; ValueError if it is singular."""
        values = [stiffness.data]
        for level in range(len(self.patterns) - 2, -1, -1):
            coarse = np.zeros((len(self.patterns[level].indices), 3, 3))
            _, weights = self._parents[level]
            pattern = self.patterns[level + 1]
            _galerkin(pattern.indptr, pattern.indices, values[0], weights, self._slots[level], coarse)
            hold(self.patterns[level].indptr, self.patterns[level].indices, coarse, self.held[level])
            values.insert(0, coarse)
        self._values = values
        self._inverses = [_inverses(v, p.diagonal) for v, p in zip(values[1:], self.patterns[1:], strict=True)]
        self._bottom = Factor(self.patterns[0].matrix(values[0]))

    def solve(self, right: np.ndarray) -> np.ndarray:
        """Apply one V-cycle from zero to the right side (n, 3): a symmetric linear map."""
        return self._cycle(len(self.patterns) - 1, right)

    def _cycle(self, level: int, right: np.ndarray) -> np.ndarray:
        if level == 0:
            return self._bottom.solve(right)
        pattern = self.patterns[level]
        matrix = (pattern.indptr, pattern.indices, pattern.diagonal, self._values[level])
        x, residual = np.empty_like(right), np.empty_like(right)
        _forward_from_zero(*matrix, self._inverses[level - 1], right, x)
        _residual_of_forward(*matrix, x, residual)
        parents, weights = self._parents[level - 1]
        coarse = np.zeros((self.patterns[level - 1].size, 3))
        _restrict(parents, weights, residual, self.held[level - 1], coarse)
        _prolongate(parents, weights, self._cycle(level - 1, coarse), x)
        _backward(*matrix, self._inverses[level - 1], right, x)
        return x


def _parents(prolongation: sparse.csr_array) -> tuple[np.ndarray, np.ndarray]:
    """Return each fine node's two parents (n, 2) and their weights; a node of the coarse mesh has one of them twice."""
    first = prolongation.indptr[:-1]
    last = prolongation.indptr[1:] - 1
    parents = np.stack([prolongation.indices[first], prolongation.indices[last]], axis=1)
    weights = np.where((first == last)[:, None], [1.0, 0.0], 0.5)
    return parents.astype(np.int32), weights


def _galerkin_slots(finer: BlockPattern, parents: np.ndarray, coarser: BlockPattern) -> np.ndarray:
    """Return the positions (n_blocks, 2, 2) among the coarse blocks to which Pᵀ K P adds each fine block."""
    slots = np.empty((len(finer.indices), 2, 2), dtype=np.int32)
    _find_slots(finer.indptr, finer.indices, parents, coarser.indptr, coarser.indices, slots)
    return slots


@numba.njit(cache=True)
def _find_slots(indptr, indices, parents, coarse_indptr, coarse_indices, slots):
    for i in range(len(indptr) - 1):
        for p in range(2):
            begin, end = coarse_indptr[parents[i, p]], coarse_indptr[parents[i, p] + 1]
            row = coarse_indices[begin:end]
            for k in range(indptr[i], indptr[i + 1]):
                for q in range(2):
                    slots[k, p, q] = begin + np.searchsorted(row, parents[indices[k], q])


@numba.njit(cache=True)
def _galerkin(indptr, indices, values, weights, slots, coarse):
    for i in range(len(indptr) - 1):
        for k in range(indptr[i], indptr[i + 1]):
            for p in range(2):
                for q in range(2):
                    w = weights[i, p] * weights[indices[k], q]
                    if w != 0.0:
                        for a in range(3):
                            for b in range(3):
                                coarse[slots[k, p, q], a, b] += w * values[k, a, b]


@numba.njit(cache=True, error_model="numpy")
def _inverses(values, diagonal):
    """Return the inverses (n, 3, 3) of the diagonal blocks."""
    inverses = np.empty((len(diagonal), 3, 3))
    for n in range(len(diagonal)):
        a, b = values[diagonal[n]], inverses[n]
        for i in range(3):
            for j in range(3):  # the cofactor of entry j, i
                k, m, p, q = (j + 1) % 3, (j + 2) % 3, (i + 1) % 3, (i + 2) % 3
                b[i, j] = a[k, p] * a[m, q] - a[k, q] * a[m, p]
        det = a[0, 0] * b[0, 0] + a[0, 1] * b[1, 0] + a[0, 2] * b[2, 0]
        for i in range(3):
            for j in range(3):
                b[i, j] /= det
    return inverses


@numba.njit(cache=True)
def _product(begin, end, indices, values, x):
    """Return Σ A_k x_k over the blocks from ``begin`` to ``end``."""
    y0, y1, y2 = 0.0, 0.0, 0.0
    for k in range(begin, end):
        a, b, c = x[indices[k], 0], x[indices[k], 1], x[indices[k], 2]
        y0 += values[k, 0, 0] * a + values[k, 0, 1] * b + values[k, 0, 2] * c
        y1 += values[k, 1, 0] * a + values[k, 1, 1] * b + values[k, 1, 2] * c
        y2 += values[k, 2, 0] * a + values[k, 2, 1] * b + values[k, 2, 2] * c
    return y0, y1, y2


@numba.njit(cache=True)
def _forward_from_zero(indptr, indices, diagonal, values, inverses, right, x):
    """Write one forward sweep into ``x``: what it starts from counts as zero."""
    for i in range(len(right)):
        y0, y1, y2 = _product(indptr[i], diagonal[i], indices, values, x)
        r0, r1, r2 = right[i, 0] - y0, right[i, 1] - y1, right[i, 2] - y2
        for p in range(3):
            x[i, p] = inverses[i, p, 0] * r0 + inverses[i, p, 1] * r1 + inverses[i, p, 2] * r2


@numba.njit(cache=True)
def _residual_of_forward(indptr, indices, diagonal, values, x, residual):
    """Write what is left after ``_forward_from_zero``: the lower triangle and the diagonal are solved exactly."""
    for i in range(len(x)):
        y0, y1, y2 = _product(diagonal[i] + 1, indptr[i + 1], indices, values, x)
        residual[i, 0], residual[i, 1], residual[i, 2] = -y0, -y1, -y2


@numba.njit(cache=True)
def _backward(indptr, indices, diagonal, values, inverses, right, x):
    for i in range(len(right) - 1, -1, -1):
        y0, y1, y2 = _product(indptr[i], diagonal[i], indices, values, x)
        z0, z1, z2 = _product(diagonal[i] + 1, indptr[i + 1], indices, values, x)
        r0, r1, r2 = right[i, 0] - y0 - z0, right[i, 1] - y1 - z1, right[i, 2] - y2 - z2
        for p in range(3):
            x[i, p] = inverses[i, p, 0] * r0 + inverses[i, p, 1] * r1 + inverses[i, p, 2] * r2


@numba.njit(cache=True)
def _restrict(parents, weights, fine, held, coarse):
    for i in range(len(fine)):
        for p in range(2):
            j = parents[i, p]
            if weights[i, p] != 0.0 and not held[j]:
                for a in range(3):
                    coarse[j, a] += weights[i, p] * fine[i, a]


@numba.njit(cache=True)
def _prolongate(parents, weights, coarse, fine):
    for i in range(len(fine)):
        for p in range(2):
            for a in range(3):
                fine[i, a] += weights[i, p] * coarse[parents[i, p], a]
