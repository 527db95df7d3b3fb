"""Which pairs of triangles intersect, exactly."""

import math

import numba
import numpy as np

from palpate.collision.triangles.predicates import digits
from palpate.collision.triangles.triangle_checks import coordinates
from palpate.collision.triangles.triangle_pair import meet
from palpate.errors import InputError


def triangle_pairs_intersect(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Whether triangle ``a[i]`` and triangle ``b[i]`` have a point in common, (n,) bool, for each i.

    a, b : (n, 3, 3) [m], the corners of each triangle
    The answer is exact for the coordinates as given, the same in every order of corners and of arguments. Triangles
    are closed: touching at a vertex, an edge or a face, and lying in one plane with a common point, count as
    intersecting; one without area is a segment or a point. How: paper 3, chapter 4, "by projection to a lower
    dimension"; see ``triangle_pair.meet``. Raises InputError for wrong shapes and for coordinates that are not finite.
    """
    a, b = checked(a, b)
    triangles = np.arange(3 * len(a)).reshape(-1, 3)
    pairs = np.repeat(np.arange(len(a)), 2).reshape(-1, 2)
    return crosses(a.reshape(-1, 3), triangles, b.reshape(-1, 3), triangles, pairs)


@numba.njit(cache=True)
def crosses(points_a, triangles_a, points_b, triangles_b, pairs):
    """Whether the triangles of each pair have a point in common, (k,) bool, as ``triangle_pairs_intersect`` says.

    points : (n, 3) [m]; triangles : (m, 3); pairs : (k, 2), a triangle of a and one of b
    Trap: nothing is checked; points must be finite, and indices in range.
    """
    found = np.empty(len(pairs), dtype=np.bool_)
    points, sums = np.empty((6, 3)), digits()
    for n in range(len(pairs)):
        gather(points_a, triangles_a, pairs[n, 0], points, 0)
        gather(points_b, triangles_b, pairs[n, 1], points, 3)
        found[n] = meet(points, sums)
    return found


@numba.njit(cache=True)
def gather(points, triangles, n, pair, first):
    """Copy the corners of triangle ``n`` to ``pair`` (6, 3), from row ``first`` on."""
    for corner in range(3):
        node = triangles[n, corner]
        for axis in range(3):
            pair[first + corner, axis] = points[node, axis]


@numba.njit(cache=True)
def normalise(pair, scaled):
    """Write to ``scaled`` the pair (6, 3) over a power of two, whose exponent is returned; its largest is near 1.

    So squares and products do not overflow. Trap: coordinates below 1e-308 of the largest lose bits.
    """
    exponent = math.frexp(np.abs(pair).max())[1]
    for corner in range(6):
        for axis in range(3):
            scaled[corner, axis] = math.ldexp(pair[corner, axis], -exponent)
    return exponent


def checked(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Both as contiguous arrays (n, 3, 3) of float64; raises InputError if they are not pairs of finite triangles."""
    a, b = (coordinates(corners, (None, 3, 3), f"Triangles {name}") for name, corners in (("a", a), ("b", b)))
    if len(a) != len(b):
        raise InputError(f"Triangles a {a.shape} and b {b.shape} are not pairs; give two arrays of shape (n, 3, 3).")
    for name, corners in (("a", a), ("b", b)):
        finite = np.isfinite(corners).all(axis=(1, 2))
        if not finite.all():
            raise InputError(
                f"Triangle {np.argmin(finite)} of {name} has a coordinate that is not finite; leave it out or mend it."
            )
    return a, b
