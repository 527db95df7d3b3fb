"""A start without overlap for a scene whose bodies begin inside each other: each is shifted out of the other."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from palpate.bodies.mesh import corner_normals
from palpate.collision.contact.obstacles import Overlap, displace_nodes
from palpate.collision.contact.proximity import Proximity
from palpate.errors import InputError, NotConverged

MAX_ROUNDS = 20
"""Most pairs that are separated for each surface: one that is moved may meet the next."""
HALVINGS = 12
"""Halvings of the interval in which the least shift is sought."""
GRID = np.array([[i, j, k] for i in (-1, 0, 1) for j in (-1, 0, 1) for k in (-1, 0, 1) if (i, j, k) != (0, 0, 0)])
DIRECTIONS = GRID / np.linalg.norm(GRID, axis=1)[:, None]
"""Directions that are tried besides the normals of both surfaces' triangles, (26, 3)."""


@dataclass(frozen=True, eq=False)
class Movable:
    """The surfaces that can be shifted to end an overlap, and the nodes and points of each.

    together : the nodes (k,) of each piece; obstacles : the points of each obstacle, numbered after the nodes
    surfaces : triangles (m, 3) of each piece, then of each obstacle; radii : (p,) [m]; floors : (p,) bool, likewise
    masses : (n,) [kg]; free : (n,) bool, the nodes that are not held; gap_m : clearance to leave [m]
    """

    together: list[np.ndarray]
    obstacles: list[slice]
    surfaces: list[np.ndarray]
    radii: np.ndarray
    floors: np.ndarray
    masses: np.ndarray
    free: np.ndarray
    gap_m: float

    def shares(self, first: int, second: int) -> tuple[float, float]:
        """Return the fractions of a separation by which two surfaces move; (0, 0) if neither can.

        Pieces without a held node move in inverse proportion to their masses, an instrument only if no piece can.
        """
        mobility = [self._lightness(surface) for surface in (first, second)]
        if sum(mobility) == 0.0:
            mobility = [float(s >= len(self.together) and not self.floors[s]) for s in (first, second)]
        total = sum(mobility) or 1.0
        return mobility[0] / total, mobility[1] / total

    def moved(self, surface: int) -> np.ndarray | slice:
        """Return the points that move with a surface."""
        count = len(self.together)
        return self.together[surface] if surface < count else self.obstacles[surface - count]

    def _lightness(self, surface: int) -> float:
        if surface >= len(self.together) or not self.free[self.together[surface]].all():
            return 0.0
        return 1.0 / float(self.masses[self.together[surface]].sum())


def start_outside(
    points: np.ndarray,
    movable: Movable,
    find: Callable[[np.ndarray], Overlap | None],
    proximity: Proximity,
    names: list[str],
) -> np.ndarray:
    """Return the nodes (n, 3) [m] moved out of all overlaps at ``points``, which are nodes and then obstacles' points.

    Free pieces are shifted as wholes. Where a held body and an instrument overlap, the instrument is shifted out and
    back, and displaces the nodes in its path. Raises InputError, with ``names`` of surfaces, if overlaps remain.
    """
    count = len(movable.free)
    separated = push_apart(points, movable, find)
    overlap = find(separated)
    if overlap is not None:
        raise InputError(f"{overlap.describe(names)[:-1]}, since push_out found no way out.")
    back = np.zeros_like(points)
    back[count:] = points[count:] - separated[count:]
    if not back.any():
        return separated[:count]
    try:
        return displace_nodes(proximity, separated, back, count, names)
    except NotConverged as failure:
        raise InputError(f"push_out: {failure}.") from failure


def push_apart(points: np.ndarray, movable: Movable, find: Callable[[np.ndarray], Overlap | None]) -> np.ndarray:
    """Return points (n, 3) [m] of surfaces that are shifted until ``find`` returns no overlap, or one that remains.

    Each pair is separated along the direction of least overlap of convex hulls, until surfaces are a gap apart.
    """
    for _ in range(MAX_ROUNDS * len(movable.surfaces)):
        overlap = find(points)
        if overlap is None or overlap.first == overlap.second:
            break
        pair = (overlap.first, overlap.second)
        shares = movable.shares(*pair)
        if not any(shares):
            break
        separation = shortest_separation(points, movable, pair)
        shift = np.zeros_like(points)
        for surface, share in zip(pair, (shares[0], -shares[1]), strict=True):
            shift[movable.moved(surface)] = share * separation

        def meets(fraction: float, origin: np.ndarray = points, motion: np.ndarray = shift, pair: tuple = pair) -> bool:
            met = find(origin + fraction * motion)
            return met is not None and {met.first, met.second} == set(pair)

        fraction = _least_part(meets) + movable.gap_m / float(np.linalg.norm(separation))
        points = points + min(1.0, fraction) * shift
    return points


def shortest_separation(points: np.ndarray, movable: Movable, pair: tuple[int, int]) -> np.ndarray:
    """Return the shortest shift (3,) [m] of the first of a pair of surfaces that leaves a gap between the convex hulls.

    The directions are the normals of both surfaces' triangles and DIRECTIONS; of a floor only its normal.
    """
    triangles = [points[movable.surfaces[surface]] for surface in pair]
    directions = np.vstack([-_normals(triangles[0]), _normals(triangles[1]), DIRECTIONS])
    for number, sign in ((1, 1.0), (0, -1.0)):
        if movable.floors[pair[number]]:
            directions = sign * _normals(triangles[number])
    # along each direction, the first moves until its hindmost point is ahead of the foremost of the second
    hindmost, foremost = (triangles[0] @ directions.T).min(axis=(0, 1)), (triangles[1] @ directions.T).max(axis=(0, 1))
    lengths = foremost - hindmost + movable.radii[pair[0]] + movable.radii[pair[1]] + movable.gap_m
    best = int(np.argmin(lengths))
    return float(lengths[best]) * directions[best]


def _least_part(meets: Callable[[float], bool]) -> float:
    """Return the smallest fraction of a shift, at most 1, at which the surfaces do not meet, by bisection."""
    low, high = 0.0, 1.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if meets(middle) else (low, middle)
    return high


def _normals(triangles: np.ndarray) -> np.ndarray:
    """Return the unit normals (k, 3) of those of the triangles (m, 3, 3) [m] that have an area."""
    raw = corner_normals(triangles)
    lengths = np.linalg.norm(raw, axis=1)
    return raw[lengths > 0.0] / lengths[lengths > 0.0, None]
