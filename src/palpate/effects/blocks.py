"""Sparse matrices of 3 × 3 blocks: one block row a node, one block a pair of neighbouring nodes."""

from dataclasses import dataclass

import numba
import numpy as np
from scipy import sparse


@dataclass(frozen=True, eq=False)
class BlockPattern:
    """Which blocks a mesh's matrices have, worked out once.

    indptr, indices : the rows and columns of the blocks, as in ``scipy.sparse.bsr_array``
    diagonal : (n,) place of each diagonal block
    slots : (n_elements, 4, 4) place of each element block
    """

    indptr: np.ndarray
    indices: np.ndarray
    diagonal: np.ndarray
    slots: np.ndarray

    @property
    def size(self) -> int:
        return len(self.indptr) - 1

    def matrix(self, values: np.ndarray) -> sparse.bsr_array:
        """The sparse matrix with these blocks, (n_blocks, 3, 3)."""
        n = 3 * self.size
        return sparse.bsr_array((values, self.indices, self.indptr), shape=(n, n))


def pattern_of(tetrahedra: np.ndarray, n_nodes: int) -> BlockPattern:
    """The pattern of a mesh with ``tetrahedra`` (n_elements, 4) on ``n_nodes`` nodes."""
    rows = np.repeat(tetrahedra, 4, axis=1).ravel()
    columns = np.tile(tetrahedra, (1, 4)).ravel()
    lonely = np.arange(n_nodes)  # a diagonal block for each node, used or not
    keys, slots = np.unique(np.concatenate([rows * n_nodes + columns, lonely * (n_nodes + 1)]), return_inverse=True)
    indptr = np.searchsorted(keys, np.arange(n_nodes + 1) * n_nodes).astype(np.int32)
    return BlockPattern(
        indptr,
        (keys % n_nodes).astype(np.int32),
        slots[len(rows) :].astype(np.int32),
        slots[: len(rows)].reshape(-1, 4, 4).astype(np.int32),
    )


@numba.njit(cache=True)
def hold(indptr, indices, values, held):
    """Replace rows and columns of held nodes, (n,) bool, by those of the identity, in place."""
    for i in range(len(indptr) - 1):
        for k in range(indptr[i], indptr[i + 1]):
            j = indices[k]
            if held[i] or held[j]:
                for p in range(3):
                    for q in range(3):
                        values[k, p, q] = 1.0 if i == j and p == q else 0.0
