"""How far a motion may go before anything touches: additive continuous collision detection."""

import numba
import numpy as np

from palpate.collision.triangles.closest_points import closest, separation

SLACK = 0.1
"""The search ends within this part of the room that has to be kept."""

MOST_STEPS = 1000
"""Advances of one stencil; where more would be needed what has been found safe until then is returned."""


@numba.njit(cache=True)
def limit(kinds, nodes, offsets, rooms, x, motion, keep=0.1):
    """The largest t in [0, 1] known to leave every stencil ``keep`` of its present room while x moves by t ``motion``.

    kinds : (k,); nodes : (k, 4); offsets : (k,) [m]; x, motion : (n, 3) [m]; room is distance − offset; rooms : (k,)
    [m], what it is known not to be less than, which spares looking where little moves, 0 if nothing is known.
    1 where nothing comes that close; 0 where something touches or overlaps already, or the motion is not finite.

    Additive CCD (Li, Kaufman and Jiang 2021, algorithm 1): distances are bounded below for as long as a step takes,
    again and again, until little room is left; no roots are sought, so none is missed. The paper bounds the loss by
    the fastest nodes' speeds. Here a step is also as long as a second bound allows: the two parts lie on either side
    of a slab across the direction n of their closest points, so min n·(xᵢ − xⱼ) over the nodes i of one part and j of
    the other, each of which changes linearly, is less than the distance at any time; sliding past costs one step.
    Traps: conservative; t may end short of what is possible by SLACK of the kept room, and by more where parts turn
    fast with hardly any room between them, so that MOST_STEPS end it.
    """
    work, least = _work(), 1.0
    for k in range(len(kinds)):
        if rooms[k] > 0.0 and _closing(kinds[k], nodes[k], motion) < (1.0 - (1.0 + SLACK) * keep) * rooms[k]:
            continue
        least = _advance(kinds[k], nodes[k], offsets[k], x, motion, keep, least, work)
    return least


@numba.njit(cache=True)
def _closing(kind, nodes, motion):
    """How far a node of one part and one of the other move against each other at most [m]; NaN if one is not finite."""
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
    """What ``limit`` finds for each stencil by itself, (k,)."""
    work, found = _work(), np.empty(len(kinds))
    for k in range(len(kinds)):
        found[k] = _advance(kinds[k], nodes[k], offsets[k], x, motion, keep, 1.0, work)
    return found


@numba.njit(cache=True)
def _work():
    """Arrays that are written again for each stencil: nodes, velocities, weights."""
    return np.empty((4, 3)), np.empty((4, 3)), np.empty(4)


@numba.njit(cache=True)
def _advance(kind, nodes, offset, x, motion, keep, longest, work):
    """The limit of one stencil, where it is less than ``longest``."""
    y, velocity, weights = work
    size = _velocities(nodes, motion, velocity)
    if not np.isfinite(size):
        return 0.0
    t, kept, rows = 0.0, 0.0, np.arange(4)
    for step in range(MOST_STEPS):
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
    """Write motions against the first node's, in parts of the largest component, which is returned; 1 if it is 0.

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
    """How long the distance stays above ``least`` [m] by the better of the bounds of slab and speed; inf if for ever.

    Where rounding of ``r`` turns the slab so that nodes reach into it only the speed counts, which needs no direction.
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
