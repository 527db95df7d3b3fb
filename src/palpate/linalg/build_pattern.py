"""The rows of a mesh's block pattern and the places of element blocks in it, in linear time."""

import numba
import numpy as np


def rows_and_slots(couples: list[np.ndarray], n_nodes: int) -> tuple[np.ndarray, np.ndarray, list[np.ndarray]]:
    """Return indptr (n_nodes + 1,), indices and, for each kind of element (m, k) of ``couples``, slots (m, k, k).

    Indices increase within a row. Every row has its diagonal block, used or not.
    """
    if not couples:
        return np.arange(n_nodes + 1, dtype=np.int32), np.arange(n_nodes, dtype=np.int32), []
    widths = np.repeat([kind.shape[1] for kind in couples], [len(kind) for kind in couples])
    first, places = (np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64) for sizes in (widths, widths**2))
    nodes = np.concatenate([kind.ravel() for kind in couples]).astype(np.int32)
    indptr, indices, slots = _build(nodes, first, places, n_nodes)
    parts = np.split(slots, np.cumsum([len(kind) * kind.shape[1] ** 2 for kind in couples])[:-1])
    return indptr, indices, [p.reshape(-1, k.shape[1], k.shape[1]) for p, k in zip(parts, couples, strict=True)]


@numba.njit(cache=True)
def _build(nodes, first, places, n_nodes):
    """Build the pattern of elements, element e being ``nodes[first[e] : first[e + 1]]``."""
    ends, elements = _around(nodes, first, n_nodes)
    indptr, latest = np.zeros(n_nodes + 1, dtype=np.int32), np.full(n_nodes, -1, dtype=np.int32)
    for i in range(n_nodes):
        count, latest[i] = 1, i
        for e in elements[ends[i] : ends[i + 1]]:
            for j in nodes[first[e] : first[e + 1]]:
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
            for j in nodes[first[e] : first[e + 1]]:
                if latest[j] < begin:
                    indices[end], latest[j] = j, end
                    end += 1
        indices[begin:end].sort()
        for k in range(begin, end):
            latest[indices[k]] = k
        for e in elements[ends[i] : ends[i + 1]]:
            width = first[e + 1] - first[e]
            for a in range(width):
                if nodes[first[e] + a] == i:
                    for b in range(width):
                        slots[places[e] + a * width + b] = latest[nodes[first[e] + b]]
    return indptr, indices, slots


@numba.njit(cache=True)
def _around(nodes, first, n_nodes):
    """Return the elements around each node i, ``elements[ends[i] : ends[i + 1]]``."""
    ends = np.zeros(n_nodes + 1, dtype=np.int64)
    for i in nodes:
        ends[i + 1] += 1
    ends = np.cumsum(ends)
    elements, filled = np.empty(len(nodes), dtype=np.int32), ends[:-1].copy()
    for e in range(len(first) - 1):
        for i in nodes[first[e] : first[e + 1]]:
            elements[filled[i]] = e
            filled[i] += 1
    return ends, elements
