"""Snapping of finer meshes to a smooth or dense surface, and relaxation of the bad elements it leaves."""

from collections.abc import Callable
from functools import partial

import numpy as np
from scipy.spatial import cKDTree

from palpate.bodies.mesh import Around, TetMesh
from palpate.bodies.mesh_quality import LEAST_DEG, dihedral_angles
from palpate.bodies.refinement import Snap, refine
from palpate.bodies.surfaces.remesh import project

ROUNDS = 6
# elements below this smallest dihedral angle [°] are improved
WANTED_DEG = 14.0
# lengths of the moves that are tried, relative to the shortest edge at the node
STEP_SIZES = (0.4, 0.15, 0.05)
_STAR = np.array([[x, y, z] for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if x or y or z], dtype=float)
DIRECTIONS = _STAR / np.linalg.norm(_STAR, axis=1, keepdims=True)


def relax(
    nodes: np.ndarray,
    elements: np.ndarray,
    movable: np.ndarray,
    surface: np.ndarray,
    onto: Callable[[np.ndarray, int], np.ndarray] | None,
) -> np.ndarray:
    """Move nodes of bad elements such that the worst element around each becomes better; return all nodes, (n, 3) [m].

    movable : (n,) bool; surface : the surface nodes
    onto : projects places, (k, 3) [m], of the given surface node to the surface on which it has to stay; not needed if
        only inner nodes are movable
    No element that was good becomes worse than the worst beside it was (optimisation-based smoothing, Freitag and
    Ollivier-Gooch 1997, by trial moves in 26 directions).
    """
    nodes = nodes.copy()
    on_surface = np.zeros(len(nodes), dtype=bool)
    on_surface[surface] = True
    around = Around(elements, len(nodes))
    quality = element_quality(nodes, elements)
    for _ in range(ROUNDS):
        bad = np.flatnonzero(quality < WANTED_DEG)
        corners = np.unique(elements[bad])
        changed = False
        for node in corners[movable[corners]]:
            elements_around = around.of(node)
            if quality[elements_around].min() >= WANTED_DEG:
                continue
            trial_places = _trial_places(nodes, elements[elements_around], node)
            if onto is not None and on_surface[node]:
                trial_places = onto(trial_places, node)
            improved = _best_place(nodes, elements[elements_around], node, trial_places, quality[elements_around].min())
            if improved is not None:
                nodes[node], quality[elements_around] = improved
                changed = True
        if not changed:
            break
    return nodes


def element_quality(nodes: np.ndarray, elements: np.ndarray) -> np.ndarray:
    """Compute the smallest dihedral angle [°] of each element, (m,); of an inverted one a negative number."""
    mesh = TetMesh(nodes, elements)
    with np.errstate(invalid="ignore", divide="ignore"):
        angles = dihedral_angles(mesh).min(axis=1)
    return np.where(mesh.volumes > 0, angles, np.minimum(-1e-3, -np.nan_to_num(angles)))


def _trial_places(nodes: np.ndarray, patch: np.ndarray, node: int) -> np.ndarray:
    neighbours = np.unique(patch[patch != node])
    offsets = nodes[neighbours] - nodes[node]
    shortest = np.linalg.norm(offsets, axis=1).min()
    moves = [step * shortest * DIRECTIONS for step in STEP_SIZES]
    return nodes[node] + np.vstack([*moves, offsets.mean(axis=0)])


def _best_place(
    nodes: np.ndarray, patch: np.ndarray, node: int, trial_places: np.ndarray, least: float
) -> tuple[np.ndarray, np.ndarray] | None:
    """Find the trial place with the best worst element, and the elements' qualities; None if none is better."""
    copies = np.repeat(nodes[np.newaxis, patch], len(trial_places), axis=0)
    copies[:, patch == node] = trial_places[:, np.newaxis]
    flat = copies.reshape(-1, 3)
    quality = element_quality(flat, np.arange(len(flat)).reshape(-1, 4)).reshape(len(trial_places), len(patch))
    best = int(np.argmax(quality.min(axis=1)))
    return (trial_places[best], quality[best]) if quality[best].min() > least + 1e-6 else None


HALVINGS = 3
# fraction of the elements that may be bad if single nodes are to be moved
BAD_SHARE = 0.05

Onto = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""A projection of points (n, 3) [m], with the outward normals (n, 3) of where they come from, to a surface."""


def snapper(points: np.ndarray, normals: np.ndarray) -> Snap:
    """Make a function that moves a finer mesh's surface nodes, from number ``first`` on, to the given dense surface.

    points, normals : places on the surface, dense enough to take it as flat around each, and its outward unit normals,
        (n, 3) [m] and (n, 3)
    """
    return snapper_onto(partial(project, dense=points, normals=normals, tree=cKDTree(points)))


def snapper_onto(project_onto: Onto) -> Snap:
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
            if (element_quality(nodes, mesh.tetrahedra) < LEAST_DEG).mean() < BAD_SHARE:
                nodes = relax(nodes, mesh.tetrahedra, movable, mesh.surface, onto)
            bad = _bad_nodes(nodes, mesh)
            bad = bad[movable[bad]]
            if not len(bad):
                break
            nodes[bad] = (nodes[bad] + mesh.nodes[bad]) / 2
        # what is still bad moves back as a whole
        while len(bad := _bad_nodes(nodes, mesh)):
            bad = bad[(nodes[bad] != mesh.nodes[bad]).any(axis=1)]
            if not len(bad):
                break
            nodes[bad] = mesh.nodes[bad]
        return TetMesh(nodes, mesh.tetrahedra)

    return snap


def _bad_nodes(nodes: np.ndarray, mesh: TetMesh) -> np.ndarray:
    """List the nodes, increasing, of elements that have a moved node and are bad, or whose refinement would be bad."""
    moved = (nodes != mesh.nodes).any(axis=1)
    elements = mesh.tetrahedra[moved[mesh.tetrahedra].any(axis=1)]
    quality = element_quality(nodes, elements)
    # good elements with large angles may still have bad children when refined
    good = np.flatnonzero(quality >= LEAST_DEG)
    # each element by itself, so that its eight children are next to each other; the first four have its own angles
    own_corners = np.arange(4 * len(good)).reshape(-1, 4)
    finer, _ = refine(TetMesh(nodes[elements[good]].reshape(-1, 3), own_corners))
    inner_children = finer.tetrahedra.reshape(-1, 8, 4)[:, 4:]
    quality[good] = element_quality(finer.nodes, inner_children.reshape(-1, 4)).reshape(-1, 4).min(axis=1)
    return np.unique(elements[quality < LEAST_DEG])
