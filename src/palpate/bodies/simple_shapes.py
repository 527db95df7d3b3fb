"""Meshes of simple shapes: boxes and sheets of equal cells, and paper 1's cylinder."""

from itertools import permutations

import numpy as np

from palpate.bodies.mesh import Sheet, TetMesh, area_normals


def cut_lattice(divisions: list[int]) -> tuple[np.ndarray, np.ndarray]:
    """Cut a lattice into simplices (m, d + 1) of its points (n, d), the last axis fastest, d = len(divisions).

    Every cell is cut into the d! simplices around one diagonal (Kuhn), and is the mirror image of each of its
    neighbours (Todd's J1, in the plane the "union jack"): diagonals run from points with only even coordinates
    to points with only odd ones, so that they agree on shared faces. Trap: with one diagonal direction for all
    cells, a body twists when it is bent; mirrored cells lean to both sides equally, and the mesh is its own
    mirror image along each axis that has an even number of cells. Orientation of the simplices is mixed.
    """
    d, counts = len(divisions), np.array(divisions)
    points = np.stack(np.meshgrid(*(np.arange(c + 1) for c in divisions), indexing="ij"), axis=-1).reshape(-1, d)
    cells = points[(points < counts).all(axis=1)]
    even_corners, to_odd = cells + cells % 2, 1 - 2 * (cells % 2)
    axes = np.eye(d, dtype=np.int64)
    paths = np.array([np.cumsum([0 * axes[0], *axes[list(order)]], axis=0) for order in permutations(range(d))])
    corners = even_corners[:, None, None] + to_odd[:, None, None] * paths
    strides = np.append(np.cumprod((counts + 1)[:0:-1])[::-1], 1)
    return points, (corners @ strides).reshape(-1, d + 1)


def box(sizes_m: list[float], divisions: list[int]) -> TetMesh:
    """Build a box from the origin to ``sizes_m`` (3,) [m], of ``divisions`` (3,) cells with six tetrahedra each.

    Six around a diagonal, not the cheaper five: all six are congruent, where the inner one of five has twice the
    volume of the others and another shape. Choose even divisions for a mesh that is its own mirror image, so that
    a symmetric load gives a symmetric response. Trap: refinement splits an octahedron along the first of its two
    shortest diagonals. Inverted elements are turned by swapping their middle corners, no others, so that this diagonal
    keeps shape and symmetry on finer levels.
    """
    points, tetrahedra = cut_lattice(divisions)
    nodes = points / np.array(divisions) * np.array(sizes_m, dtype=float)
    inverted = TetMesh(nodes, tetrahedra).volumes < 0
    tetrahedra[inverted] = tetrahedra[inverted][:, [0, 2, 1, 3]]
    return TetMesh(nodes, tetrahedra)


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

    by_colour = np.take_along_axis(triangles, np.argsort(colours[triangles], axis=1), axis=1)
    a, b, c = by_colour.T
    of_prism = np.stack([[a, b, c, c + n], [a, b, b + n, c + n], [a, a + n, b + n, c + n]]).transpose(2, 0, 1)
    layers = n * np.arange(LAYERS - 1)[:, None, None, None]
    tetrahedra = (of_prism[None] + layers).reshape(-1, 4)
    inverted = TetMesh(nodes, tetrahedra).volumes < 0
    tetrahedra[inverted] = tetrahedra[inverted][:, [1, 0, 2, 3]]
    return TetMesh(nodes, tetrahedra)


def onto_cylinder(points: np.ndarray, facing: np.ndarray, radius_m: float) -> np.ndarray:
    """Move points, (n, 3) [m], of the facets of the round side straight outward to the cylinder, whose axis is z.

    facing : (n, 3), the outward normals where they are; those of the flat ends face along z and stay, and those of
        their rims, which face both ways, move within the plane of the end
    """
    on_side = np.linalg.norm(facing[:, :2], axis=1) > ASIDE
    moved = points.copy()
    moved[on_side, :2] *= radius_m / np.linalg.norm(points[on_side, :2], axis=1, keepdims=True)
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
    number_of_place = {place: column for column, place in enumerate(lattice)}
    triangles = []
    for (column, row), p in number_of_place.items():
        for second, third in (((column + 1, row), (column, row + 1)), ((column + 1, row - 1), (column + 1, row))):
            if second in number_of_place and third in number_of_place:
                triangles.append((p, number_of_place[second], number_of_place[third]))
    colours = np.array([(column - row) % 3 for column, row in lattice])
    return np.array(points), np.array(triangles), colours


def sheet(sizes_m: list[float], divisions: list[int], thickness_m: float) -> Sheet:
    """Build a sheet from the origin to ``sizes_m`` (2,) [m] in the x–y plane, of ``divisions`` (2,) cells.

    Each cell has two triangles, whose normal is +z; the diagonals alternate ("union jack"), because with diagonals of
    one direction a sheet drapes and shears askew.
    """
    points, triangles = cut_lattice(divisions)
    nodes = np.zeros((len(points), 3))
    nodes[:, :2] = points / np.array(divisions) * np.array(sizes_m, dtype=float)
    facing_down = area_normals(nodes, triangles)[:, 2] < 0
    triangles[facing_down] = triangles[facing_down][:, ::-1]
    return Sheet(nodes, triangles, float(thickness_m))
