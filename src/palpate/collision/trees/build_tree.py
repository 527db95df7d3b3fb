"""Binary tree over triangles, split by the surface area heuristic or at the median, as flat arrays."""

import numba
import numpy as np

LEAF = 1
"""Most triangles in a leaf: 2 would be 10 % faster, but pass twice as many pairs to the exact test."""
BINS = 16
CHILD, FIRST, LAST, KIND = range(4)
"""Columns of a tree's nodes: left child (the right one is next; -1 in leaves), the range of triangles, volume kind."""


@numba.njit(cache=True)
def triangle_boxes(points, triangles, boxes, centres):
    """Compute the least and greatest coordinates (m, 6) of triangles, and the midpoints between them (m, 3) [m]."""
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        for i in range(3):
            low = min(points[a, i], points[b, i], points[c, i])
            high = max(points[a, i], points[b, i], points[c, i])
            boxes[t, i], boxes[t, 3 + i], centres[t, i] = low, high, 0.5 * low + 0.5 * high


@numba.njit(cache=True)
def build(boxes, centres, leaf, heuristic):
    """Build nodes (n, 4) int32, with their level as kind; the order of the triangles (m,) int32; the tree's height.

    Siblings are adjacent and precede their descendants; so a backward loop reaches children before parents.
    The heuristic (MacDonald, Booth 1990, over Wald's 2007 bins) is replaced by the median where all splits cost the
    same, or where it has become much deeper than the median would.
    """
    m = len(boxes)
    nodes, order = np.empty((max(2 * m - 1, 1), 4), np.int32), np.arange(m).astype(np.int32)
    deepest, height, used = 2 * int(np.log2(m + 1)) + 8, 0, 1
    stack = np.empty((3 * deepest, 4), np.int64)
    stack[0, 0], stack[0, 1], stack[0, 2], stack[0, 3] = 0, 0, m, 0
    depth = 1
    extent, bins, counts = np.empty((2, 3)), np.empty((BINS, 6)), np.empty(BINS, np.int64)
    right = np.empty(BINS)
    while depth:
        depth -= 1
        node, first, last, level = stack[depth, 0], stack[depth, 1], stack[depth, 2], stack[depth, 3]
        height = max(height, level)
        nodes[node, CHILD], nodes[node, FIRST], nodes[node, LAST], nodes[node, KIND] = -1, first, last, level
        if last - first <= leaf:
            continue
        _centre_extent(centres, order, first, last, extent)
        cut = -1
        if heuristic and last - first > 2 and level < deepest:
            cut = _split_by_cost(boxes, centres, order, first, last, extent, bins, counts, right)
        if cut < 0:
            cut = _split_at_median(centres, order, first, last, extent)
        nodes[node, CHILD] = used
        for side, start, end in ((1, cut, last), (0, first, cut)):
            stack[depth, 0], stack[depth, 1], stack[depth, 2], stack[depth, 3] = used + side, start, end, level + 1
            depth += 1
        used += 2
    return nodes[:used].copy(), order, height


@numba.njit(cache=True)
def _centre_extent(centres, order, first, last, extent):
    """Write the least and greatest centre, by coordinate."""
    t = order[first]
    for i in range(3):
        extent[0, i] = extent[1, i] = centres[t, i]
    for k in range(first + 1, last):
        t = order[k]
        for i in range(3):
            extent[0, i], extent[1, i] = min(extent[0, i], centres[t, i]), max(extent[1, i], centres[t, i])


@numba.njit(cache=True, error_model="numpy")
def _split_by_cost(boxes, centres, order, first, last, extent, bins, counts, right):
    """Split the range where Σ area × count over both sides is least; return the position, -1 if there is none."""
    best, axis, border = np.inf, -1, 0
    used = min(BINS, last - first)
    for i in range(3):
        scale = used / (extent[1, i] - extent[0, i])
        if not (scale > 0.0 and scale < np.inf):
            continue
        bins[:used, :3], bins[:used, 3:], counts[:used] = np.inf, -np.inf, 0
        for k in range(first, last):
            t = order[k]
            b = min(int((centres[t, i] - extent[0, i]) * scale), used - 1)
            counts[b] += 1
            _enlarge(bins[b], boxes[t])
        _areas_from_right(bins, counts, used, right)
        for b in range(used - 1):
            if b:
                _enlarge(bins[b], bins[b - 1])
                counts[b] += counts[b - 1]
            if 0 < counts[b] < last - first:
                cost = _half_surface(bins[b]) * counts[b] + right[b + 1]
                if cost < best:
                    best, axis, border = cost, i, b
    if axis < 0:
        return -1
    scale = used / (extent[1, axis] - extent[0, axis])
    i, j = first, last - 1
    while i <= j:
        if min(int((centres[order[i], axis] - extent[0, axis]) * scale), used - 1) <= border:
            i += 1
        else:
            order[i], order[j] = order[j], order[i]
            j -= 1
    return i


@numba.njit(cache=True)
def _areas_from_right(bins, counts, used, right):
    """Accumulate area × count of the bins from each one on."""
    lx = ly = lz = np.inf
    hx = hy = hz = -np.inf
    count = 0
    for b in range(used - 1, 0, -1):
        row = bins[b]
        lx, ly, lz = min(lx, row[0]), min(ly, row[1]), min(lz, row[2])
        hx, hy, hz = max(hx, row[3]), max(hy, row[4]), max(hz, row[5])
        count += counts[b]
        right[b] = ((hx - lx) * (hy - ly) + (hy - ly) * (hz - lz) + (hz - lz) * (hx - lx)) * count


@numba.njit(cache=True)
def _enlarge(row, other):
    for i in range(3):
        row[i], row[3 + i] = min(row[i], other[i]), max(row[3 + i], other[3 + i])


@numba.njit(cache=True)
def _half_surface(row):
    """Compute half the surface."""
    x, y, z = row[3] - row[0], row[4] - row[1], row[5] - row[2]
    return x * y + y * z + z * x


@numba.njit(cache=True)
def _split_at_median(centres, order, first, last, extent):
    """Split the range at the median along its longest side (Hoare's selection); return the position."""
    axis = 0
    for i in range(1, 3):
        if extent[1, i] - extent[0, i] > extent[1, axis] - extent[0, axis]:
            axis = i
    middle = (first + last) // 2
    low, high = first, last - 1
    while low < high:
        pivot = centres[order[(low + high) // 2], axis]
        i, j = low, high
        while i <= j:
            while centres[order[i], axis] < pivot:
                i += 1
            while centres[order[j], axis] > pivot:
                j -= 1
            if i <= j:
                order[i], order[j] = order[j], order[i]
                i += 1
                j -= 1
        if middle <= j:
            high = j
        elif middle >= i:
            low = i
        else:
            break
    return middle
