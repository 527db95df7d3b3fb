"""Coarse bodies of smooth closed shapes, which are given as maps of the unit sphere."""

from collections.abc import Callable, Sequence

import numpy as np

from palpate.bodies.mesh import TetMesh
from palpate.bodies.surfaces.decimate import vertex_normals
from palpate.bodies.surfaces.even_triangulation import fibonacci_sphere, triangulate, triangulate_evenly
from palpate.bodies.surfaces.snap import snapper
from palpate.bodies.surfaces.tetrahedralize import Ball, tetrahedralize

SURFACE_NODES = 140
SAMPLES = 20000

Shape = Callable[[np.ndarray], np.ndarray]
"""A smooth one-to-one map of points of the unit sphere (n, 3) to those of a shape (n, 3), of any size."""
Snap = Callable[[TetMesh, int], TetMesh]


def coarse_body(shape: Shape, length_m: float, balls: Sequence[Ball] = ()) -> TetMesh:
    """Build a coarse mesh of 140 nodes and 276 triangles on the surface of ``shape``, identical on every call.

    Its longest side is ``length_m``; the origin is the middle of the bounding box of the smooth shape. In ``balls``
    elements are smaller.
    """
    points, triangles, sphere = _dense(shape, length_m)
    chosen, coarse = triangulate_evenly(points, triangles, sphere, SURFACE_NODES)
    # a little finer than the surface (whose edges are 0.12 of the length), for better angles inside
    return tetrahedralize(points[chosen], coarse, spacing_m=0.1 * length_m, balls=balls)


def smooth_snap(shape: Shape, length_m: float) -> Snap:
    """Make the function that moves the new surface nodes of the first refinement onto the smooth shape.

    Later refinements split its facets and keep them flat, so that all levels but the coarse one have the same shape,
    and refining for ever has a limit.
    """
    points, triangles, _ = _dense(shape, length_m)
    onto = snapper(points, vertex_normals(points, triangles))
    coarse: list[int] = []

    def snap(mesh: TetMesh, first: int) -> TetMesh:
        if not coarse:
            coarse.append(first)
        return onto(mesh, first) if first == coarse[0] else mesh

    return snap


def logistic(value: np.ndarray) -> np.ndarray:
    """Return the logistic function of ``value``, a smooth step from 0 to 1."""
    return 1 / (1 + np.exp(-value))


def _dense(shape: Shape, length_m: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return many points (n, 3) [m] of the smooth shape, the triangles between them, and their places on the sphere."""
    sphere = fibonacci_sphere(SAMPLES)
    points = shape(sphere)
    low, high = points.min(axis=0), points.max(axis=0)
    return (points - (low + high) / 2) * (length_m / (high - low).max()), triangulate(sphere), sphere
