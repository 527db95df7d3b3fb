"""Snapping of finer meshes to the CT's surface instead of the coarse mesh's facets."""

from collections.abc import Callable

import numpy as np
from scipy.spatial import cKDTree

from palpate.bodies.mesh import TetMesh
from palpate.bodies.mesh_quality import dihedral_angles
from palpate.bodies.surfaces.decimate import project, vertex_normals

# an element keeps at least this fraction of its volume and this dihedral angle [°], or its nodes do not move
LEAST_VOLUME, LEAST_DEG = 0.3, 10.0


def snapper(points: np.ndarray, triangles: np.ndarray) -> Callable[[TetMesh, int], TetMesh]:
    """Make a function that moves a finer mesh's surface nodes, from number ``first`` on, to the given dense surface.

    points, triangles : (n, 3) [m] and (m, 3), wound outward
    Trap: nodes whose move would invert or flatten an element move back, which may require that their neighbours do,
    too; this terminates, at the latest when all have moved back.
    """
    tree, normals = cKDTree(points), vertex_normals(points, triangles)

    def snap(mesh: TetMesh, first: int) -> TetMesh:
        moving = mesh.surface[mesh.surface >= first]
        nodes = mesh.nodes.copy()
        nodes[moving] = project(mesh.nodes[moving], mesh.normals[moving], points, normals, tree)
        while True:
            moved = TetMesh(nodes, mesh.tetrahedra)
            flat = moved.volumes < LEAST_VOLUME * mesh.volumes
            # small angles detect flattened elements, but not inverted ones
            flat |= dihedral_angles(moved).min(axis=1) < LEAST_DEG
            bad = np.unique(mesh.tetrahedra[flat])
            bad = bad[(nodes[bad] != mesh.nodes[bad]).any(axis=1)]
            if not len(bad):
                return moved
            nodes[bad] = mesh.nodes[bad]

    return snap
