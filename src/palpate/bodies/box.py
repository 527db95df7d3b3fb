"""Box of equal cells, for bars, cubes and slabs."""

import numpy as np

from palpate.bodies.lattice import cut_lattice
from palpate.bodies.mesh import TetMesh


def box(sizes_m: list[float], divisions: list[int]) -> TetMesh:
    """Build a box from the origin to ``sizes_m`` (3,) [m], of ``divisions`` (3,) cells with six tetrahedra each.

    Six around a diagonal, not the cheaper five: all six are congruent, where the inner one of five has twice the
    volume of the others and another shape. Choose even divisions for a mesh that is its own mirror image, so that
    a symmetric load gives a symmetric response. Trap: the octahedra of these elements have two shortest diagonals, of
    which refinement takes the first; swapping the middle corners of the inverted elements only makes that the one
    with which finer levels keep the shape and the symmetry.
    """
    points, tetrahedra = cut_lattice(divisions)
    nodes = points / np.array(divisions) * np.array(sizes_m, dtype=float)
    inverted = TetMesh(nodes, tetrahedra).volumes < 0
    tetrahedra[inverted] = tetrahedra[inverted][:, [0, 2, 1, 3]]
    return TetMesh(nodes, tetrahedra)
