"""Finer meshes that follow the CT's surface and not the coarse mesh's facets."""

from collections.abc import Callable

import numpy as np
from scipy.spatial import cKDTree

from palpate.bodies.mesh import TetMesh
from palpate.bodies.mesh_quality import dihedral_angles
from palpate.bodies.surfaces.remesh import project, vertex_normals

# an element keeps at least this part of its volume and these angles [°], or its nodes stay where they are
KEPT, LEAST_DEG = 0.3, 10.0


def snapper(points: np.ndarray, triangles: np.ndarray) -> Callable[[TetMesh, int], TetMesh]:
    """What moves the surface nodes of a finer mesh from number ``first`` on to the dense surface given.

    points, triangles : (n, 3) [m] and (m, 3), wound outward
    Trap: nodes whose move would invert or flatten an element go back, and so may their neighbours' elements
    need it then; that ends, since at last all are back.
    """
    tree, normals = cKDTree(points), vertex_normals(points, triangles)

    def snap(mesh: TetMesh, first: int) -> TetMesh:
        moving = mesh.surface[mesh.surface >= first]
        nodes = mesh.nodes.copy()
        nodes[moving] = project(mesh.nodes[moving], mesh.normals[moving], points, normals, tree)
        while True:
            moved = TetMesh(nodes, mesh.tetrahedra)
            flat = moved.volumes < KEPT * mesh.volumes
            # angles are those of flattened elements too, but not of inverted ones
            flat |= dihedral_angles(moved).min(axis=1) < LEAST_DEG
            bad = np.unique(mesh.tetrahedra[flat])
            bad = bad[(nodes[bad] != mesh.nodes[bad]).any(axis=1)]
            if not len(bad):
                return moved
            nodes[bad] = mesh.nodes[bad]

    return snap
