"""Measures of contact that a wrong answer fails: bodies have to come near each other, and must not cross."""

from collections.abc import Callable, Sequence

import numpy as np

from palpate.collision.triangles.brute_force import crossing
from palpate.collision.triangles.distance import triangle_pairs_distance
from palpate.scenes.motion import Motion
from palpate.studies.hard_cases.hard_case import Answer

NEAR = 0.002
"""Distance at which bodies count as having met, in sizes of the smallest; they begin to repel at half of it."""
MEETS = "least distance of the bodies / the size of one; 1 and more, the number of crossing triangles, if they cross"
LANDS = "least height of the surface over the floor / the body's size; 1 and more if it is below"
MOST_FRAMES = 100
"""Frames of a motion that are looked at, evenly over time."""

Surfaces = Sequence[tuple[np.ndarray, np.ndarray]]
"""Pairs of surfaces that have to meet, each as triangles (m, 3)."""


def frames(motion: Motion) -> np.ndarray:
    """Return MOST_FRAMES of the positions (k, n, 3) [m] of a motion, the first and the last among them."""
    count = len(motion.positions)
    return motion.positions[np.unique(np.linspace(0, count - 1, min(count, MOST_FRAMES)).round().astype(int))]


def answer(found: np.ndarray, error: Callable[[np.ndarray], float]) -> Answer:
    """Return the answer of a motion, of which a frozen one repeats the first frame; ``found`` (k, n, 3) [m]."""
    return Answer(found, found[0], error)


def meets(pairs: Surfaces, size: float) -> Callable[[np.ndarray], float]:
    """Measure frames (k, n, 3) [m] by MEETS: each pair of surfaces has to be near in one of them, and cross in none."""

    def error(a: np.ndarray) -> float:
        count = sum(len(crossing([x, x], list(pair))) for x in a for pair in pairs)
        if count:
            return 1.0 + count
        return max(min(least_distance(x, *pair, size) for x in a) for pair in pairs) / size

    return error


def least_distance(x: np.ndarray, one: np.ndarray, other: np.ndarray, reach: float) -> float:
    """Compute the least distance of two surfaces at ``x`` (n, 3) [m], or ``reach`` [m] if their boxes are farther."""
    a, b = x[one], x[other]
    near_a, near_b = _near(a, b, reach), _near(b, a, reach)
    if not near_a.any() or not near_b.any():
        return reach
    rows, columns = (grid.ravel() for grid in np.meshgrid(np.flatnonzero(near_a), np.flatnonzero(near_b)))
    return min(reach, float(triangle_pairs_distance(a[rows], b[columns])[0].min()))


def _near(a: np.ndarray, b: np.ndarray, reach: float) -> np.ndarray:
    """Return which triangles ``a`` (m, 3, 3) have a box within a twentieth of ``reach`` of the box around ``b``."""
    low, high = b.min(axis=(0, 1)) - 0.05 * reach, b.max(axis=(0, 1)) + 0.05 * reach
    return ((a.max(axis=1) >= low) & (a.min(axis=1) <= high)).all(axis=1)


def distance_of_axis(x: np.ndarray, triangles: np.ndarray, axis: np.ndarray) -> float:
    """Compute the least distance [m] of a surface at ``x`` (n, 3) [m] from the axis (2, 3) [m] of a capsule."""
    flat = np.broadcast_to(axis[[0, 1, 1]], (len(triangles), 3, 3))
    return float(triangle_pairs_distance(x[triangles], flat)[0].min())


def lands(surface: np.ndarray, height: float, size: float) -> Callable[[np.ndarray], float]:
    """Measure frames (k, n, 3) [m] by LANDS; surface : numbers of its nodes; height : of the floor [m]."""

    def error(a: np.ndarray) -> float:
        above = float(a[:, surface, 2].min() - height) / size
        return above if above >= 0.0 else 1.0 - above

    return error


def clears(surface: np.ndarray, path: Callable[[int], np.ndarray], radius: float) -> Callable[[np.ndarray], float]:
    """Measure frames (k, n, 3) [m]: least distance of nodes from a ball or capsule / its radius; 1 and more inside it.

    path : the axis (2, 3) [m] in a frame
    """

    def error(a: np.ndarray) -> float:
        clear = min(_from_axis(x[surface], path(number)).min() - radius for number, x in enumerate(a)) / radius
        return float(clear if clear >= 0.0 else 1.0 - clear)

    return error


def _from_axis(points: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Compute the distances (n,) [m] of points (n, 3) from a segment (2, 3)."""
    along = axis[1] - axis[0]
    share = np.clip((points - axis[0]) @ along / max(float(along @ along), 1e-300), 0.0, 1.0)
    return np.linalg.norm(points - axis[0] - share[:, None] * along, axis=1)
