"""Geometric multigrid on nested meshes: a preconditioner whose cost is linear in the number of nodes."""

from dataclasses import replace

import numba
import numpy as np
from scipy import sparse

from palpate.linalg.block_pattern import BlockPattern, hold
from palpate.linalg.factor import Factor
from palpate.linalg.gauss_seidel import Triangle


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
        self._triangles = [Triangle(pattern) for pattern in patterns[1:]]
        self._slots = [
            _galerkin_slots(finer, parents, coarser)
            for finer, coarser, (parents, _) in zip(patterns[1:], patterns, self._parents, strict=False)
        ]

    def update(self, stiffness: sparse.bsr_array) -> None:
        """Set the fine matrix, symmetric and with the identity's rows for held nodes; ValueError if it is singular."""
        values = self.galerkin(stiffness)
        self._sweeps = [where.of(own) for where, own in zip(self._triangles, values[1:], strict=True)]
        self._bottom = Factor(self.patterns[0].matrix(values[0]))

    def galerkin(self, stiffness: sparse.bsr_array) -> list[np.ndarray]:
        """Return the blocks (n_blocks, 3, 3) of the matrix of each level, coarse first, from the fine matrix."""
        values = [stiffness.data]
        for level in range(len(self.patterns) - 2, -1, -1):
            coarse = np.zeros((len(self.patterns[level].indices), 3, 3))
            _, weights = self._parents[level]
            pattern = self.patterns[level + 1]
            _galerkin(pattern.indptr, pattern.indices, values[0], weights, self._slots[level], coarse)
            hold(self.patterns[level].indptr, self.patterns[level].indices, coarse, self.held[level])
            values.insert(0, coarse)
        return values

    def solve(self, right: np.ndarray) -> np.ndarray:
        """Apply one V-cycle from zero to the right side (n, 3), or to k at once (n, 3, k): a symmetric linear map."""
        return self._cycle(len(self.patterns) - 1, right)

    def _cycle(self, level: int, right: np.ndarray) -> np.ndarray:
        if level == 0:
            return self._bottom.solve(right)
        x, residual = self._sweeps[level - 1].forward(right)
        parents, weights = self._parents[level - 1]
        coarse = np.zeros((self.patterns[level - 1].size, *right.shape[1:]))
        fine = residual.reshape(len(residual), -1)
        _restrict(parents, weights, fine, self.held[level - 1], coarse.reshape(len(coarse), -1))
        _prolongate(parents, weights, self._cycle(level - 1, coarse).reshape(len(coarse), -1), fine)
        return self._sweeps[level - 1].backward(x, residual)


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


@numba.njit(cache=True)
def _restrict(parents, weights, fine, held, coarse):
    for i in range(len(fine)):
        for p in range(2):
            j = parents[i, p]
            if weights[i, p] != 0.0 and not held[j]:
                for a in range(fine.shape[1]):
                    coarse[j, a] += weights[i, p] * fine[i, a]


@numba.njit(cache=True)
def _prolongate(parents, weights, coarse, fine):
    for i in range(len(fine)):
        for a in range(fine.shape[1]):
            fine[i, a] = weights[i, 0] * coarse[parents[i, 0], a] + weights[i, 1] * coarse[parents[i, 1], a]
