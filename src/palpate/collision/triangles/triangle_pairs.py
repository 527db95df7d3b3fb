"""Exact intersection tests of pairs of triangles."""

import math

import numba
import numpy as np

from palpate.collision.triangles.predicates import new_accumulator
from palpate.collision.triangles.triangle_checks import coordinates
from palpate.collision.triangles.triangle_pair import triangles_intersect
from palpate.errors import InputError


def triangle_pairs_intersect(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Test whether triangle ``a[i]`` and triangle ``b[i]`` have a point in common, (n,) bool, for each i.

    a, b : (n, 3, 3) [m], the corners of each triangle
    The answer is exact for the coordinates as given, and the same in every order of corners and of arguments. Triangles
    are closed: touching at a vertex, an edge or a face, and lying in one plane with a common point, count as
    intersecting; a degenerate one is a segment or a point. Method: paper 3, chapter 4, "by projection to a lower
    dimension"; see ``triangle_pair``. Raises InputError for wrong shapes and for coordinates that are not finite.
    """
    a, b = check_pairs(a, b)
    triangles = np.arange(3 * len(a)).reshape(-1, 3)
    pairs = np.repeat(np.arange(len(a)), 2).reshape(-1, 2)
    return pairs_intersect(a.reshape(-1, 3), triangles, b.reshape(-1, 3), triangles, pairs)


@numba.njit(cache=True)
def pairs_intersect(points_a, triangles_a, points_b, triangles_b, pairs):
    """Test whether the triangles of each pair have a point in common, (k,) bool, as ``triangle_pairs_intersect`` does.

    points : (n, 3) [m]; triangles : (m, 3); pairs : (k, 2), a triangle of a and one of b
    Trap: nothing is checked; points must be finite, and indices in range.
    """
    found = np.empty(len(pairs), dtype=np.bool_)
    points, sums = np.empty((6, 3)), new_accumulator()
    for n in range(len(pairs)):
        copy_corners(points_a, triangles_a, pairs[n, 0], points, 0)
        copy_corners(points_b, triangles_b, pairs[n, 1], points, 3)
        found[n] = triangles_intersect(points, sums)
    return found


@numba.njit(cache=True)
def copy_corners(points, triangles, n, pair, first):
    """Copy the corners of triangle ``n`` to ``pair`` (6, 3), from row ``first`` on."""
    for corner in range(3):
        node = triangles[n, corner]
        for axis in range(3):
            pair[first + corner, axis] = points[node, axis]


@numba.njit(cache=True)
def normalise(pair, scaled):
    """Write the pair (6, 3), over a power of two that makes its largest near 1, to ``scaled``; return the exponent.

    So squares and products do not overflow. Trap: coordinates below 1e-308 of the largest lose bits.
    """
    exponent = math.frexp(np.abs(pair).max())[1]
    for corner in range(6):
        for axis in range(3):
            scaled[corner, axis] = math.ldexp(pair[corner, axis], -exponent)
    return exponent


def check_pairs(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return both as contiguous float64 (n, 3, 3); raise InputError if they are not pairs of finite triangles."""
    a, b = (coordinates(corners, (None, 3, 3), f"Triangles {name}") for name, corners in (("a", a), ("b", b)))
    if len(a) != len(b):
        raise InputError(f"Triangles a {a.shape} and b {b.shape} are not pairs; give two arrays of shape (n, 3, 3).")
    for name, corners in (("a", a), ("b", b)):
        finite = np.isfinite(corners).all(axis=(1, 2))
        if not finite.all():
            raise InputError(
                f"Triangle {np.argmin(finite)} of {name} has a coordinate that is not finite; remove or repair it."
            )
    return a, b
