"""Meshes of a body that are finer where an instrument touches it, with the problem of that contact on them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from palpate.benchmark.touch import Touch, Touched
from palpate.bodies.body import Body
from palpate.bodies.fine_surface_map import FineSurfaceMap
from palpate.bodies.local_refinement import LocalBody, LocalRefinement
from palpate.bodies.mesh import TetMesh
from palpate.bodies.refinement import with_midpoints
from palpate.effects.instrument import GRASP, PUNCH, Instrument
from palpate.errors import NotConverged
from palpate.solvers.grasping import Grasping
from palpate.solvers.indentation import Indentation, Touching, contact_points

REACH, MARGIN = 1.3, 1.5
"""Distance from the place within which a level is refined: so many contact radii plus so many of its own edges."""
COARSER = 2
"""Number of levels by which all other elements are coarser than those at the rim of what is held, whose error is many
times theirs: organs are then as exact as with four times the nodes everywhere."""
RIMMED = (PUNCH, GRASP)
"""Kinds whose pressure is greatest at the rim."""
SHARPEST = 0.1
"""Radius of a punch's edge, over its own, below which elements follow it no further."""
TOLERANCE = 1e-4
"""Residual over the forces of contact."""
TOUCHED_WITHIN = 0.7
"""Distance from the instrument's last position within which the surface may come to touch it, over the depth."""


def contact_radius(instrument: Instrument, depth_m: float) -> float:
    """Estimate the radius [m] of the contact of an instrument at a depth [m]; of a capsule half the width."""
    round_one = min(float(np.sqrt(depth_m * instrument.radius_m)), instrument.radius_m)
    return instrument.radius_m if instrument.kind in RIMMED else round_one


@dataclass(frozen=True, eq=False)
class TouchedMesh:
    """Quadratic elements on a mesh that is refined where a touch is.

    body : whose last two levels are this mesh and the nodes of its quadratic elements
    problem : of the contact or the grasp; up : the map (n_surface, n) from its nodes to the body's fine surface
    edge_m : length of the surface's edges where it is touched [m]
    """

    touch: Touch
    body: Body
    problem: Indentation | Grasping
    up: sparse.csr_array
    edge_m: float

    @property
    def level(self) -> int:
        """The number of the mesh among the levels of ``body``."""
        return len(self.body.levels) - 2

    @property
    def contact(self) -> Indentation:
        """``problem``, of an instrument that does not grasp."""
        assert isinstance(self.problem, Indentation)
        return self.problem

    def answer(self, tolerance: float) -> tuple[Touched, Touching]:
        """Solve to the depth of the touch; return the answer, and the state of the elements. May raise NotConverged."""
        *_, state = self.problem.push(self.touch.direction, [self.touch.depth_m], tolerance)
        return answer_of(self.problem, state, self.touch, self.up), state


def answer_of(problem: Indentation | Grasping, state: Touching, touch: Touch, up: sparse.csr_array) -> Touched:
    """Return the answer to a touch by a ``state`` of ``problem``; up : map of its nodes to the fine surface."""
    return Touched(up @ (state.x - problem.mesh.nodes), float(state.force @ touch.direction), state.area_m2)


def problem_of(body: Body, level: int, order: int, touches: Sequence[Touch], shape: Body) -> Indentation | Grasping:
    """Return the contact or grasp problem of the first of ``touches`` on a level of ``body``, by elements of ``order``.

    touches : of one place, any of which may touch its contact points; shape : the body that they are defined on
    """
    first = touches[0]
    if first.grasps:
        return Grasping(body, level, order, first.patch(shape))
    poses = [touch.pose(shape) for touch in touches]
    deepest = [pose.moved(touch.depth_m * touch.direction) for pose, touch in zip(poses, touches, strict=True)]

    def near(places: np.ndarray) -> np.ndarray:
        deepest_poses = zip(deepest, touches, strict=True)
        return np.min([pose.gaps(places)[0] / touch.depth_m for pose, touch in deepest_poses], axis=0) < TOUCHED_WITHIN

    points = contact_points(body.levels[level], order, body.material.young_pa, near)
    return Indentation(body, level, order, points, poses[:1], first.instrument.sticks)


def _reach(touch: Touch) -> float:
    """Return the radius [m] around the place within which a touch needs small elements."""
    return REACH * contact_radius(touch.instrument, touch.depth_m) + 0.5 * touch.instrument.length_m


FINEST = 9
"""Level beyond which no mesh is refined: its elements are 500 times smaller than the body's."""
LEAST_DET = 0.4
"""Smallest det F of elements four times as long as the truth's, above which a touch is expected to have a truth."""


def check_by_coarse_elements(body: Body, along_radius: float) -> Callable[[Touch], bool]:
    """Return a function that solves a touch of ``body`` in a second, and tells whether it is likely to have a truth.

    along_radius : elements along the contact's radius in the truth; those here are four times as long
    """
    meshes = TouchedMeshes(body)

    def has_answer(touch: Touch) -> bool:
        try:
            mesh = meshes.around(touch, 0, max(0, meshes.level_for(touch, along_radius) - 2))
            return mesh.problem.least_det(mesh.answer(TOLERANCE)[1].x) > LEAST_DET
        except NotConverged:
            return False

    return has_answer


def refined(base: Body, places: np.ndarray, reach_m: np.ndarray, rim_halvings: int) -> Body:
    """Return ``base`` with elements halved near ``places``, at the rim of what is held, and elsewhere less often.

    places : (3,) or (k, 3) [m]; reach_m : (level,) [m] distances from them within which each halving is made
    rim_halvings : how often the rim of what is held is halved; all other elements are halved COARSER times less
    """
    radii = np.full(max(len(reach_m), rim_halvings), -1.0)  # a radius a halving, −1 for nowhere
    radii[: len(reach_m)] = reach_m
    radii[: max(0, rim_halvings - COARSER)] = 2.0 * np.linalg.norm(np.ptp(base.coarse.nodes, axis=0))  # everywhere
    return (
        LocalRefinement(base, len(radii)).around(places, radii.tolist(), rim_halvings) if len(radii) else base.up_to(0)
    )


class TouchedMeshes:
    """Meshes of one body that are refined for touches, from its first level with the shape of the finest on."""

    def __init__(self, body: Body):
        self._body = body
        self._base = body.from_level(body.shape_level if body.smooth is None else len(body.levels) - 1)
        self._surface = FineSurfaceMap(self._base)

    def level_for(self, touch: Touch, along_radius: float) -> int:
        """Return the level with at least ``along_radius`` elements along the radius of the contact.

        For a punch or a grasp, whose pressure is greatest at the rim, the radius is the geometric mean of its own and
        the edge's. NotConverged beyond FINEST.
        """
        radius_m = contact_radius(touch.instrument, touch.depth_m)
        if touch.instrument.kind in RIMMED:
            radius_m = np.sqrt(radius_m * max(touch.instrument.edge_m, SHARPEST * radius_m))
        level = max(0, int(np.ceil(np.log2(along_radius * self._edge(touch.node) / radius_m))))
        if level > FINEST:
            raise NotConverged(f"what touches is {1e3 * radius_m:.2g} mm wide, too little for any mesh", [float("nan")])
        return level

    def around(self, touch: Touch, held: int, level: int) -> TouchedMesh:
        """Return the mesh refined to ``level`` where it is touched, and to ``held`` at the rim of what is held.

        Levels count from the first with the shape of the finest; other elements are as of ``refined``. InputError where
        the instrument does not touch.
        """
        return self.around_all([touch], held, level)

    def around_all(self, touches: Sequence[Touch], held: int, level: int) -> TouchedMesh:
        """Return the mesh for the first of several touches of one place, with contact points for all of them."""
        first, local, depth = touches[0], self._refined(touches, held, level), max(level, held)
        up, whole = self._surface.of(local, 2), with_midpoints(local, depth)
        edge = float(self._edge(first.node) / 2**level)
        return TouchedMesh(first, whole, problem_of(whole, depth, 2, touches, self._body), up, edge)

    def _refined(self, touches: Sequence[Touch], held: int, level: int) -> Body:
        """Return the body refined to ``level`` for the touches, and to ``held`` at the rim of what is held."""
        place = self._body.fine.nodes[touches[0].node]
        return refined(self._base, place, self._reach(touches, np.arange(level)), held)

    def _reach(self, touches: Sequence[Touch], levels: np.ndarray) -> np.ndarray:
        """Return the distance [m] from the place within which elements of each of ``levels`` are halved."""
        return max(map(_reach, touches)) + MARGIN * self._edge(touches[0].node) / 2.0**levels

    def size(self, touch: Touch, held: int, level: int) -> tuple[int, int]:
        """Estimate how many nodes and tetrahedra the mesh of ``around`` has, from one level less; ``level`` at least 1.

        The estimate is 1 to 9 % too small for truths of pads and the liver: it leaves out the elements that are halved
        because those beside them are.
        """
        local = self._refined([touch], max(held - 1, 0), level - 1)
        coarse, mesh, cells = self._base.coarse, local.fine, local.fine.tetrahedra
        assert isinstance(coarse, TetMesh) and isinstance(mesh, TetMesh)  # sheets are not touched
        root_of = local.roots[-1] if isinstance(local, LocalBody) else np.arange(len(cells))
        # how many elements one of the first level becomes, halved as often as around each element here
        parts_of_root = np.full(len(cells), 8.0 ** max(0, held - COARSER))
        distances = np.linalg.norm(mesh.nodes - self._body.fine.nodes[touch.node], axis=1)
        is_near = distances <= self._reach([touch], np.array([level - 1]))
        parts_of_root[is_near[cells].any(axis=1)] = 8.0 ** max(level, held - COARSER)
        is_held = np.isin(cells, local.anchors[-1])
        is_at_rim = np.isin(cells, cells[is_held & ~is_held.all(axis=1, keepdims=True)]).any(axis=1)
        parts_of_root[is_at_rim] = np.maximum(parts_of_root[is_at_rim], 8.0**held)
        tetrahedra = np.maximum(parts_of_root * mesh.volumes / coarse.volumes[root_of], 1.0).sum()
        return round(tetrahedra * (len(mesh.nodes) + len(mesh.edges)) / len(cells)), round(tetrahedra)

    def at_rim(self, held: int) -> tuple[Body, int]:
        """Return the body refined to ``held`` at the rim of what is held only, with quadratic nodes, and ``held``."""
        body, any_place = self._base, self._base.coarse.nodes[0]
        local = LocalRefinement(body, held).around(any_place, -1.0, held) if held else body.up_to(0)
        return with_midpoints(local, held), held

    def edge_m(self, touch: Touch, level: int) -> float:
        """Return about how long [m] the surface's edges are at a touch on ``level``."""
        return self._edge(touch.node) / 2.0**level

    def _edge(self, node: int) -> float:
        """Return the mean length [m] of the edges of the coarse triangles nearest to a node."""
        mesh, place = self._base.coarse, self._body.fine.nodes[node]
        corners = mesh.nodes[mesh.triangles]
        nearest_corners = corners[np.argsort(np.linalg.norm(corners.mean(axis=1) - place, axis=1))[:4]]
        return float(np.linalg.norm(nearest_corners - np.roll(nearest_corners, 1, axis=1), axis=2).mean())
