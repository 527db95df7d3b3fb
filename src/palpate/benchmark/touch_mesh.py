"""Meshes of a body that are finer where an instrument touches it, with the problem of that contact on them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from palpate.benchmark.touch import Touch, Touched
from palpate.bodies.body import Body
from palpate.bodies.fine_surface_map import FineSurfaceMap
from palpate.bodies.local_refinement import LocalBody, LocalRefinement
from palpate.bodies.mesh import Mesh, TetMesh
from palpate.bodies.refinement import with_midpoints
from palpate.effects.instrument import GRASP, PUNCH, Instrument, Pose
from palpate.errors import NotConverged
from palpate.solvers.grasping import Grasping
from palpate.solvers.indentation import ContactPoints, Indentation, Touching, contact_points

REACH, MARGIN = 1.3, 1.5
"""A level is refined within so many contact radii and so many of its own edges from the place."""
COARSER = 2
"""By how many levels elements are coarser than at the rim of what is held, whose error is many times theirs: organs are
then as exact as with four times the nodes everywhere."""
RIMMED = (PUNCH, GRASP)
"""Kinds whose pressure is greatest at the rim."""
SHARPEST = 0.1
"""Radius of a punch's edge, over its own, below which elements follow it no further."""
TOLERANCE = 1e-4
"""Residual over the forces of contact."""
TOUCHED_WITHIN = 0.7
"""Share of the depth within which of the instrument's last position the surface may come to touch it."""


def contact_radius(instrument: Instrument, depth_m: float) -> float:
    """Estimate the radius [m] of what touches at a depth; of a capsule half the width."""
    round_one = min(float(np.sqrt(depth_m * instrument.radius_m)), instrument.radius_m)
    return instrument.radius_m if instrument.kind in RIMMED else round_one


@dataclass(frozen=True, eq=False)
class TouchedMesh:
    """Quadratic elements on a mesh that is refined around one place.

    body : with this mesh, and the nodes of the elements, as its last two levels; problem : of the contact or the grasp
    up : the map (n_surface, n) from its nodes to the fine surface of the whole body
    edge_m : length of the surface's edges where it is touched [m]
    """

    touch: Touch
    body: Body
    problem: Indentation | Grasping
    up: sparse.csr_array
    edge_m: float

    @property
    def level(self) -> int:
        """The level of ``body`` that the mesh is."""
        return len(self.body.levels) - 2

    @property
    def contact(self) -> Indentation:
        """The problem of an instrument that does not grasp."""
        assert isinstance(self.problem, Indentation)
        return self.problem

    def answer(self, tolerance: float) -> tuple[Touched, Touching]:
        """Return the answer to the touch, and the last state of the elements; NotConverged where there is none."""
        *_, state = self.problem.push(self.touch.direction, [self.touch.depth_m], tolerance)
        return answer_of(self.problem, state, self.touch, self.up), state


def answer_of(problem: Indentation | Grasping, state: Touching, touch: Touch, up: sparse.csr_array) -> Touched:
    """Return the answer that a ``state`` of ``problem`` is; up : its nodes' map to the fine surface."""
    return Touched(up @ (state.x - problem.mesh.nodes), float(state.force @ touch.direction), state.area_m2)


def points_touched(
    mesh: Mesh, order: int, young_pa: float, touches: Sequence[Touch], poses: Sequence[Pose]
) -> ContactPoints:
    """Return the points of ``mesh`` that any of ``touches`` may touch; poses : where each begins."""
    last = [pose.moved(touch.depth_m * touch.direction) for pose, touch in zip(poses, touches, strict=True)]

    def near(at: np.ndarray) -> np.ndarray:
        ends = zip(last, touches, strict=True)
        return np.min([pose.gaps(at)[0] / touch.depth_m for pose, touch in ends], axis=0) < TOUCHED_WITHIN

    return contact_points(mesh, order, young_pa, near)


def problem_of(body: Body, level: int, order: int, touches: Sequence[Touch], shape: Body) -> Indentation | Grasping:
    """Return the problem of the first of ``touches`` on a level of ``body``, with elements of ``order``.

    Its points are those that any of the touches may touch; shape : the body that they are described on
    """
    first = touches[0]
    if first.grasps:
        return Grasping(body, level, order, first.patch(shape))
    poses = [touch.pose(shape) for touch in touches]
    points = points_touched(body.levels[level], order, body.material.young_pa, touches, poses)
    return Indentation(body, level, order, points, poses[:1], first.instrument.sticks)


def _reach(touch: Touch) -> float:
    """Return the radius [m] around the place within which a touch needs small elements."""
    return REACH * contact_radius(touch.instrument, touch.depth_m) + 0.5 * touch.instrument.length_m


FINEST = 9
"""Level beyond which no mesh is refined: its elements are 500 times smaller than the body's."""
LEAST_DET = 0.4
"""Smallest det F of elements that are four times as long as the truth's, at which a body is said to bear a touch."""


def bearing(body: Body, along_radius: float) -> Callable[[Touch], bool]:
    """Return what says of a touch whether ``body`` bears it: elements four times as long as asked for, in a second.

    along_radius : as of the truth
    """
    meshes = TouchedMeshes(body)

    def bears(touch: Touch) -> bool:
        try:
            mesh = meshes.around(touch, 0, max(0, meshes.level_for(touch, along_radius) - 2))
            return mesh.problem.least_det(mesh.answer(TOLERANCE)[1].x) > LEAST_DET
        except NotConverged:
            return False

    return bears


class TouchedMeshes:
    """Makes such meshes of one body: from its first level on that has the shape of its finest."""

    def __init__(self, body: Body):
        self._body = body
        self._base = body.from_level(body.shape_level if body.smooth is None else len(body.levels) - 1)
        self._surface = FineSurfaceMap(self._base)

    def level_for(self, touch: Touch, along_radius: float) -> int:
        """Return the level on which so many elements at least lie along the radius of what touches.

        Where that has a rim, the radius is the geometric mean of its own and the edge's. NotConverged beyond FINEST.
        """
        size = contact_radius(touch.instrument, touch.depth_m)
        if touch.instrument.kind in RIMMED:
            size = np.sqrt(size * max(touch.instrument.edge_m, SHARPEST * size))
        level = max(0, int(np.ceil(np.log2(along_radius * self._edge(touch.node) / size))))
        if level > FINEST:
            raise NotConverged(f"what touches is {1e3 * size:.2g} mm wide, too little for any mesh", [float("nan")])
        return level

    def around(self, touch: Touch, held: int, level: int) -> TouchedMesh:
        """Return the mesh refined to ``level`` where it is touched, and to ``held`` at the rim of what is held.

        Elsewhere it is COARSER levels coarser than at the rim. Levels count from the first of the shape. InputError
        where the instrument does not touch.
        """
        return self.around_all([touch], held, level)

    def around_all(self, touches: Sequence[Touch], held: int, level: int) -> TouchedMesh:
        """Return the mesh for the first of several touches of one place, with the points that any of them may touch."""
        first, local, depth = touches[0], self._refined(touches, held, level), max(level, held)
        up, whole = self._surface.of(local, 2), with_midpoints(local, depth)
        edge = float(self._edge(first.node) / 2**level)
        return TouchedMesh(first, whole, problem_of(whole, depth, 2, touches, self._body), up, edge)

    def _refined(self, touches: Sequence[Touch], held: int, level: int) -> Body:
        """Return the body, each of whose levels is as fine as the touches want it."""
        body, depth, everywhere = self._base, max(level, held), max(0, held - COARSER)
        levels = np.arange(depth)
        all_of_it = 2.0 * np.linalg.norm(np.ptp(body.coarse.nodes, axis=0))
        radii = np.where(levels < everywhere, all_of_it, np.where(levels < level, self._reach(touches, levels), -1.0))
        place = self._body.fine.nodes[touches[0].node]
        return LocalRefinement(body, depth).around(place, radii.tolist(), held) if depth else body.up_to(0)

    def _reach(self, touches: Sequence[Touch], levels: np.ndarray) -> np.ndarray:
        """Return within which radius [m] elements of ``levels`` are split."""
        return max(map(_reach, touches)) + MARGIN * self._edge(touches[0].node) / 2.0**levels

    def size(self, touch: Touch, held: int, level: int) -> tuple[int, int]:
        """Estimate the nodes and tetrahedra of ``around`` of the same, ``level`` at least 1, from coarser elements.

        It is 1 to 9 % too small for truths of pads and the liver: elements beside those split in eight are split, too.
        """
        local = self._refined([touch], max(held - 1, 0), level - 1)
        whole, mesh, cells = self._base.coarse, local.fine, local.fine.tetrahedra
        assert isinstance(whole, TetMesh) and isinstance(mesh, TetMesh)  # sheets are not touched
        roots = local.roots[-1] if isinstance(local, LocalBody) else np.arange(len(cells))
        wanted = np.full(len(cells), 8.0 ** max(0, held - COARSER))  # parts of each element of the body's first level
        away = np.linalg.norm(mesh.nodes - self._body.fine.nodes[touch.node], axis=1)
        near = away <= self._reach([touch], np.array([level - 1]))
        wanted[near[cells].any(axis=1)] = 8.0 ** max(level, held - COARSER)
        fixed = np.isin(cells, local.anchors[-1])
        rim = np.isin(cells, cells[fixed & ~fixed.all(axis=1, keepdims=True)]).any(axis=1)
        wanted[rim] = np.maximum(wanted[rim], 8.0**held)
        parts = np.maximum(wanted * mesh.volumes / whole.volumes[roots], 1.0).sum()
        return round(parts * (len(mesh.nodes) + len(mesh.edges)) / len(cells)), round(parts)

    def at_rim(self, held: int) -> tuple[Body, int]:
        """Return the body refined to ``held`` at the rim of what is held only, with a level more, and ``held``."""
        body, middle = self._base, self._base.coarse.nodes[0]
        local = LocalRefinement(body, held).around(middle, -1.0, held) if held else body.up_to(0)
        return with_midpoints(local, held), held

    def edge_m(self, touch: Touch, level: int) -> float:
        """Return about how long [m] the surface's edges are at a touch on ``level``."""
        return self._edge(touch.node) / 2.0**level

    def _edge(self, node: int) -> float:
        """Return the mean length [m] of the edges of the coarse triangles nearest to a node."""
        mesh, place = self._base.coarse, self._body.fine.nodes[node]
        corners = mesh.nodes[mesh.triangles]
        nearest = corners[np.argsort(np.linalg.norm(corners.mean(axis=1) - place, axis=1))[:4]]
        return float(np.linalg.norm(nearest - np.roll(nearest, 1, axis=1), axis=2).mean())
