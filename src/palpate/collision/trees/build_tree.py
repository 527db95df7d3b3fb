"""Binary tree over triangles, split by the surface area heuristic, as flat arrays, and its refit.

A refit goes from the leaves up; axes of OBBs rotate with the triangles, so that they are not computed anew.
"""

import numba
import numpy as np

from palpate.collision.trees.volumes import BOTH, ULP, fit_along, fit_box, fit_dop, fit_obb, fit_sphere, merge_bounds

LEAF = 1
"""Most triangles in a leaf: 2 would be 10 % faster, but pass twice as many pairs to the exact test."""
BINS = 16
CHILD, FIRST, LAST, KIND = range(4)
"""Columns of a tree's nodes: left child (the right one is next; -1 in leaves), the range of triangles, volume kind."""


@numba.njit(cache=True)
def triangle_boxes(points, triangles):
    """Compute the least and greatest coordinates (m, 6) of triangles, and the midpoints between them (m, 3) [m]."""
    boxes, centres = np.empty((len(triangles), 6)), np.empty((len(triangles), 3))
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        for i in range(3):
            low = min(points[a, i], points[b, i], points[c, i])
            high = max(points[a, i], points[b, i], points[c, i])
            boxes[t, i], boxes[t, 3 + i], centres[t, i] = low, high, 0.5 * low + 0.5 * high
    return boxes, centres


@numba.njit(cache=True)
def build(boxes, centres, leaf):
    """Build nodes (n, 4) int32, with their level as kind; the order of the triangles (m,) int32; the tree's height.

    Siblings are adjacent and precede their descendants; so a backward loop reaches children before parents.
    The heuristic (MacDonald, Booth 1990, over Wald's 2007 bins) is replaced by the median where all splits cost the
    same, or where it has become much deeper than the median would.
    """
    m = len(boxes)
    nodes, order = np.empty((max(2 * m - 1, 1), 4), np.int32), np.arange(m).astype(np.int32)
    deepest, height, count = 2 * int(np.log2(m + 1)) + 8, 0, 1
    stack = np.empty((3 * deepest, 4), np.int64)  # nodes to split: node, range of triangles, level
    stack[0, 0], stack[0, 1], stack[0, 2], stack[0, 3] = 0, 0, m, 0
    top = 1
    extent, bins, counts = np.empty((2, 3)), np.empty((BINS, 6)), np.empty(BINS, np.int64)
    costs = np.empty(BINS)
    while top:
        top -= 1
        node, first, last, level = stack[top, 0], stack[top, 1], stack[top, 2], stack[top, 3]
        height = max(height, level)
        nodes[node, CHILD], nodes[node, FIRST], nodes[node, LAST], nodes[node, KIND] = -1, first, last, level
        if last - first <= leaf:
            continue
        _centre_extent(centres, order, first, last, extent)
        cut = -1
        if last - first > 2 and level < deepest:
            cut = _split_by_cost(boxes, centres, order, first, last, extent, bins, counts, costs)
        if cut < 0:
            cut = _split_at_median(centres, order, first, last, extent)
        nodes[node, CHILD] = count
        for side, start, end in ((1, cut, last), (0, first, cut)):
            stack[top, 0], stack[top, 1], stack[top, 2], stack[top, 3] = count + side, start, end, level + 1
            top += 1
        count += 2
    return nodes[:count].copy(), order, height


@numba.njit(cache=True)
def _centre_extent(centres, order, first, last, extent):
    """Write the least and greatest coordinates of a range's centres into ``extent`` (2, 3)."""
    t = order[first]
    for i in range(3):
        extent[0, i] = extent[1, i] = centres[t, i]
    for k in range(first + 1, last):
        t = order[k]
        for i in range(3):
            extent[0, i], extent[1, i] = min(extent[0, i], centres[t, i]), max(extent[1, i], centres[t, i])


@numba.njit(cache=True, error_model="numpy")
def _split_by_cost(boxes, centres, order, first, last, extent, bins, counts, costs):
    """Split the range where Σ area × count over both sides is least; return the position, -1 if there is none."""
    best, axis, border = np.inf, -1, 0
    n_bins = min(BINS, last - first)
    for i in range(3):
        scale = n_bins / (extent[1, i] - extent[0, i])
        if not (scale > 0.0 and scale < np.inf):
            continue
        bins[:n_bins, :3], bins[:n_bins, 3:], counts[:n_bins] = np.inf, -np.inf, 0
        for k in range(first, last):
            t = order[k]
            b = min(int((centres[t, i] - extent[0, i]) * scale), n_bins - 1)
            counts[b] += 1
            _enlarge(bins[b], boxes[t])
        _areas_from_right(bins, counts, n_bins, costs)
        for b in range(n_bins - 1):
            if b:
                _enlarge(bins[b], bins[b - 1])
                counts[b] += counts[b - 1]
            if 0 < counts[b] < last - first:
                cost = _half_surface(bins[b]) * counts[b] + costs[b + 1]
                if cost < best:
                    best, axis, border = cost, i, b
    if axis < 0:
        return -1
    scale = n_bins / (extent[1, axis] - extent[0, axis])
    i, j = first, last - 1
    while i <= j:
        if min(int((centres[order[i], axis] - extent[0, axis]) * scale), n_bins - 1) <= border:
            i += 1
        else:
            order[i], order[j] = order[j], order[i]
            j -= 1
    return i


@numba.njit(cache=True)
def _areas_from_right(bins, counts, n_bins, costs):
    """Write into ``costs[b]`` half the surface of the box around bins b and following, times their triangles."""
    lx = ly = lz = np.inf
    hx = hy = hz = -np.inf
    count = 0
    for b in range(n_bins - 1, 0, -1):
        row = bins[b]
        lx, ly, lz = min(lx, row[0]), min(ly, row[1]), min(lz, row[2])
        hx, hy, hz = max(hx, row[3]), max(hy, row[4]), max(hz, row[5])
        count += counts[b]
        costs[b] = ((hx - lx) * (hy - ly) + (hy - ly) * (hz - lz) + (hz - lz) * (hx - lx)) * count


@numba.njit(cache=True)
def _enlarge(row, other):
    for i in range(3):
        row[i], row[3 + i] = min(row[i], other[i]), max(row[3 + i], other[3 + i])


@numba.njit(cache=True)
def _half_surface(row):
    """Compute half the surface of the box ``row`` (6,)."""
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


@numba.njit(cache=True)
def gather_corners(points, triangles, corners):
    """Gather the corners of the leaves' triangles in order.

    corners : (3m, 3), overwritten; a node's corners are one range of them
    Returns whether all are finite: ``probe`` stays 0 then.
    """
    probe = 0.0
    for t in range(len(triangles)):
        for k in range(3):
            node = triangles[t, k]
            for i in range(3):
                corners[3 * t + k, i] = points[node, i]
                probe += 0.0 * points[node, i]
    return probe == 0.0


@numba.njit(cache=True)
def refit_boxes(nodes, corners, pad, boxes, spheres):
    """Refit AABBs of all nodes from their children's, and spheres of those that have one.

    A sphere is centred in the AABB and reaches the farthest of all the node's corners: O(m) per level, and much tighter
    than around its children's spheres, whose slack adds up.
    """
    for n in range(len(nodes) - 1, -1, -1):
        first, last = 3 * nodes[n, FIRST], 3 * nodes[n, LAST]
        if nodes[n, CHILD] < 0:
            fit_box(corners, first, last, boxes, n)
            for i in range(3):
                boxes[n, i] -= pad
                boxes[n, 3 + i] += pad
        else:
            merge_bounds(3, boxes, n, nodes[n, CHILD])
        if nodes[n, KIND] <= BOTH:
            for i in range(3):
                spheres[n, i] = 0.5 * boxes[n, i] + 0.5 * boxes[n, 3 + i]
            fit_sphere(corners, first, last, spheres, n)
            spheres[n, 3] += pad


@numba.njit(cache=True)
def refit_dops(nodes, corners, pad, directions, boxes):
    """Refit k-DOPs: of leaves around their corners, of other nodes around their children's, which is lossless."""
    half = len(directions)
    for n in range(len(nodes) - 1, -1, -1):
        if nodes[n, CHILD] < 0:
            fit_dop(corners, 3 * nodes[n, FIRST], 3 * nodes[n, LAST], directions, boxes, n)
            for k in range(half):
                length = np.sqrt(directions[k, 0] ** 2 + directions[k, 1] ** 2 + directions[k, 2] ** 2)
                boxes[n, k] -= pad * length * (1.0 + ULP)
                boxes[n, half + k] += pad * length * (1.0 + ULP)
        else:
            merge_bounds(half, boxes, n, nodes[n, CHILD])


@numba.njit(cache=True)
def box_areas(nodes, corners):
    """Sum the surface of the AABBs of all nodes, without margins, relative to the root's: the cost of a search.

    0 where the root has no surface.
    """
    boxes, total, area = np.empty((len(nodes), 6)), 0.0, 0.0
    for n in range(len(nodes) - 1, -1, -1):
        if nodes[n, CHILD] < 0:
            fit_box(corners, 3 * nodes[n, FIRST], 3 * nodes[n, LAST], boxes, n)
        else:
            merge_bounds(3, boxes, n, nodes[n, CHILD])
        x, y, z = boxes[n, 3] - boxes[n, 0], boxes[n, 4] - boxes[n, 1], boxes[n, 5] - boxes[n, 2]
        area = x * y + y * z + z * x  # the last is the root's
        total += area
    return total / area if area > 0.0 and total < np.inf else 0.0


@numba.njit(cache=True)
def refit_obbs(nodes, corners, pad, corner_offsets, axes, boxes):
    """Refit OBBs with axes that rotate with three corners of each node, around all its corners: O(m) per level.

    So a rigid motion keeps them as tight as when they were chosen, and no motion makes them miss a corner.
    """
    turned, frame = np.empty((3, 3)), np.empty((3, 3))
    for n in range(len(nodes)):
        first, last = 3 * nodes[n, FIRST], 3 * nodes[n, LAST]
        _frame(corners, first, corner_offsets[n, 0], corner_offsets[n, 1], frame)
        for i in range(3):
            for j in range(3):
                turned[i, j] = axes[n, i, 0] * frame[0, j] + axes[n, i, 1] * frame[1, j] + axes[n, i, 2] * frame[2, j]
        fit_along(corners, first, last, turned, boxes, n)
        for k in range(12, 15):
            boxes[n, k] += pad


@numba.njit(cache=True)
def choose_axes(nodes, corners, corner_offsets, axes):
    """Choose the axes of each node's OBB, written as coordinates (3, 3) in a frame of three of its corners.

    corners : (3m, 3); corner_offsets : (2,) of each node, overwritten: the frame's second corner, the farthest from the
        node's first, and the third, the farthest from the line through both, counted from the first
    """
    obb, frame = np.empty((1, 15)), np.empty((3, 3))
    for n in range(len(nodes)):
        first, last = 3 * nodes[n, FIRST], 3 * nodes[n, LAST]
        corner_offsets[n, 0] = corner_offsets[n, 1] = 0
        best = 0.0
        for p in range(first + 1, last):
            distance = 0.0
            for i in range(3):
                distance += abs(corners[p, i] - corners[first, i])
            if distance > best:
                best, corner_offsets[n, 0] = distance, p - first
        _frame(corners, first, corner_offsets[n, 0], 0, frame)
        best = 0.0
        for p in range(first + 1, last):
            distance = 0.0
            for k in range(1, 3):
                along = 0.0
                for i in range(3):
                    along += frame[k, i] * (corners[p, i] - corners[first, i])
                distance += abs(along)
            if distance > best:
                best, corner_offsets[n, 1] = distance, p - first
        _frame(corners, first, corner_offsets[n, 0], corner_offsets[n, 1], frame)
        fit_obb(corners, first, last, obb, 0)
        for i in range(3):
            for k in range(3):
                axes[n, i, k] = 0.0
                for j in range(3):
                    axes[n, i, k] += obb[0, 3 + 3 * i + j] * frame[k, j]


@numba.njit(cache=True)
def _frame(corners, first, second, third, frame):
    """Build an orthonormal frame, one axis per row: along one edge, then the other; any that fits where they vanish."""
    for k in range(2):
        p = first + (second if k == 0 else third)
        for i in range(3):
            frame[k, i] = corners[p, i] - corners[first, i]
    if not _normalise(frame, 0):
        frame[0, 0], frame[0, 1], frame[0, 2] = 1.0, 0.0, 0.0
    if not _normalise(frame, 1) or not _straighten(frame):
        smallest = 0
        for i in range(1, 3):
            if abs(frame[0, i]) < abs(frame[0, smallest]):
                smallest = i
        for i in range(3):
            frame[1, i] = 1.0 if i == smallest else 0.0
        _straighten(frame)
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        frame[2, i] = frame[0, j] * frame[1, k] - frame[0, k] * frame[1, j]


@numba.njit(cache=True)
def _straighten(frame):
    """Orthogonalise the second axis to the first, twice because of rounding; return False if it is parallel."""
    for _ in range(2):
        along, square = 0.0, 0.0
        for i in range(3):
            along += frame[0, i] * frame[1, i]
        for i in range(3):
            frame[1, i] -= along * frame[0, i]
            square += frame[1, i] ** 2
        if not square > 1e-12:
            return False
        _normalise(frame, 1)
    return True


@numba.njit(cache=True, error_model="numpy")
def _normalise(frame, k):
    """Scale a row to unit length; return False if it has no reliable length."""
    scale = max(abs(frame[k, 0]), abs(frame[k, 1]), abs(frame[k, 2]))
    if not (scale > 0.0 and scale < np.inf and 1.0 / scale < np.inf):
        return False
    x, y, z = frame[k, 0] / scale, frame[k, 1] / scale, frame[k, 2] / scale
    length = np.sqrt(x * x + y * y + z * z)
    frame[k, 0], frame[k, 1], frame[k, 2] = x / length, y / length, z / length
    return True
