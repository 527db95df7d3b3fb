"""Largest part of a motion before anything touches: additive continuous collision detection."""

import numba
import numpy as np

from palpate.collision.triangles.closest_points import closest, separation

SLACK = 0.1
"""Relative tolerance of the clearance to be kept, within which the search ends."""

MAX_STEPS = 1000
"""Most advances of one stencil; if more were needed, the part found safe until then is returned."""


@numba.njit(cache=True)
def limit(kinds, nodes, offsets, clearances, x, motion, keep=0.1):
    """Find the largest t in [0, 1] that leaves every stencil ``keep`` of its clearance while x moves by t ``motion``.

    kinds : (k,); nodes : (k, 4); offsets : (k,) [m]; x, motion : (n, 3) [m]; clearance is distance − offset
    clearances : (k,) [m], known lower bounds, which save the search where little moves; 0 if nothing is known
    1 where nothing comes that close; 0 where something touches or overlaps already, or the motion is not finite.

    Additive CCD (Li, Kaufman and Jiang 2021, algorithm 1): distances are bounded below for the length of a step,
    again and again, until little clearance is left; no roots are sought, so none is missed. The paper bounds the loss
    by the fastest nodes' speeds. Here a step may also be as long as a second bound allows: the two parts lie on either
    side of a slab across the direction n of their closest points, so min n·(xᵢ − xⱼ) over the nodes i of one part and j
    of the other, each of which changes linearly, is less than the distance at any time; sliding past costs one step.
    Traps: conservative; t may be short of the possible by SLACK of the kept clearance, and by more where parts rotate
    fast at hardly any clearance, so that MAX_STEPS end the search.
    """
    work, least = (np.empty((4, 3)), np.empty((4, 3)), np.empty(4)), 1.0
    for k in range(len(kinds)):
        if (
            clearances[k] > 0.0
            and _relative_motion(kinds[k], nodes[k], motion) < (1.0 - (1.0 + SLACK) * keep) * clearances[k]
        ):
            continue
        least = _advance(kinds[k], nodes[k], offsets[k], x, motion, keep, least, work)
    return least


@numba.njit(cache=True)
def _relative_motion(kind, nodes, motion):
    """Compute the largest relative motion [m] of a node of one part and one of the other; NaN if not finite."""
    ends, most = kind + 1, 0.0
    for i in range(ends):
        for j in range(ends, 4):
            square = 0.0
            for a in range(3):
                square += (motion[nodes[i], a] - motion[nodes[j], a]) ** 2
            if not square <= most:
                most = square
    return np.sqrt(most)


@numba.njit(cache=True)
def limits(kinds, nodes, offsets, x, motion, keep=0.1):
    """Find the ``limit`` of each stencil by itself, (k,)."""
    work, found = (np.empty((4, 3)), np.empty((4, 3)), np.empty(4)), np.empty(len(kinds))
    for k in range(len(kinds)):
        found[k] = _advance(kinds[k], nodes[k], offsets[k], x, motion, keep, 1.0, work)
    return found


@numba.njit(cache=True)
def _advance(kind, nodes, offset, x, motion, keep, longest, work):
    """Find the limit of one stencil, if it is less than ``longest``; work : its nodes, velocities and weights."""
    y, velocity, weights = work
    size = _velocities(nodes, motion, velocity)
    if not np.isfinite(size):
        return 0.0
    t, kept, rows = 0.0, 0.0, np.arange(4)
    for step in range(MAX_STEPS):
        for i in range(4):
            for j in range(3):
                y[i, j] = x[nodes[i], j] - x[nodes[0], j] + t * velocity[i, j]
        distance, _ = closest(kind, y, rows, weights)
        if step == 0:
            if not distance - offset > 0.0:
                return 0.0
            kept = keep * (distance - offset)
        elif distance - offset <= (1.0 + SLACK) * kept:
            return t / size
        t += _safe_step(kind, y, velocity, separation(y, rows, weights), distance, offset + kept)
        if t >= longest * size:
            return longest
    return t / size


@numba.njit(cache=True)
def _velocities(nodes, motion, velocity):
    """Write motions relative to the first node's, over the largest component, which is returned; 1 if it is 0.

    So squares of long and short ones neither overflow nor vanish.
    """
    size = 0.0
    for i in range(4):
        for j in range(3):
            velocity[i, j] = motion[nodes[i], j] - motion[nodes[0], j]
            if not np.isfinite(velocity[i, j]):
                return np.inf
            size = max(size, abs(velocity[i, j]))
    if size == 0.0:
        return 1.0
    velocity /= size
    return size


@numba.njit(cache=True, error_model="numpy")
def _safe_step(kind, y, velocity, r, distance, least):
    """Bound the time for which the distance exceeds ``least`` [m], by slab and by speed; the longer one, or inf.

    Where rounding of ``r`` tilts the slab so that nodes reach into it only the speed counts, which needs no direction.
    """
    ends, by_slab, fastest = kind + 1, np.inf, 0.0
    for i in range(ends):
        for j in range(ends, 4):
            apart, closing, square = 0.0, 0.0, 0.0
            for a in range(3):
                speed = velocity[j, a] - velocity[i, a]
                apart += r[a] / distance * (y[i, a] - y[j, a])
                closing += r[a] / distance * speed
                square += speed * speed
            fastest = max(fastest, square)
            if apart < least:
                by_slab = 0.0
            elif closing > 0.0:
                by_slab = min(by_slab, (apart - least) / closing)
    return max(by_slab, (distance - least) / np.sqrt(fastest)) if fastest > 0.0 else np.inf
