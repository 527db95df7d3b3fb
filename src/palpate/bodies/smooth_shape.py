"""Coarse bodies of smooth closed shapes, which are given as maps of the unit sphere."""

from collections.abc import Callable, Sequence

import numpy as np
from scipy.spatial import cKDTree

from palpate.bodies.mesh import TetMesh
from palpate.bodies.surfaces.decimate import nearest_alike, vertex_normals
from palpate.bodies.surfaces.even_triangulation import fibonacci_sphere, triangulate, triangulate_evenly
from palpate.bodies.surfaces.snap import Onto
from palpate.bodies.surfaces.tetrahedralize import Ball, tetrahedralize

SURFACE_NODES = 140
SAMPLES = 20000
STEPS = 6
"""Gauss-Newton steps to the place of the sphere whose image is nearest; 3 suffice but at tips."""
DIFFERENCE, LONGEST = 1e-6, 0.05
"""Angle [rad] of the differences that slopes are taken by, and of a step at most."""

Shape = Callable[[np.ndarray], np.ndarray]
"""A smooth one-to-one map of points of the unit sphere (n, 3) to those of a shape (n, 3), of any size."""


def coarse_body(shape: Shape, length_m: float, balls: Sequence[Ball] = ()) -> TetMesh:
    """Build a coarse mesh of 140 nodes and 276 triangles on the surface of ``shape``, identical on every call.

    Its longest side is ``length_m``; the origin is the middle of the bounding box of the smooth shape. In ``balls``
    elements are smaller.
    """
    points, triangles, sphere = _dense(shape, length_m)
    chosen, coarse = triangulate_evenly(points, triangles, sphere, SURFACE_NODES)
    # a little finer than the surface (whose edges are 0.12 of the length), for better angles inside
    return tetrahedralize(points[chosen], coarse, spacing_m=0.1 * length_m, balls=balls)


def onto_shape(shape: Shape, length_m: float) -> Onto:
    """Make the projection to the smooth shape: to the nearest place of it that faces the same way, by its own formula.

    The dense surface says where to begin; from there the place on the unit sphere is found by Gauss-Newton steps. Trap:
    the dense surface alone, taken as flat around its points, is as far from the shape as the facets of the third
    refinement are.
    """
    dense, triangles, sphere = _dense(shape, length_m)
    normals, tree = vertex_normals(dense, triangles), cKDTree(dense)
    middle, scale = _placed(shape(sphere), length_m)

    def places(on_sphere: np.ndarray) -> np.ndarray:
        return (shape(on_sphere) - middle) * scale

    def onto(points: np.ndarray, facing: np.ndarray) -> np.ndarray:
        s = sphere[nearest_alike(points, facing, normals, tree)]
        found = places(s)
        away = np.linalg.norm(points - found, axis=1)
        for _ in range(STEPS):
            tried = _closer(places, s, points - found)
            moved = places(tried)
            distance = np.linalg.norm(points - moved, axis=1)
            better = distance < away
            s, found = np.where(better[:, None], tried, s), np.where(better[:, None], moved, found)
            away = np.minimum(distance, away)
        return found

    return onto


def _closer(places: Shape, s: np.ndarray, missing: np.ndarray) -> np.ndarray:
    """Return the places (n, 3) of the sphere after a step from ``s`` that is to make up for ``missing`` (n, 3) [m]."""
    other = np.where(np.abs(s[:, :1]) < 0.7, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    first = np.cross(s, other)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    axes = np.stack([first, np.cross(s, first)], axis=1)
    ends = [_unit(s[:, None] + sign * DIFFERENCE * axes).reshape(-1, 3) for sign in (1, -1)]
    slopes = ((places(ends[0]) - places(ends[1])) / (2 * DIFFERENCE)).reshape(-1, 2, 3)
    normal = slopes @ slopes.transpose(0, 2, 1)
    step = np.linalg.solve(normal, slopes @ missing[:, :, None])[:, :, 0]
    step *= np.minimum(1.0, LONGEST / np.maximum(np.linalg.norm(step, axis=1, keepdims=True), 1e-300))
    return _unit(s + np.einsum("nk,nki->ni", step, axes))


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def logistic(value: np.ndarray) -> np.ndarray:
    """Return the logistic function of ``value``, a smooth step from 0 to 1."""
    return 1 / (1 + np.exp(-value))


def _dense(shape: Shape, length_m: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return many points (n, 3) [m] of the smooth shape, the triangles between them, and their places on the sphere."""
    sphere = fibonacci_sphere(SAMPLES)
    points = shape(sphere)
    middle, scale = _placed(points, length_m)
    return (points - middle) * scale, triangulate(sphere), sphere


def _placed(points: np.ndarray, length_m: float) -> tuple[np.ndarray, float]:
    """Return the middle (3,) of the points' bounding box, and the factor that makes its longest side ``length_m``."""
    low, high = points.min(axis=0), points.max(axis=0)
    return (low + high) / 2, length_m / (high - low).max()
