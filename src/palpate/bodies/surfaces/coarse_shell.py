"""A mask's surface with few nodes, filled with tetrahedra: what bodies from a CT and from a mesh file share."""

from collections.abc import Sequence

import numpy as np

from palpate.bodies.mesh import TetMesh
from palpate.bodies.surfaces.mask_surface import Grid, coarse_surface
from palpate.bodies.surfaces.tetrahedralize import Ball, tetrahedralize
from palpate.errors import InputError

# ratio of vertices to those asked for up to which a surface is accepted
MAX_EXCESS = 1.2


def coarse_shell(mask: np.ndarray, grid: Grid, nodes: int) -> tuple[np.ndarray, np.ndarray]:
    """Build a surface of about ``nodes`` points on the mask's surface; InputError if they are too few for its shape."""
    points, triangles = coarse_surface(mask, grid, nodes)
    if len(points) > MAX_EXCESS * nodes:
        raise InputError(f"{_too_few(grid, nodes)} (without folds and closed gaps it needs {len(points)}).")
    return points, triangles


def fill(
    points: np.ndarray,
    triangles: np.ndarray,
    grid: Grid,
    nodes: int,
    spacing: float = 1.0,
    thin_wall: bool = False,
    balls: Sequence[Ball] = (),
) -> TetMesh:
    """Fill a coarse surface with tetrahedra; InputError if it intersects itself where the body is thin.

    spacing : edge length inside, relative to the surface's mean edge; balls : where elements are smaller
    """
    edges = points[triangles] - points[np.roll(triangles, 1, axis=1)]
    spacing_m = spacing * float(np.linalg.norm(edges, axis=2).mean())
    try:
        return tetrahedralize(points, triangles, spacing_m, source=grid.source, balls=balls)
    except InputError as error:
        remedy = ", or close its hollow in the file" if thin_wall else ""
        raise InputError(f"{_too_few(grid, nodes)}, since it intersects itself where it is thin{remedy}.") from error


def _too_few(grid: Grid, nodes: int) -> str:
    return f"{grid.source}: {nodes} surface nodes are too few for this organ; give more surface_nodes"
