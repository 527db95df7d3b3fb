"""Find the truth of cut bodies whose lips are pulled by hooks: quadratic elements on meshes that conform to the cut.

Elements are halved along two axes, on three meshes each: at the front of the cut, where stresses are infinite, and at
the rim of what is held or grasped. The limit is that of both axes, as for a touch (``touch_truth``). Its own error is
the sum of those of both axes, of their mixture, and of all elements, by a mesh of the body's level before. The lips are
free: a pull that closes them has no truth here.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from time import perf_counter
from typing import NamedTuple

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from palpate.benchmark.richardson import CROSS, combined, limit_over, rejection
from palpate.bodies.body import Body
from palpate.bodies.cutting.conform import CutBody, cut_body
from palpate.bodies.cutting.cut import Blade, Cut
from palpate.bodies.local_refinement import LocalRefinement
from palpate.bodies.mesh import Mesh, TetMesh, area_normals, unit
from palpate.bodies.mesh_quality import dihedral_angles
from palpate.bodies.refinement import coarse_triangles, with_midpoints
from palpate.bodies.surface_quadrature import surface_interpolation
from palpate.errors import InputError
from palpate.solvers.grasping import GraspedPatch, Grasping

AROUND = 1.6
"""Edges of the front within which elements are halved at it."""
TOLERANCE = 1e-6
"""Residual over the forces of the hooks."""
CLOSED = 1e-3
"""Overlap of the lips over their largest opening, above which they are said to close."""
MOST_SURFACE, MOST_OPENING = 0.005, 0.03
"""Own errors over the surface and in the opening above which a cut judges no model."""
BESIDE = 0.5
"""Largest distance of a place of the mouth from the lips, over the size of a triangle."""
PLACES = 9
"""Number of places along a path where the opening is measured."""


class Hook(NamedTuple):
    """A patch of the skin that is grasped, and the displacement (3,) [m] that it is given."""

    patch: GraspedPatch
    shift_m: np.ndarray


class Pulled(NamedTuple):
    """The answer of a model or a mesh to a cut and a pull by h hooks.

    displacement : (n, 3) [m] of the whole body's fine surface nodes, of the positive lip where both are at one place
    opening : (k, 3) [m], displacement of the positive lip from the negative one at places along the cut
    force : (h,) [N] of each hook on the body, along its displacement
    """

    displacement: np.ndarray
    opening: np.ndarray
    force: np.ndarray


@dataclass(frozen=True, eq=False)
class CutTruth:
    """The truth of one cut and pull.

    pulled : the limit; own : (3,) its own errors, those of ``pull_errors``
    front_ratio, rim_ratio : of the last two changes of the surface, by halving at the front and at the rims; NaN where
        nothing changes
    least_opening_m : [m] of the lips anywhere, along the normal of the cut, on the finest mesh; negative: they overlap
    least_det : smallest det F there; least_angle : smallest of the elements that are halved [°]
    nodes : of the largest mesh; seconds : of all [s]
    rejected : why it judges no model, or ""
    """

    pulled: Pulled
    own: np.ndarray
    front_ratio: float
    rim_ratio: float
    least_opening_m: float
    least_det: float
    least_angle: float
    nodes: int
    seconds: float
    rejected: str


def pull_errors(answer: Pulled, truth: Pulled) -> tuple[float, float, float]:
    """Return the RMS error over the surface, the largest of the opening and that of the forces, each over its peak."""
    distance = np.linalg.norm(answer.displacement - truth.displacement, axis=1)
    peak = np.linalg.norm(truth.displacement, axis=1).max()
    widest = np.linalg.norm(truth.opening, axis=1).max(initial=0.0)
    opening = np.linalg.norm(answer.opening - truth.opening, axis=1).max(initial=0.0)
    force = np.abs(answer.force - truth.force).max() / np.abs(truth.force).max()
    return float(np.sqrt(np.mean(distance**2)) / peak), float(opening / widest) if widest else 0.0, float(force)


def mouth(mesh: Mesh, cut: Cut) -> np.ndarray:
    """Return the points of the skin along a blade's path where the opening is measured, (k, 3) [m], at most PLACES.

    mesh : of the whole body
    Places are even between the ends of the path. Each point is where the line through its place along the blade meets
    the skin nearest to the path, if the skin is cut there. A cut of another kind than a blade's has none.
    """
    if not isinstance(cut, Blade):
        return np.empty((0, 3))
    lengths_m = np.linspace(0.0, min(cut.length_m, cut.reached_m), PLACES + 2)[1:-1]
    a, b, c = (mesh.nodes[mesh.triangles[:, i]] for i in range(3))
    normals, points = area_normals(mesh.nodes, mesh.triangles), []
    facing = normals @ cut.direction
    for place in cut.at(lengths_m, np.zeros(PLACES)):
        # how far along the line it meets the plane of each triangle, where, and whether inside of it
        dist = np.divide(((a - place) * normals).sum(axis=1), facing, out=np.full(len(a), np.inf), where=facing != 0.0)
        crossings = place + np.where(np.isfinite(dist), dist, 0.0)[:, None] * cut.direction
        edge_sides = [(np.cross(q - p, crossings - p) * normals).sum(axis=1) for p, q in ((a, b), (b, c), (c, a))]
        is_crossed = (np.min(edge_sides, axis=0) >= -1e-9 * (normals**2).sum(axis=1)) & (cut.within(crossings) > 0.0)
        if is_crossed.any():
            points.append(crossings[is_crossed][np.abs(dist[is_crossed]).argmin()])
    return np.array(points).reshape(-1, 3)


def skin_map(
    mesh: Mesh, side: np.ndarray, points: np.ndarray, sign: float | np.ndarray, degree: int = 2, beside: float = 0.0
) -> sparse.csr_array:
    """Return the interpolation matrix (k, n) from a cut mesh to ``points`` (k, 3) [m] of its skin.

    side : (t,) of each triangle of ``mesh``, whose sign says on which side of the cut it lies; NaN if it is no skin
    sign : the side that is taken where a point is on both, one or (k,)
    degree : 2 for quadratic elements, whose n counts nodes and edges
    beside : distance from a triangle of that side, over its size, up to which a point is taken as one of it
    InputError for a point that is not on the skin.
    """
    skin = np.flatnonzero(~np.isnan(side))
    corners = mesh.nodes[mesh.triangles[skin]]
    middles = corners.mean(axis=1)
    reach = np.linalg.norm(corners - middles[:, None], axis=2).max(axis=1)
    tree, chosen, weights = cKDTree(middles), [], []
    for point, wanted in zip(points, np.broadcast_to(sign, len(points)), strict=True):
        nearby = np.array(tree.query_ball_point(point, reach.max()))
        nearby = nearby[np.linalg.norm(middles[nearby] - point, axis=1) <= reach[nearby] * (1.0 + 1e-9 + beside)]
        # barycentric coordinates of the nearest point in the plane of each triangle
        corner, edges = corners[nearby, 0], np.swapaxes(corners[nearby, 1:] - corners[nearby, :1], 1, 2)
        coordinates = np.einsum("tab,tb->ta", np.linalg.pinv(edges), point - corner)
        off_plane = np.linalg.norm(point - corner - np.einsum("tab,tb->ta", edges, coordinates), axis=1)
        outside = -np.minimum(coordinates.min(axis=1), 1.0 - coordinates.sum(axis=1))
        distance, on_other_side = np.maximum(outside, off_plane / reach[nearby]), np.sign(side[skin[nearby]]) != wanted
        is_on = distance <= 1e-6
        if not is_on.any():
            raise InputError("a point is not on the skin of the cut mesh; give the body that was cut.")
        best = np.lexsort((distance, on_other_side, ~(is_on | (distance <= beside) & ~on_other_side)))[0]
        chosen.append(skin[nearby[best]])
        weights.append([1.0 - coordinates[best].sum(), *coordinates[best]])
    return surface_interpolation(mesh, np.array(chosen, dtype=int), np.array(weights).reshape(-1, 3), degree)


def halved(cut: CutBody, front: int, rim: int = 0) -> Body:
    """Return a cut body with levels on which elements are halved at its front and at the rim of what is held.

    front, rim : how often
    The last level has the nodes of quadratic elements on the one before.
    """
    depth, ends = max(front, rim), cut.coarse.nodes[cut.front]
    if not depth:
        return with_midpoints(cut, 0)
    longest = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).max(initial=0.0)
    radii = np.where(np.arange(depth) < front, AROUND * longest / 2.0 ** np.arange(depth), -1.0)
    shares = np.linspace(0.0, 1.0, 1 + 2**front)[:, None]
    # without a front no place is halved, and any point will do
    places = (ends[:, :1] + shares * (ends[:, 1:] - ends[:, :1])).reshape(-1, 3) if len(ends) else cut.coarse.nodes[:1]
    radii = radii if len(ends) else np.full(depth, -1.0)
    return with_midpoints(LocalRefinement(cut, depth).around(places, radii.tolist(), rim), depth)


def lips_of(cut: CutBody, body: Body, side: int) -> np.ndarray:
    """Return the triangles (t, 3) of one lip, side 0 or 1, on the last level of ``body``, as ``halved`` returns it."""
    triangles = body.fine.triangles
    return triangles[_among(coarse_triangles(body.prolongation, triangles), cut.lips[:, side])]


def pulled(problem: Grasping, hooks: Sequence[Hook]) -> np.ndarray:
    """Return the positions (n, 3) [m] with all hooks at their displacements; errors as ``Grasping.push``."""
    directions, largest_m = np.zeros_like(problem.mesh.nodes), max(float(np.linalg.norm(h.shift_m)) for h in hooks)
    for hook in hooks:
        directions[hook.patch.nodes_of(problem.mesh)] = hook.shift_m / largest_m
    (state,) = problem.push(directions[problem.grasped], [largest_m], TOLERANCE)
    return state.x


def forces_on(problem: Grasping, hooks: Sequence[Hook], x: np.ndarray) -> np.ndarray:
    """Return the force [N] of each hook on the body at ``x`` (n, 3) [m], along its displacement."""
    force = problem.free_force(x)
    return np.array([-force[h.patch.nodes_of(problem.mesh)].sum(axis=0) @ unit(h.shift_m) for h in hooks])


class CutMesh:
    """Quadratic elements on a cut body, halved towards its front and the rims of what is held or grasped.

    front, rim : how often elements are halved there
    Raises InputError where a hook's patch is not made of whole triangles of the cut mesh, or is held or on a lip.
    """

    def __init__(self, cut: CutBody, hooks: Sequence[Hook], front: int, rim: int):
        grasped = np.unique(np.concatenate([_grasped(cut, hook.patch) for hook in hooks]))
        self._cut, self._hooks, depth = cut, hooks, max(front, rim)
        body = halved(replace(cut, anchors=[np.union1d(cut.anchors[0], grasped)]), front, rim)
        patch = GraspedPatch(np.concatenate([hook.patch.corners for hook in hooks]))
        free = [np.setdiff1d(each, patch.nodes_of(mesh)) for each, mesh in zip(body.anchors, body.levels, strict=True)]
        self.problem = Grasping(replace(body, anchors=free), depth, 2, patch)
        self._mesh, self._body = body.levels[depth], body

    def pull(self) -> np.ndarray:
        """Return the positions (n, 3) [m] of nodes and edge midpoints with all hooks at their displacements.

        Raises NotConverged where no stable equilibrium is found, or an element is inverted.
        """
        return pulled(self.problem, self._hooks)

    def answer(self, x: np.ndarray, surface: np.ndarray, places: np.ndarray) -> Pulled:
        """Return the answer at positions ``x`` for the points at rest ``surface`` (n, 3) and ``places`` (k, 3) [m]."""
        moved, side = x - self.problem.mesh.nodes, self._side_of_skin()
        assert self._cut.cut is not None
        # the mesh may have bent the cut to a place beside it, which is then on both lips
        signs = np.where(self._cut.cut.across(surface) >= 0.0, 1.0, -1.0)
        displacement = skin_map(self._mesh, side, surface, signs) @ moved
        # where the cut crosses an edge of the skin the lips end beside it, and the place is on one of them
        positive, negative = (skin_map(self._mesh, side, places, sign, beside=BESIDE) @ moved for sign in (1.0, -1.0))
        return Pulled(displacement, positive - negative, forces_on(self.problem, self._hooks, x))

    def least_opening(self, x: np.ndarray) -> tuple[float, float]:
        """Return the least and the largest opening [m] between nodes of both lips, along the normal of the cut.

        x : positions (n, 3) [m]. Lips are halved independently, so that nodes without one opposite are left out.
        """
        lips, rest = [lips_of(self._cut, self._body, side) for side in (0, 1)], self.problem.mesh.nodes
        nodes_0, nodes_1 = map(np.unique, lips)
        # bytes of coordinates, by which nodes at the same place are paired
        keys_0, keys_1 = (np.ascontiguousarray(rest[each] + 0.0).view("V24").ravel() for each in (nodes_0, nodes_1))
        _, paired_0, paired_1 = np.intersect1d(keys_0, keys_1, return_indices=True)
        nodes_0, nodes_1 = nodes_0[paired_0], nodes_1[paired_1]
        normals = np.zeros_like(rest)
        for corner in range(3):
            np.add.at(normals, lips[0][:, corner], area_normals(rest, lips[0]))
        opening = -((x[nodes_0] - x[nodes_1]) * unit(normals[nodes_0])).sum(axis=1)
        return float(opening.min(initial=0.0)), float(opening.max(initial=0.0))

    def _side_of_skin(self) -> np.ndarray:
        """Return the distance of each triangle of the mesh across the cut, (t,) [m], with a sign; NaN on the lips."""
        triangles = self._mesh.triangles
        coarse = coarse_triangles(self._body.up_to(len(self._body.levels) - 2).prolongation, triangles)
        assert self._cut.cut is not None
        side = self._cut.cut.across(self._mesh.nodes[triangles].mean(axis=1))
        side[_among(coarse, self._cut.lips.reshape(-1, 3))] = np.nan
        return side


def _grasped(cut: CutBody, patch: GraspedPatch) -> np.ndarray:
    """Return the nodes of a cut mesh that a hook grasps, increasing; InputError if any is at the cut or is held."""
    mesh, nodes = cut.coarse, patch.nodes_of(cut.coarse)
    mesh_patch = GraspedPatch(mesh.nodes[mesh.triangles[np.isin(mesh.triangles, nodes).all(axis=1)]])
    if np.isin(nodes, cut.lips).any() or abs(mesh_patch.area_m2 - patch.area_m2) > 1e-6 * patch.area_m2:
        raise InputError(f"{cut.name}: a hook is so near the cut that the mesh there is not the body's; move it away.")
    if np.isin(nodes, cut.anchors[0]).any():
        raise InputError(f"{cut.name}: a hook grasps what is held; move it away.")
    return nodes


def _among(triangles: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Return which of ``triangles`` (t, 3) are among others (k, 3), in whatever order of nodes, (t,) bool."""
    known_triangles = set(map(tuple, np.sort(others, axis=1).tolist()))
    return np.array([tuple(each) in known_triangles for each in np.sort(triangles, axis=1).tolist()], dtype=bool)


def with_patches(body: Body, hooks: Sequence[Hook], level: int) -> Body:
    """Return the body up to ``level``, refined where hooks grasp so that its triangles there are the finest level's."""
    if not (depth := len(body.levels) - 1 - level):
        return body
    corners = np.concatenate([hook.patch.corners for hook in hooks])
    longest_edge = float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max())
    radii = (longest_edge * 2.0 ** np.arange(depth)[::-1]).tolist()
    return LocalRefinement(body.from_level(level), depth).around(corners.reshape(-1, 3), radii)


def truth_of_cut(
    body: Body, cut: Cut, hooks: Sequence[Hook], edge_m: float, front_m: float, places: np.ndarray | None = None
) -> CutTruth:
    """Find the truth of a cut body whose lips are pulled by hooks.

    edge_m, front_m : as ``cut_body`` takes them, for the mesh that is halved
    places : (k, 3) [m] of the mouth where the opening is measured, by default those of ``mouth``
    """
    begin, surface = perf_counter(), body.fine.nodes[body.fine.surface]
    places = mouth(body.fine, cut) if places is None else places
    coarser_cut = cut_body(with_patches(body, hooks, len(body.levels) - 2), cut, edge_m, front_m)
    finer_cut = cut_body(body, cut, edge_m, front_m)
    coarser_mesh = CutMesh(coarser_cut, hooks, 0, 0)
    coarser_answer, answers, nodes = coarser_mesh.answer(coarser_mesh.pull(), surface, places), {}, 0
    for front, rim in CROSS:
        last_mesh = CutMesh(finer_cut, hooks, front, rim)
        positions = last_mesh.pull()
        answers[front, rim] = last_mesh.answer(positions, surface, places)
        nodes = max(nodes, len(positions))
    limit = limit_over(answers, (1, 1), (None, None))
    limit.off.append([combined((WHOLE, -WHOLE), (answers[0, 0], coarser_answer))])
    own_errors, (least_opening, widest) = limit.own(pull_errors).sum(axis=0), last_mesh.least_opening(positions)
    assert isinstance(finer_cut.coarse, TetMesh)
    return CutTruth(
        limit.answer,
        own_errors,
        front_ratio=limit.ratios[0].displacement,
        rim_ratio=limit.ratios[1].displacement,
        least_opening_m=least_opening,
        least_det=last_mesh.problem.least_det(positions),
        least_angle=float(dihedral_angles(finer_cut.coarse).min()),
        nodes=nodes,
        seconds=perf_counter() - begin,
        rejected=rejection(
            (
                own_errors[0] <= MOST_SURFACE and own_errors[1] <= MOST_OPENING,
                f"the meshes are too far apart (own error {own_errors[0]:.1%}, of the opening {own_errors[1]:.1%})",
            ),
            (least_opening >= -CLOSED * widest, f"the lips close (overlap {-1e3 * least_opening:.2g} mm)"),
        ),
    )


WHOLE = 1.0 / 3.0
"""Own error by the size of all elements, over the change from the level before: their error is of order 2."""
