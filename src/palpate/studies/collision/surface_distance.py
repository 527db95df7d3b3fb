"""Distance and overlap of two closed surfaces, by which contacts from trees are judged."""

from typing import NamedTuple

import numpy as np
from scipy.spatial import KDTree

from palpate.bodies.surfaces.decimate import area_normals
from palpate.bodies.surfaces.polydata import polydata
from palpate.collision.trees.tree import Tree
from palpate.collision.trees.tree_query import candidates
from palpate.collision.triangles.distance import triangle_pairs_distance

PARTS = 3
"""Parts of each edge of a triangle whose overlap is integrated: 9 points of it."""


class Overlap(NamedTuple):
    """Overlap of a body a with a body b.

    place : (3,) [m] and direction : (3,), in which a has to move: means over the surface of each inside the other,
    weighted with the depth; depth : [m] the largest; velocity : (3,) [m/s] of a relative to b at the place
    """

    place: np.ndarray
    direction: np.ndarray
    depth: float
    velocity: np.ndarray


def distance(points: list[np.ndarray], trees: list[Tree]) -> float:
    """Compute the distance [m] of two surfaces; 0 if they cross.

    points : (n, 3) [m] of each; trees : of spheres, over the triangles of each, refitted here
    """
    nearest = float(KDTree(points[0]).query(points[1])[0].min())
    for tree, moved in zip(trees, points, strict=True):
        tree.refit(moved, margin=0.5 * nearest * (1.0 + 1e-9))
    pairs, _ = candidates(*trees)
    corners = (at[tree.triangles[pairs[:, side]]] for side, (at, tree) in enumerate(zip(points, trees, strict=True)))
    return min(nearest, float(triangle_pairs_distance(*corners)[0].min(initial=nearest)))


def overlap(points: list[np.ndarray], velocities: list[np.ndarray], triangles: list[np.ndarray]) -> Overlap | None:
    """Compute the overlap of two closed surfaces whose triangles face outwards; None if no point is inside the other.

    points : (n, 3) [m]; velocities : (n, 3) [m/s]; triangles : (m, 3) of each
    Signed distances are VTK's (``vtkImplicitPolyDataDistance``), and not those of trees or triangles that are judged.
    The velocities are those of the nodes nearest to the place.
    """
    found = [_inside(points[side], triangles[side], points[1 - side], triangles[1 - side]) for side in range(2)]
    places, ways, areas = (np.concatenate(parts) for parts in zip(*found, strict=True))
    # b's part moves out of a, so a moves the other way
    ways[len(found[0][0]) :] *= -1.0
    depths = np.linalg.norm(ways, axis=1)
    if not depths.any():
        return None
    weights = areas * depths
    place, pushed = weights @ places / weights.sum(), areas @ ways
    nearest = [int(np.linalg.norm(at - place, axis=1).argmin()) for at in points]
    moving = velocities[0][nearest[0]] - velocities[1][nearest[1]]
    return Overlap(place, pushed / np.linalg.norm(pushed), float(depths.max()), moving)


def _inside(
    points: np.ndarray, triangles: np.ndarray, others: np.ndarray, around: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Find points of a surface inside another: (k, 3) [m], their shortest way out (k, 3) [m], and areas (k,) [m²]."""
    from vtkmodules.vtkFiltersCore import vtkImplicitPolyDataDistance

    measure = vtkImplicitPolyDataDistance()
    measure.SetInput(polydata(others, around))
    corners = points[triangles]
    # no point of a triangle is farther from all of its nodes than this (Jung 1901)
    reach = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1) / np.sqrt(3.0)
    low, high = others.min(axis=0) - reach.max(), others.max(axis=0) + reach.max()
    near = ((points >= low) & (points <= high)).all(axis=1)
    away = np.full(len(points), np.inf)
    away[near] = [measure.EvaluateFunction(point) for point in points[near]]
    chosen = triangles[away[triangles].min(axis=1) < reach]
    places = np.einsum("pc,tci->tpi", _centres(PARTS), points[chosen]).reshape(-1, 3)
    areas = np.linalg.norm(area_normals(points, chosen), axis=1) / 2 / PARTS**2
    closest, ways, kept = [0.0, 0.0, 0.0], np.zeros_like(places), np.zeros(len(places), dtype=bool)
    for k, place in enumerate(places):
        if measure.EvaluateFunctionAndGetClosestPoint(place, closest) < 0.0:
            ways[k], kept[k] = closest - place, True
    return places[kept], ways[kept], np.repeat(areas, PARTS**2)[kept]


def _centres(parts: int) -> np.ndarray:
    """Return the barycentric coordinates (parts², 3) of the centres of equal parts of a triangle."""
    u, v = (x.ravel() for x in np.meshgrid(np.arange(parts), np.arange(parts)))
    first, second = u + v < parts, u + v < parts - 1
    across = np.concatenate([u[first] + 1 / 3, u[second] + 2 / 3]) / parts
    along = np.concatenate([v[first] + 1 / 3, v[second] + 2 / 3]) / parts
    return np.column_stack([1.0 - across - along, across, along])
