"""A coarse body of few surface nodes from a dense surface, and how close its finer meshes follow it."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.spatial import cKDTree

from palpate.bodies.body import SHAPE_LEVEL
from palpate.bodies.mesh import TetMesh
from palpate.bodies.mesh_quality import LEAST_DEG, dihedral_angles
from palpate.bodies.refinement import Snap, refine
from palpate.bodies.surfaces.mask_surface import coarse_shell, fill
from palpate.bodies.surfaces.mend import Mended
from palpate.bodies.surfaces.remesh import flip, flip_onto, project, smooth_tangentially, undo_folds
from palpate.bodies.surfaces.snap import element_quality, relax, snapper
from palpate.bodies.surfaces.solid import Solid, sample
from palpate.bodies.surfaces.triangles import distances, inflate, mean_edge, vertex_normals
from palpate.errors import InputError

# the finest level on which elements are judged; those of still finer ones have the same shapes
LEVEL = 2
MOST_AWAY, MOST_VOLUME = 0.01, 0.02
# distance between the surfaces, as a share of the thickness, up to which a thin body has the shape of the data
THIN_AWAY = 0.25
# distance, as shares of the size and of the thickness, beyond which a body is not the organ; the worst of organs as
# found, a liver by its CT numbers, has 0.06 and 0.49
MOST_APART, THIN_APART = 0.08, 0.6


@dataclass(frozen=True)
class Likeness:
    """Distance and volumes of a body and of the surface that it was made from; a thin body has to be closer to it.

    away_m, size_m : greatest distance between the two surfaces, either way, and longest side of the data [m]
    volume_m3, data_m3 : of the body, and within the data's surface [m³]
    thick_m : thickness of a sheet with the volume and the surface of the data [m], which is the radius of a rod
    """

    away_m: float
    size_m: float
    volume_m3: float
    data_m3: float
    thick_m: float = np.inf

    @property
    def away(self) -> float:
        """The distance as a share of the size."""
        return self.away_m / self.size_m

    @property
    def volume(self) -> float:
        """The body's volume over the data's, minus 1."""
        return self.volume_m3 / self.data_m3 - 1.0

    @property
    def penalty(self) -> float:
        """The largest of the errors over their bounds: 1 or less if the body has the shape of the data."""
        thin = self.away_m / (THIN_AWAY * self.thick_m)
        return max(self.away / MOST_AWAY, abs(self.volume) / MOST_VOLUME, thin)

    @property
    def close(self) -> bool:
        """Whether the body has the shape of the data."""
        return self.penalty <= 1.0

    @property
    def other(self) -> bool:
        """Whether the mesh is so far from the data that it does not show the organ any more."""
        return self.away > MOST_APART or self.away_m > THIN_APART * self.thick_m


def refined_likeness(mesh: TetMesh, snap: Snap | None, solid: Solid, mended: Mended) -> tuple[float, Likeness]:
    """Refine and snap a coarse mesh as a body is; return the smallest dihedral angle on any level [°], and its likeness
    to the surface that it was made from."""
    least = float(dihedral_angles(mesh).min())
    for level in range(1, LEVEL + 1):
        finer, _ = refine(mesh)
        mesh = snap(finer, len(mesh.nodes)) if snap is not None and level == SHAPE_LEVEL else finer
        least = min(least, float(dihedral_angles(mesh).min()))
    away_m, size_m = apart(mesh, solid.places, mended.points, mended.triangles), np.ptp(solid.places, axis=0).max()
    return least, Likeness(away_m, float(size_m), float(mesh.volumes.sum()), solid.volume_m3)


def apart(mesh: TetMesh, places: np.ndarray, points: np.ndarray, triangles: np.ndarray) -> float:
    """Return the greatest distance [m], either way, between the surface of ``mesh`` and another.

    places : (k, 3) [m] spread over the other; points, triangles : (n, 3) [m] and (m, 3) of it
    """
    own_places = sample(mesh.nodes, mesh.triangles, mesh.size / 100)[0]
    distances_m = distances(places, mesh.nodes, mesh.triangles).max(), distances(own_places, points, triangles).max()
    return float(max(distances_m))


# numbers of surface nodes that are tried in this order: paper 1's, and more where a body's shape needs them
NODES = (140, 200, 280, 360)
# ratios to the accepted errors above which other edges, and the numbers of nodes in between, are not tried
WORTH_TRYING, HOPELESS = 2.5, 4.0
# edge lengths inside, relative to the surface's mean edge, that are tried for better elements
SPACINGS = (1.0, 0.8, 1.25)
# moves of the nodes onto the surface, between which edges are flipped
SETTLES = 3
# rounds in which nodes move to what their surface misses, from what distance over the mean edge on; share of places
TIPS, TIP, SPARSE = 2, 0.15, 5
# nodes of a hollow's surface at least
LEAST_NODES = 40

Settle = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]


@dataclass
class CoarseSolid:
    """A coarse mesh that was made from a dense surface, and how good it is.

    snap : moves finer meshes to the dense surface, or None; nodes : asked for, on the surface
    least_deg : smallest dihedral angle on any level [°]; likeness : of the refined body to the dense surface
    """

    mesh: TetMesh
    snap: Snap | None
    nodes: int
    least_deg: float
    likeness: Likeness

    @property
    def penalty(self) -> float:
        """The largest error of shape and elements over its bound: 1 or less if both are good enough."""
        return max(LEAST_DEG / max(self.least_deg, 1e-3), self.likeness.penalty)


def remesh_solid(solid: Solid, mended: Mended, nodes: int | None, snap: bool) -> CoarseSolid:
    """Build a coarse body of ``nodes`` surface nodes; without a number, of the fewest that show its shape well.

    Raises InputError if the nodes are too few for the body to be built.
    """
    reasons: list[InputError] = []
    best: CoarseSolid | None = None
    # edges that follow grooves and ridges suit some shapes, edges of even triangles others
    for count, follow in product((nodes,) if nodes is not None else NODES, (False, True) if snap else (False,)):
        # a shape that is far from shown needs more nodes, not other edges
        penalty = 0.0 if best is None else best.penalty
        if (follow and penalty > WORTH_TRYING) or (penalty > HOPELESS and nodes is None and count < NODES[-1]):
            continue
        try:
            candidate = _remesh(solid, mended, count, _settler(solid, follow) if snap else None)
        except InputError as error:
            reasons.append(error)
            continue
        if best is None or candidate.penalty < best.penalty:
            best = candidate
        if candidate.penalty <= 1:
            break
    if best is None:
        raise reasons[-1]
    return best


def _remesh(solid: Solid, mended: Mended, nodes: int, settle: Settle | None) -> CoarseSolid:
    """Build the coarse body: a coarse surface of the outside and of each hollow, of ``nodes`` in all, and fill it."""
    counts = _nodes_of_shells(solid, nodes)
    shells = [
        _shell(solid, number, mask, count, settle)
        for number, (mask, count) in enumerate(zip([solid.mask, *solid.hollows], counts, strict=True))
    ]
    starts = np.cumsum([0, *(len(points) for points, _ in shells)])
    points = np.vstack([points for points, _ in shells])
    triangles = np.vstack([t + start for (_, t), start in zip(shells, starts[:-1], strict=True)])
    mesh = _fill_well(points, triangles, solid, nodes)
    snap = snapper(solid.places, solid.normals) if settle is not None else None
    return CoarseSolid(mesh, snap, nodes, *refined_likeness(mesh, snap, solid, mended))


def _fill_well(points: np.ndarray, triangles: np.ndarray, solid: Solid, nodes: int) -> TetMesh:
    """Fill a coarse surface; with other inner edges, and moved inner nodes, if elements would be bad."""
    best, best_quality = None, -np.inf
    for spacing in SPACINGS:
        mesh = fill(points, triangles, solid, nodes, spacing, thin_wall=bool(solid.hollows))
        is_inner = np.ones(len(mesh.nodes), dtype=bool)
        is_inner[mesh.surface] = False
        mesh = TetMesh(relax(mesh.nodes, mesh.tetrahedra, is_inner, mesh.surface, None), mesh.tetrahedra)
        quality = float(element_quality(mesh.nodes, mesh.tetrahedra).min())
        if quality > best_quality:
            best, best_quality = mesh, quality
        if best_quality >= LEAST_DEG:
            break
    assert best is not None
    return best


def _shell(
    solid: Solid, number: int, mask: np.ndarray, count: int, settle: Settle | None
) -> tuple[np.ndarray, np.ndarray]:
    """Build the coarse surface of the outside, number 0, or of a hollow, with about ``count`` nodes."""
    points, triangles = coarse_shell(mask, solid, count)
    if settle is None:
        tree = cKDTree(solid.places)
        for _ in range(TIPS):
            points = undo_folds(points, _onto_tips(points, triangles, solid, -1 if number else 1), triangles)
            triangles = flip_onto(points, triangles, lambda places: tree.query(places)[0])
        points = inflate(points, triangles, solid.volumes_m3[number])
    if number > 0:
        triangles = triangles[:, ::-1]
    return (points, triangles) if settle is None else settle(points, triangles)


def _onto_tips(points: np.ndarray, triangles: np.ndarray, solid: Solid, sense: int) -> np.ndarray:
    """Move points to the places of the body that a coarse surface misses by most, as corners and ridges are.

    sense : 1, or -1 for the surface of a hollow, seen from which the body's normals point inward
    """
    places, edge = solid.places[::SPARSE], mean_edge(points, triangles)
    distance, nearest = distances(places, points, triangles), cKDTree(points).query(places)[1]
    same_side = sense * (solid.normals[::SPARSE] * vertex_normals(points, triangles)[nearest]).sum(axis=1)
    missed_places = np.flatnonzero((distance > TIP * edge) & (distance < edge) & (same_side > 0))
    movable, moved = np.ones(len(points), dtype=bool), points.copy()
    for place in missed_places[np.argsort(-distance[missed_places], kind="stable")]:
        if movable[nearest[place]]:
            moved[nearest[place]] = places[place]
            movable[triangles[(triangles == nearest[place]).any(axis=1)]] = False
    return moved


def _nodes_of_shells(solid: Solid, nodes: int) -> Iterable[int]:
    """Divide ``nodes`` among the outer surface and the surfaces of the hollows, by area."""
    areas = np.array([mask.sum() for mask in (solid.mask, *solid.hollows)]) ** (2 / 3)
    inner = np.maximum(LEAST_NODES, np.round(nodes * areas[1:] / areas.sum())).astype(int).tolist()
    return [max(LEAST_NODES, nodes - sum(inner)), *inner] if inner else [nodes]


def _settler(solid: Solid, follow: bool) -> Settle:
    """Return a function that moves a coarse surface onto the body's; ``follow`` : whether edges follow its grooves."""
    tree = cKDTree(solid.places)

    def onto(points: np.ndarray, new_points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
        new_points = project(new_points, vertex_normals(points, triangles), solid.places, solid.normals, tree)
        return undo_folds(points, new_points, triangles)

    def settle(points: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        for _ in range(SETTLES):
            points = onto(points, points, triangles)
            triangles = flip(points, triangles)
        for _ in range(SETTLES if follow else 0):
            triangles = flip_onto(points, triangles, lambda places: tree.query(places)[0])
            points = onto(points, smooth_tangentially(points, triangles), triangles)
        return points, triangles

    return settle
