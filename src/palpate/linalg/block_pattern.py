"""The rows of a mesh's block pattern and the places of element blocks in it, in linear time.

Sparse matrices of 3 × 3 blocks: a row of blocks for each node, a block for each pair of neighbours.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numba
import numpy as np
from scipy import sparse


@numba.njit(cache=True)
def _build(nodes, starts, places, n_nodes):
    """Return the pattern's ``indptr`` (n_nodes + 1,) and ``indices``, and the positions of all element blocks in it.

    Element e has nodes ``nodes[starts[e] : starts[e + 1]]``; its blocks, one for each pair of them, are numbered from
    ``places[e]`` on, row by row. A first pass counts the blocks of each row; the second lists and looks them up.
    """
    ends, elements = _around(nodes, starts, n_nodes)
    indptr, latest = np.zeros(n_nodes + 1, dtype=np.int32), np.full(n_nodes, -1, dtype=np.int32)
    for i in range(n_nodes):
        count, latest[i] = 1, i
        for e in elements[ends[i] : ends[i + 1]]:
            for j in nodes[starts[e] : starts[e + 1]]:
                if latest[j] != i:
                    latest[j] = i
                    count += 1
        indptr[i + 1] = indptr[i] + count
    indices, slots = np.empty(indptr[-1], dtype=np.int32), np.empty(places[-1], dtype=np.int32)
    latest[:] = -1  # from here on the position of a node's latest block
    for i in range(n_nodes):
        begin, end = indptr[i], indptr[i] + 1
        indices[begin], latest[i] = i, begin
        for e in elements[ends[i] : ends[i + 1]]:
            for j in nodes[starts[e] : starts[e + 1]]:
                if latest[j] < begin:
                    indices[end], latest[j] = j, end
                    end += 1
        indices[begin:end].sort()
        for k in range(begin, end):
            latest[indices[k]] = k
        for e in elements[ends[i] : ends[i + 1]]:
            width = starts[e + 1] - starts[e]
            for a in range(width):
                if nodes[starts[e] + a] == i:
                    for b in range(width):
                        slots[places[e] + a * width + b] = latest[nodes[starts[e] + b]]
    return indptr, indices, slots


@numba.njit(cache=True)
def _around(nodes, starts, n_nodes):
    """Return ``ends`` and ``elements``: those around node i are ``elements[ends[i] : ends[i + 1]]``; see ``_build``."""
    ends = np.zeros(n_nodes + 1, dtype=np.int64)
    for i in nodes:
        ends[i + 1] += 1
    ends = np.cumsum(ends)
    elements, filled = np.empty(len(nodes), dtype=np.int32), ends[:-1].copy()
    for e in range(len(starts) - 1):
        for i in nodes[starts[e] : starts[e + 1]]:
            elements[filled[i]] = e
            filled[i] += 1
    return ends, elements


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

    def blocks(self, matrix: sparse.sparray) -> np.ndarray:
        """Return the blocks (n_blocks, 3, 3) of a sparse ``matrix`` (3n, 3n) all of whose blocks are in the pattern."""
        given = sparse.bsr_array(matrix, blocksize=(3, 3))
        rows, pattern_rows = (np.repeat(np.arange(self.size), np.diff(blocks.indptr)) for blocks in (given, self))
        places = np.searchsorted(pattern_rows * self.size + self.indices, rows * self.size + given.indices)
        values = np.zeros((len(self.indices), 3, 3))
        scatter(places, given.data, values)
        return values

    def matrix(self, values: np.ndarray) -> sparse.bsr_array:
        """Return the sparse matrix of the blocks ``values`` (n_blocks, 3, 3)."""
        n = 3 * self.size
        return sparse.bsr_array((values, self.indices, self.indptr), shape=(n, n))


def pattern_of(tetrahedra: np.ndarray, n_nodes: int) -> BlockPattern:
    """Build the pattern of a mesh with ``tetrahedra`` (n_elements, 4) on ``n_nodes`` nodes."""
    return shared_pattern([tetrahedra], n_nodes)


def shared_pattern(couples: list[np.ndarray], n_nodes: int) -> BlockPattern:
    """Build one pattern for several kinds of elements, each by its nodes (n_elements, k): tetrahedra, springs, nodes …

    Indices increase within a row. Every row has its diagonal block, used or not.
    """
    if not couples:
        diagonal = np.arange(n_nodes, dtype=np.int32)
        return BlockPattern(np.arange(n_nodes + 1, dtype=np.int32), diagonal, diagonal, ())
    widths = np.repeat([kind.shape[1] for kind in couples], [len(kind) for kind in couples])
    starts, places = (np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64) for sizes in (widths, widths**2))
    nodes = np.concatenate([kind.ravel() for kind in couples]).astype(np.int32)
    indptr, indices, positions = _build(nodes, starts, places, n_nodes)
    positions_of_kind = np.split(positions, np.cumsum([len(kind) * kind.shape[1] ** 2 for kind in couples])[:-1])
    slots = tuple(p.reshape(-1, k.shape[1], k.shape[1]) for p, k in zip(positions_of_kind, couples, strict=True))
    rows = np.repeat(np.arange(n_nodes, dtype=np.int32), np.diff(indptr))
    return BlockPattern(indptr, indices, np.flatnonzero(rows == indices).astype(np.int32), slots)


def gather(parts: list[tuple[np.ndarray, np.ndarray, np.ndarray]], n_nodes: int) -> sparse.bsr_array:
    """Assemble the matrix (3n, 3n) of parts, each of rows (k,), columns (k,) and blocks (k, 3, 3).

    Blocks at the same position add up; rows and columns of ``n_nodes`` and above are left out.
    """
    rows, columns, blocks = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
    keys = np.where((rows < n_nodes) & (columns < n_nodes), rows * n_nodes + columns, n_nodes**2)
    distinct_keys, places = np.unique(keys, return_inverse=True)
    values = np.zeros((len(distinct_keys), 3, 3))
    scatter(places, blocks, values)
    indptr = np.searchsorted(distinct_keys, np.arange(n_nodes + 1) * n_nodes)
    kept_keys = distinct_keys[: indptr[-1]]
    return sparse.bsr_array((values[: len(kept_keys)], kept_keys % n_nodes, indptr), shape=(3 * n_nodes, 3 * n_nodes))


@numba.njit(cache=True)
def scatter(places, blocks, values):
    """Add ``blocks`` (k, 3, 3) to those of ``values`` (m, 3, 3) at ``places`` (k,), which may repeat."""
    for k in range(len(places)):
        for i in range(3):
            for j in range(3):
                values[places[k], i, j] += blocks[k, i, j]


def product(matrix: sparse.bsr_array) -> Callable[[np.ndarray], np.ndarray]:
    """Return the product of ``matrix`` (3n, 3n), in 3 × 3 blocks, with arrays (n, 3), or (n, 3, k) at once."""

    def multiply(x: np.ndarray) -> np.ndarray:
        y = np.empty_like(x)
        (_multiply if x.ndim == 2 else _multiply_sides)(matrix.indptr, matrix.indices, matrix.data, x, y)
        return y

    return multiply


@numba.njit(cache=True)
def _multiply(indptr, indices, values, x, y):
    for i in range(len(y)):
        y0, y1, y2 = 0.0, 0.0, 0.0
        for k in range(indptr[i], indptr[i + 1]):
            a, b, c = x[indices[k], 0], x[indices[k], 1], x[indices[k], 2]
            y0 += values[k, 0, 0] * a + values[k, 0, 1] * b + values[k, 0, 2] * c
            y1 += values[k, 1, 0] * a + values[k, 1, 1] * b + values[k, 1, 2] * c
            y2 += values[k, 2, 0] * a + values[k, 2, 1] * b + values[k, 2, 2] * c
        y[i, 0], y[i, 1], y[i, 2] = y0, y1, y2


@numba.njit(cache=True)
def _multiply_sides(indptr, indices, values, x, y):
    """Do as ``_multiply`` does for ``x`` (n, 3, k); each block is read once for all k."""
    y[:] = 0.0
    for i in range(len(y)):
        for k in range(indptr[i], indptr[i + 1]):
            add_block(values[k], x[indices[k]], y[i])


@numba.njit(cache=True, inline="always")
def add_block(block, x, y):
    """Add the product of ``block`` (3, 3) with ``x`` (3, k) to ``y`` (3, k)."""
    a, b, c = block[0, 0], block[0, 1], block[0, 2]
    d, e, f = block[1, 0], block[1, 1], block[1, 2]
    g, h, w = block[2, 0], block[2, 1], block[2, 2]
    x0, x1, x2, y0, y1, y2 = x[0], x[1], x[2], y[0], y[1], y[2]
    for s in range(len(y0)):
        p, q, r = x0[s], x1[s], x2[s]
        y0[s] += a * p + b * q + c * r
        y1[s] += d * p + e * q + f * r
        y2[s] += g * p + h * q + w * r


@numba.njit(cache=True)
def hold(indptr, indices, values, held):
    """Replace the rows and columns of nodes ``held`` (n,) bool by those of the identity matrix, in place."""
    for i in range(len(indptr) - 1):
        for k in range(indptr[i], indptr[i + 1]):
            j = indices[k]
            if held[i] or held[j]:
                for p in range(3):
                    for q in range(3):
                        values[k, p, q] = 1.0 if i == j and p == q else 0.0
