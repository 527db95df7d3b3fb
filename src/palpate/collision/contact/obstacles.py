"""Pieces of bodies and rigid obstacles, which contact keeps apart; their overlaps; nodes that obstacles displace."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from palpate.bodies.mesh import winding_number
from palpate.bodies.mesh_quality import LARGEST
from palpate.bodies.particles import Particles
from palpate.bodies.surfaces.tetrahedralize import label_shells
from palpate.collision.contact.proximity import NearStencils, Proximity, limits
from palpate.collision.trees.tree import Tree
from palpate.collision.trees.tree_query import crossing_pairs
from palpate.effects.instrument import CAPSULE, SPHERE, Pose
from palpate.effects.instrument import Instrument as Shape
from palpate.effects.settings import Ball, Capsule, Instrument, Triangles
from palpate.errors import InputError, NotConverged

FLOOR_HALF_WIDTH = 50.0
"""Half a floor's side, in sizes of the body, which must not fall off the edge."""


@dataclass(frozen=True, eq=False)
class Obstacle:
    """A rigid surface with a thickness, from which bodies stay ``radius_m`` [m] away.

    points : (k, 3) [m] before it moves; triangles : (m, 3). A sphere is the triangle (0, 0, 0) of one point, a capsule
    the triangle (0, 1, 1) of two, both with a radius
    times_s : (q,) and shifts_m : (q, 3), the path: uniform motion from each position to the next, at rest before and
    after; empty if it does not move
    """

    name: str
    kind: str
    points: np.ndarray
    triangles: np.ndarray
    radius_m: float
    times_s: np.ndarray
    shifts_m: np.ndarray

    def at(self, t: float) -> np.ndarray:
        """Return its points (k, 3) [m] at the time ``t`` [s]."""
        return self.points + self.shift(t) if len(self.times_s) else self.points

    def shift(self, t: float) -> np.ndarray:
        """Return its displacement (3,) [m] at the time ``t`` [s]."""
        if not len(self.times_s):
            return np.zeros(3)
        return np.array([np.interp(t, self.times_s, self.shifts_m[:, i]) for i in range(3)])

    def pose(self, t: float) -> Pose:
        """Return the pose of a sphere or a capsule at the time ``t`` [s]; InputError for other kinds."""
        return self._first.moved(self.shift(t))

    @cached_property
    def _first(self) -> Pose:
        """The pose before it moves."""
        if self.kind not in (SPHERE, CAPSULE):
            raise InputError(f"{self.name} is a {self.kind}; motions of what is touched know spheres and capsules.")
        along = self.points[-1] - self.points[0]
        length = float(np.linalg.norm(along))
        axis = along / length if length else np.eye(3)[0]
        across = np.cross(np.eye(3)[np.abs(axis).argmin()], axis)
        across /= np.linalg.norm(across)
        up = np.cross(axis, across)
        tip = self.points.mean(axis=0) - self.radius_m * up
        return Pose(Shape(self.kind, self.radius_m, length_m=length), tip, np.array([axis, across, up]))

    @property
    def crossing_s(self) -> float:
        """The shortest time [s] in which it moves by its radius; infinite if it has none, or does not move."""
        distances, times = np.linalg.norm(np.diff(self.shifts_m, axis=0), axis=1), np.diff(self.times_s)
        fastest = float((distances / times).max(initial=0.0))
        return self.radius_m / fastest if self.radius_m and fastest else math.inf


def make_obstacle(tool: Instrument, place: str, name: str, size: float, middle: np.ndarray) -> Obstacle:
    """Return the obstacle that the settings of an instrument describe; ``name`` is its name if they have none.

    size, middle : of the body, [m] and (3,) [m], by which a floor is placed
    Raises InputError, naming ``place``, for lengths that are too large.
    """
    times = np.array(tool.times_s or [], dtype=float)
    shifts = np.array(tool.shifts_m or [], dtype=float).reshape(-1, 3)
    points, triangles = _shape(tool, size, middle)
    radius = getattr(tool, "radius_m", 0.0)
    if not all((np.abs(lengths) <= LARGEST).all() for lengths in (points, shifts, np.array(radius))):
        raise InputError(f"{place} has a length of more than {LARGEST:g} m; give all lengths in metres.")
    return Obstacle(tool.name or name, tool.kind, points, triangles, radius, times, shifts)


def _shape(tool: Instrument, size: float, middle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the points and triangles of an instrument; a floor is one triangle, wide enough."""
    if isinstance(tool, Ball):
        return np.array([tool.center_m], dtype=float), np.array([[0, 0, 0]])
    if isinstance(tool, Capsule):
        return np.array([tool.from_m, tool.to_m], dtype=float), np.array([[0, 1, 1]])
    if isinstance(tool, Triangles):
        from palpate.bodies.mesh_file import load_surface

        return load_surface(tool.file, tool.scale_m)
    up = "xyz".index(tool.axis)
    corners = np.array([[-1.0, -1.0], [3.0, -1.0], [-1.0, 3.0]]) * FLOOR_HALF_WIDTH * size
    points = np.insert(corners + np.delete(middle, up), up, tool.height_m, axis=1)
    return points, np.array([[0, 1, 2]]) if up != 1 else np.array([[0, 2, 1]])


def pieces_of(particles: Particles) -> list[np.ndarray]:
    """Return the triangles (m, 3) of each connected piece of the particles, in the order of their first triangles.

    The surfaces around a body and around its cavities belong to one piece, as its tetrahedra connect them.
    """
    count = len(particles.triangles)
    return [particles.triangles[chosen[:count]] for _, chosen in _pieces(particles)]


def nodes_of_pieces(particles: Particles) -> list[np.ndarray]:
    """Return the nodes (k,) of each of ``pieces_of``, those inside it included."""
    return [np.unique(cells[chosen]) for cells, chosen in _pieces(particles)]


def _pieces(particles: Particles) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return triples of connected nodes (c, 3), the same for each piece, and which (c,) of them are the piece's.

    The triples are the triangles, then two of each tetrahedron.
    """
    triples = np.vstack([particles.triangles, particles.tetrahedra[:, :3], particles.tetrahedra[:, 1:]])
    if particles.ties is not None:  # parts that a cut will separate are one piece, as they begin in touch
        triples = particles.ties.leaders()[triples]
    labels = label_shells(triples, len(particles.nodes))
    return [(triples, labels == label) for label in dict.fromkeys(labels[: len(particles.triangles)].tolist())]


LEAST_CLEARANCE = 1e-8
"""Clearance, relative to the gap, below which surfaces count as touching: the barrier's forces would be too large."""


@dataclass(frozen=True)
class Overlap:
    """Two surfaces, ``first`` and ``second``, that overlap, and a ``sentence`` about it with a place for each name."""

    first: int
    second: int
    sentence: str

    def describe(self, names: list[str]) -> str:
        """Return the sentence, given the names of all surfaces."""
        return self.sentence.format(names[self.first], names[self.second])


def first_overlap(
    points: np.ndarray, surfaces: list[np.ndarray], can_touch: np.ndarray, is_floor: np.ndarray, near: NearStencils
) -> Overlap | None:
    """Return the first two surfaces that cross or touch, or one of which is inside the other; None if there are none.

    points : (n, 3) [m]; surfaces : triangles (m, 3) of each of p
    can_touch : (p, p) bool, which pairs are looked at, on the diagonal which surfaces may cross themselves
    is_floor : (p,) bool, which have an inside although they are open; near : the stencils that may touch
    """
    trees = [Tree(points, triangles) for triangles in surfaces]
    for i, j in np.argwhere(np.triu(can_touch)).tolist():
        if i == j:
            if len(crossing_pairs(trees[i])[0]):
                return Overlap(i, i, "{0} intersects itself where the scene begins; choose another start.")
            continue
        if len(crossing_pairs(trees[i], trees[j])[0]):
            return Overlap(i, j, "{0} intersects {1} where the scene begins; move them apart.")
        for inner, outer in ((i, j), (j, i)):
            inside = winding_number(points[surfaces[inner][0, 0]], points[surfaces[outer]])
            if inside > (0.0 if is_floor[outer] else 0.5):
                return Overlap(inner, outer, "{0} is inside {1} where the scene begins; move it out.")
    touching = np.flatnonzero(near.clearances(points) <= LEAST_CLEARANCE * near.gap)
    if not len(touching):
        return None
    first, second = sorted(near.pieces[touching[0]].tolist())
    return Overlap(first, second, "{0} and {1} touch where the scene begins; move them apart.")


MAX_ROUNDS = 100
"""Most searches for further nodes in the path of those that are displaced already."""


def displace_nodes(
    proximity: Proximity, points: np.ndarray, motion: np.ndarray, n_nodes: int, names: list[str]
) -> np.ndarray:
    """Return nodes (n_nodes, 3) [m] that are displaced to make way for the ``motion`` (n, 3) [m] of obstacles.

    points : (n, 3) [m], the nodes and then the points of obstacles; names : of the pieces
    Nodes that an obstacle would touch make its whole motion, and so do nodes that those would touch, so that nothing
    intersects, however long the motion is. The result is a start for a search, not an equilibrium. Raises NotConverged
    for an obstacle that is driven into nodes that cannot move or that another one displaces.
    """
    travel = float(np.sqrt(np.square(motion).sum(axis=1).max()))
    near, motion = proximity.find_near(points, travel), motion.copy()
    displaced = np.zeros(len(points), dtype=bool)
    displaced[n_nodes:] = True
    for _ in range(MAX_ROUNDS):
        blocked = limits(near.kinds, near.nodes, near.offsets, points, motion) < 1.0
        if not blocked.any():
            return (points + motion)[:n_nodes]
        before = int(displaced.sum())
        for nodes in near.nodes[blocked]:
            driver = nodes[np.argmax(np.square(motion[nodes]).sum(axis=1))]
            if displaced[driver]:
                carried = nodes[~displaced[nodes] & proximity.movable[nodes]]
                motion[carried] = motion[driver]
                displaced[carried] = True
        if int(displaced.sum()) == before:
            break
    # displaced nodes have exactly the obstacle's motion
    driving = (motion[n_nodes:] == motion[driver]).all(axis=1)
    name = names[proximity.owners[n_nodes:][driving][0]]
    raise NotConverged(f"{name} is driven into held nodes, or between two instruments; change its path", [])
