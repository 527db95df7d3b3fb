"""Cylinder of prism layers: paper 1's first body, with its surface counts 182/360 and, refined, 722/1440."""

import numpy as np

from palpate.bodies.mesh import TetMesh

RINGS = 2
LAYERS = 14
ASIDE = 1e-6
"""Length of a unit normal's part across the axis above which it is not that of a flat end; not 0, for rounding."""
_STEPS = np.array([[1, 0], [0, 1], [-1, 1], [-1, 0], [0, -1], [1, -1]])


def cylinder(length_m: float, radius_m: float) -> TetMesh:
    """Build a cylinder along z from 0 to ``length_m``: 266 nodes, 936 tetrahedra, (182, 360) on its surface.

    Each of the 14 layers of nodes is a round disc of hexagonal rings; each of the 13 layers of prisms
    between them is cut into tetrahedra. Trap: the diagonals on the prisms' sides must agree between
    neighbours and should not all lean the same way, or the cylinder twists when it is bent. The hexagonal
    lattice has a 3-colouring in which every triangle has all three colours; diagonals that climb from the
    lower colour to the higher agree by construction and lean to both sides equally.
    """
    disc, triangles, colours = _disc()
    heights = np.linspace(0.0, length_m, LAYERS)
    n = len(disc)
    nodes = np.empty((LAYERS * n, 3))
    nodes[:, :2] = np.tile(radius_m * disc, (LAYERS, 1))
    nodes[:, 2] = np.repeat(heights, n)

    low = np.take_along_axis(triangles, np.argsort(colours[triangles], axis=1), axis=1)
    a, b, c = low.T
    cut = np.stack([[a, b, c, c + n], [a, b, b + n, c + n], [a, a + n, b + n, c + n]]).transpose(2, 0, 1)
    layers = n * np.arange(LAYERS - 1)[:, None, None, None]
    tetrahedra = (cut[None] + layers).reshape(-1, 4)
    inverted = TetMesh(nodes, tetrahedra).volumes < 0
    tetrahedra[inverted] = tetrahedra[inverted][:, [1, 0, 2, 3]]
    return TetMesh(nodes, tetrahedra)


def onto_cylinder(points: np.ndarray, facing: np.ndarray, radius_m: float) -> np.ndarray:
    """Move points, (n, 3) [m], of the facets of the round side straight outward to the cylinder, whose axis is z.

    facing : (n, 3), the outward normals where they are; those of the flat ends face along z and stay, and those of
        their rims, which face both ways, move within the plane of the end
    """
    aside = np.linalg.norm(facing[:, :2], axis=1) > ASIDE
    moved = points.copy()
    moved[aside, :2] *= radius_m / np.linalg.norm(points[aside, :2], axis=1, keepdims=True)
    return moved


def _disc() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Triangulate the unit disc: points (19, 2) ring by ring, triangles (24, 3), a 3-colouring of the points (19,)."""
    lattice, points = [(0, 0)], [(0.0, 0.0)]
    for ring in range(1, RINGS + 1):
        corner = ring * _STEPS[4]
        for step in _STEPS:
            for k in range(ring):
                lattice.append(tuple(corner + k * step))
            corner = corner + ring * step
        angle = 2 * np.pi * np.arange(6 * ring) / (6 * ring)
        points.extend(ring / RINGS * np.column_stack([np.cos(angle), np.sin(angle)]))
    number = {key: i for i, key in enumerate(lattice)}
    triangles = []
    for (i, j), p in number.items():
        for second, third in (((i + 1, j), (i, j + 1)), ((i + 1, j - 1), (i + 1, j))):
            if second in number and third in number:
                triangles.append((p, number[second], number[third]))
    colours = np.array([(i - j) % 3 for i, j in lattice])
    return np.array(points), np.array(triangles), colours
