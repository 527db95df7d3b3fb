"""Geometric multigrid on nested meshes: a preconditioner whose cost is linear in the number of nodes."""

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
        self.patterns = patterns
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
        self._inverses = [np.linalg.inv(v[p.diagonal]) for v, p in zip(values[1:], self.patterns[1:], strict=True)]
        self._bottom = Factor(self.patterns[0].matrix(values[0]))

    def solve(self, right: np.ndarray) -> np.ndarray:
        """Apply one V-cycle from zero to the right side (n, 3): a symmetric linear map."""
        return self._cycle(len(self.patterns) - 1, right)

    def _cycle(self, level: int, right: np.ndarray) -> np.ndarray:
        if level == 0:
            return self._bottom.solve(right)
        pattern, values = self.patterns[level], self._values[level]
        arguments = (pattern.indptr, pattern.indices, values, self._inverses[level - 1])
        x = np.zeros_like(right)
        residual = np.empty_like(right)
        _sweep_forward(*arguments, right, x)
        _residual(*arguments[:3], right, x, residual)
        parents, weights = self._parents[level - 1]
        coarse = np.zeros((self.patterns[level - 1].size, 3))
        _restrict(parents, weights, residual, self.held[level - 1], coarse)
        _prolongate(parents, weights, self._cycle(level - 1, coarse), x)
        _sweep_backward(*arguments, right, x)
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
    rows = np.repeat(np.arange(finer.size), np.diff(finer.indptr))
    coarse_rows = np.repeat(np.arange(coarser.size), np.diff(coarser.indptr))
    keys = coarse_rows * coarser.size + coarser.indices
    pairs = parents[rows][:, :, None].astype(np.int64) * coarser.size + parents[finer.indices][:, None, :]
    return np.searchsorted(keys, pairs).astype(np.int32)


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


@numba.njit(cache=True)
def _relax(i, indptr, indices, values, inverses, right, x):
    r0, r1, r2 = right[i, 0], right[i, 1], right[i, 2]
    for k in range(indptr[i], indptr[i + 1]):
        j = indices[k]
        if j != i:
            a, b, c = x[j, 0], x[j, 1], x[j, 2]
            r0 -= values[k, 0, 0] * a + values[k, 0, 1] * b + values[k, 0, 2] * c
            r1 -= values[k, 1, 0] * a + values[k, 1, 1] * b + values[k, 1, 2] * c
            r2 -= values[k, 2, 0] * a + values[k, 2, 1] * b + values[k, 2, 2] * c
    for p in range(3):
        x[i, p] = inverses[i, p, 0] * r0 + inverses[i, p, 1] * r1 + inverses[i, p, 2] * r2


@numba.njit(cache=True)
def _sweep_forward(indptr, indices, values, inverses, right, x):
    for i in range(len(right)):
        _relax(i, indptr, indices, values, inverses, right, x)


@numba.njit(cache=True)
def _sweep_backward(indptr, indices, values, inverses, right, x):
    for i in range(len(right) - 1, -1, -1):
        _relax(i, indptr, indices, values, inverses, right, x)


@numba.njit(cache=True)
def _residual(indptr, indices, values, right, x, residual):
    for i in range(len(right)):
        r0, r1, r2 = right[i, 0], right[i, 1], right[i, 2]
        for k in range(indptr[i], indptr[i + 1]):
            j = indices[k]
            a, b, c = x[j, 0], x[j, 1], x[j, 2]
            r0 -= values[k, 0, 0] * a + values[k, 0, 1] * b + values[k, 0, 2] * c
            r1 -= values[k, 1, 0] * a + values[k, 1, 1] * b + values[k, 1, 2] * c
            r2 -= values[k, 2, 0] * a + values[k, 2, 1] * b + values[k, 2, 2] * c
        residual[i, 0], residual[i, 1], residual[i, 2] = r0, r1, r2


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
