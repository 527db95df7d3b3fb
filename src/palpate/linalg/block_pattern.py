"""Sparse matrices of 3 × 3 blocks: a row of blocks for each node, a block for each pair of neighbours."""

from dataclasses import dataclass

import numba
import numpy as np
from scipy import sparse


@dataclass(frozen=True, eq=False)
class BlockPattern:
    """The positions of the blocks in all matrices of a mesh, computed once.

    indptr, indices : the rows and columns of the blocks, as in ``scipy.sparse.bsr_array``
    diagonal : (n,) position of each diagonal block
    slots : for each kind of element (n_elements, k, k), the position of each element block
    """

    indptr: np.ndarray
    indices: np.ndarray
    diagonal: np.ndarray
    slots: tuple[np.ndarray, ...]

    @property
    def size(self) -> int:
        """The number of nodes."""
        return len(self.indptr) - 1

    def matrix(self, values: np.ndarray) -> sparse.bsr_array:
        """Return the sparse matrix of the blocks ``values`` (n_blocks, 3, 3)."""
        n = 3 * self.size
        return sparse.bsr_array((values, self.indices, self.indptr), shape=(n, n))


def pattern_of(tetrahedra: np.ndarray, n_nodes: int) -> BlockPattern:
    """Build the pattern of a mesh with ``tetrahedra`` (n_elements, 4) on ``n_nodes`` nodes."""
    return shared_pattern([tetrahedra], n_nodes)


def shared_pattern(couples: list[np.ndarray], n_nodes: int) -> BlockPattern:
    """Build one pattern for several kinds of elements, each (n_elements, k): tetrahedra, springs, single nodes …"""
    rows = [np.repeat(nodes, nodes.shape[1], axis=1).ravel() for nodes in couples]
    columns = [np.tile(nodes, (1, nodes.shape[1])).ravel() for nodes in couples]
    diagonals = np.arange(n_nodes) * (n_nodes + 1)  # a diagonal block for each node, used or not
    keys = [r * n_nodes + c for r, c in zip(rows, columns, strict=True)]
    known, places = np.unique(np.concatenate([*keys, diagonals]), return_inverse=True)
    *slots, diagonal = np.split(places.astype(np.int32), np.cumsum([len(r) for r in rows]))
    return BlockPattern(
        np.searchsorted(known, np.arange(n_nodes + 1) * n_nodes).astype(np.int32),
        (known % n_nodes).astype(np.int32),
        diagonal,
        tuple(s.reshape(-1, nodes.shape[1], nodes.shape[1]) for s, nodes in zip(slots, couples, strict=True)),
    )


def gather(parts: list[tuple[np.ndarray, np.ndarray, np.ndarray]], n_nodes: int) -> sparse.bsr_array:
    """Assemble the matrix (3n, 3n) of parts, each of rows (k,), columns (k,) and blocks (k, 3, 3).

    Blocks at the same position add up; rows and columns of ``n_nodes`` and above are left out.
    """
    rows, columns, blocks = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
    keys = np.where((rows < n_nodes) & (columns < n_nodes), rows * n_nodes + columns, n_nodes**2)
    known, places = np.unique(keys, return_inverse=True)
    values = np.zeros((len(known), 3, 3))
    scatter(places, blocks, values)
    indptr = np.searchsorted(known, np.arange(n_nodes + 1) * n_nodes)
    inside = known[: indptr[-1]]
    return sparse.bsr_array((values[: len(inside)], inside % n_nodes, indptr), shape=(3 * n_nodes, 3 * n_nodes))


@numba.njit(cache=True)
def scatter(places, blocks, values):
    """Add ``blocks`` (k, 3, 3) to those of ``values`` (m, 3, 3) at ``places`` (k,), which may repeat."""
    for k in range(len(places)):
        for i in range(3):
            for j in range(3):
                values[places[k], i, j] += blocks[k, i, j]


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
