"""Snapping of finer meshes to a given dense surface instead of the coarse mesh's facets."""

from collections.abc import Callable
from functools import partial

import numpy as np
from scipy.spatial import cKDTree

from palpate.bodies.mesh import TetMesh
from palpate.bodies.mesh_quality import LEAST_DEG
from palpate.bodies.refinement import refine
from palpate.bodies.surfaces.decimate import project
from palpate.bodies.surfaces.relax import element_quality, relax

HALVINGS = 3
# fraction of the elements that may be bad if single nodes are to be moved
FEW = 0.05

Onto = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""A projection of points (n, 3) [m], with the outward normals (n, 3) of where they come from, to a surface."""


def snapper(points: np.ndarray, normals: np.ndarray) -> Callable[[TetMesh, int], TetMesh]:
    """Make a function that moves a finer mesh's surface nodes, from number ``first`` on, to the given dense surface.

    points, normals : places on the surface, dense enough to take it as flat around each, and its outward unit normals,
        (n, 3) [m] and (n, 3)
    """
    return snapper_onto(partial(project, dense=points, normals=normals, tree=cKDTree(points)))


def snapper_onto(project_onto: Onto) -> Callable[[TetMesh, int], TetMesh]:
    """Make a function that moves a finer mesh's surface nodes, from number ``first`` on, by the given projection.

    New nodes inside move where that keeps elements well-shaped. Trap: surface nodes whose move would still make a bad
    element, or one whose refinement is bad, move back by halves, which may require that their neighbours do, too;
    this terminates, at the latest when all have moved back.
    """

    def snap(mesh: TetMesh, first: int) -> TetMesh:
        movable = np.arange(len(mesh.nodes)) >= first
        facing = mesh.normals
        nodes = mesh.nodes.copy()
        moving = mesh.surface[mesh.surface >= first]
        nodes[moving] = project_onto(nodes[moving], facing[moving])

        def onto(places: np.ndarray, node: int) -> np.ndarray:
            return project_onto(places, np.repeat(facing[node : node + 1], len(places), axis=0))

        for _ in range(HALVINGS):
            # single moves mend single places
            if (element_quality(nodes, mesh.tetrahedra) < LEAST_DEG).mean() < FEW:
                nodes = relax(nodes, mesh.tetrahedra, movable, mesh.surface, onto)
            bad = _bad_nodes(nodes, mesh)
            bad = bad[movable[bad]]
            if not len(bad):
                break
            nodes[bad] = (nodes[bad] + mesh.nodes[bad]) / 2
        return TetMesh(_undo_bad(mesh, nodes), mesh.tetrahedra)

    return snap


def _undo_bad(mesh: TetMesh, nodes: np.ndarray) -> np.ndarray:
    """Move the nodes of bad elements back to where they are in ``mesh``, (n, 3) [m]."""
    while True:
        bad = _bad_nodes(nodes, mesh)
        bad = bad[(nodes[bad] != mesh.nodes[bad]).any(axis=1)]
        if not len(bad):
            return nodes
        nodes[bad] = mesh.nodes[bad]


def _bad_nodes(nodes: np.ndarray, mesh: TetMesh) -> np.ndarray:
    """List the nodes of elements that have moved and are bad, or whose refinement would be bad, increasing."""
    moved = (nodes != mesh.nodes).any(axis=1)
    elements = mesh.tetrahedra[moved[mesh.tetrahedra].any(axis=1)]
    quality = element_quality(nodes, elements)
    # long elements with large angles may have bad ones inside when refined
    unsure = np.flatnonzero(quality >= LEAST_DEG)
    # each element by itself, so that its eight children are next to each other; the first four have its own angles
    apart = np.arange(4 * len(unsure)).reshape(-1, 4)
    finer, _ = refine(TetMesh(nodes[elements[unsure]].reshape(-1, 3), apart))
    inner = finer.tetrahedra.reshape(-1, 8, 4)[:, 4:]
    quality[unsure] = element_quality(finer.nodes, inner.reshape(-1, 4)).reshape(-1, 4).min(axis=1)
    return np.unique(elements[quality < LEAST_DEG])
