"""Find what a cut body truly does when hooks pull its lips apart: quadratic elements on meshes that conform to the cut.

Elements are halved at the front of the cut, where stresses are infinite, and, apart from that, at the rim of what is
held or grasped, on three meshes each; each is carried to its limit as for a touch (``touch_truth``). What halving one
changes of the other, and what the same meshes say that are made of the body's level before, count as errors, too. The
lips are free: a pull that closes them has no truth here.
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
from palpate.solvers.grasping import Grasping, Patch

AROUND = 1.6
"""Edges of the front within which elements are halved at it."""
TOLERANCE = 1e-6
"""Residual over the forces of the hooks."""
CLOSED = 1e-3
"""Overlap of the lips over their largest opening, above which they are said to close."""
MOST_SURFACE, MOST_OPENING = 0.005, 0.03
"""Own errors over the surface and in the opening above which a cut judges no model."""
BESIDE = 0.5
"""Size of a triangle over which a place of the mouth may be off the lips."""
PLACES = 9
"""Places along a path where the opening is told."""


class Hook(NamedTuple):
    """A patch of the skin that is grasped, and the way that it is moved (3,) [m]."""

    patch: Patch
    shift_m: np.ndarray


class Pulled(NamedTuple):
    """What hooks do to a cut body: an answer of a model or of one mesh.

    displacement : (n, 3) [m] of the fine surface nodes of the whole body; of two lips' at one place, the positive one's
    opening : (k, 3) [m], how far the positive lip has moved from the negative one at the places along the cut
    force : (h,) [N] of each hook on the body, along its way
    """

    displacement: np.ndarray
    opening: np.ndarray
    force: np.ndarray


@dataclass(frozen=True, eq=False)
class CutTruth:
    """The truth of one cut and pull.

    pulled : the limit; own : (3,) what it may be off, as ``pull_errors`` measures it
    front_ratio, rim_ratio : by how much the second halving, at the front or at the rims, has changed the surface less
        than the first; NaN where nothing changes
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
    away = np.linalg.norm(answer.displacement - truth.displacement, axis=1)
    peak = np.linalg.norm(truth.displacement, axis=1).max()
    wide = np.linalg.norm(truth.opening, axis=1).max(initial=0.0)
    opening = np.linalg.norm(answer.opening - truth.opening, axis=1).max(initial=0.0)
    force = np.abs(answer.force - truth.force).max() / np.abs(truth.force).max()
    return float(np.sqrt(np.mean(away**2)) / peak), float(opening / wide) if wide else 0.0, float(force)


def mouth(mesh: Mesh, cut: Cut) -> np.ndarray:
    """Return PLACES points (k, 3) [m] of the skin along a blade's path, evenly between its ends; none of another cut.

    mesh : of the whole body. Each is where a line along the blade meets the skin nearest to the path, if cut there
    """
    if not isinstance(cut, Blade):
        return np.empty((0, 3))
    along = np.linspace(0.0, min(cut.length_m, cut.reached_m), PLACES + 2)[1:-1]
    a, b, c = (mesh.nodes[mesh.triangles[:, i]] for i in range(3))
    normals, found = area_normals(mesh.nodes, mesh.triangles), []
    for point in cut.at(along, np.zeros(PLACES)):
        steep = normals @ cut.direction
        away = np.divide(((a - point) * normals).sum(axis=1), steep, out=np.full(len(a), np.inf), where=steep != 0.0)
        at = point + np.where(np.isfinite(away), away, 0.0)[:, None] * cut.direction
        sides = [(np.cross(q - p, at - p) * normals).sum(axis=1) for p, q in ((a, b), (b, c), (c, a))]
        hit = (np.min(sides, axis=0) >= -1e-9 * (normals**2).sum(axis=1)) & (cut.within(at) > 0.0)
        if hit.any():
            found.append(at[hit][np.abs(away[hit]).argmin()])
    return np.array(found).reshape(-1, 3)


def skin_map(
    mesh: Mesh, side: np.ndarray, points: np.ndarray, sign: float | np.ndarray, degree: int = 2, beside: float = 0.0
) -> sparse.csr_array:
    """Return the interpolation (k, n) to ``points`` (k, 3) [m] of the skin; quadratic, n counts nodes and edges.

    side : (t,) of each triangle of ``mesh``: its sign says on which side of the cut it lies, NaN that it is no skin
    sign : of the side that is taken where a point lies on both, or one for each point
    beside : how far from a triangle of that side, over its size, a point may lie to be taken as one of it
    """
    skin = np.flatnonzero(~np.isnan(side))
    corners = mesh.nodes[mesh.triangles[skin]]
    middles = corners.mean(axis=1)
    reach = np.linalg.norm(corners - middles[:, None], axis=2).max(axis=1)
    tree, chosen, places = cKDTree(middles), [], []
    for point, own in zip(points, np.broadcast_to(sign, len(points)), strict=True):
        near = np.array(tree.query_ball_point(point, reach.max()))
        near = near[np.linalg.norm(middles[near] - point, axis=1) <= reach[near] * (1.0 + 1e-9 + beside)]
        first, sides = corners[near, 0], np.swapaxes(corners[near, 1:] - corners[near, :1], 1, 2)
        share = np.einsum("tab,tb->ta", np.linalg.pinv(sides), point - first)
        off = np.linalg.norm(point - first - np.einsum("tab,tb->ta", sides, share), axis=1)
        outside = -np.minimum(share.min(axis=1), 1.0 - share.sum(axis=1))
        away, other = np.maximum(outside, off / reach[near]), np.sign(side[skin[near]]) != own
        fits = away <= 1e-6
        if not fits.any():
            raise InputError("a point is not on the skin of the cut mesh; give the body that was cut.")
        order = np.lexsort((away, other, ~(fits | (away <= beside) & ~other)))
        chosen.append(skin[near[order[0]]])
        places.append([1.0 - share[order[0]].sum(), *share[order[0]]])
    return surface_interpolation(mesh, np.array(chosen, dtype=int), np.array(places).reshape(-1, 3), degree)


def halved(cut: CutBody, front: int, rim: int = 0) -> Body:
    """Return a cut body with levels on which elements are halved at its front and at the rim of what is held.

    front, rim : how often. The last level has the nodes of quadratic elements on the one before
    """
    depth, ends = max(front, rim), cut.coarse.nodes[cut.front]
    if not depth:
        return with_midpoints(cut, 0)
    longest = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).max(initial=0.0)
    radii = np.where(np.arange(depth) < front, AROUND * longest / 2.0 ** np.arange(depth), -1.0)
    share = np.linspace(0.0, 1.0, 1 + 2**front)[:, None]
    # without a front no place is halved, and any point will do
    near = (ends[:, :1] + share * (ends[:, 1:] - ends[:, :1])).reshape(-1, 3) if len(ends) else cut.coarse.nodes[:1]
    radii = radii if len(ends) else np.full(depth, -1.0)
    return with_midpoints(LocalRefinement(cut, depth).around(near, radii.tolist(), rim), depth)


def lips_of(cut: CutBody, body: Body, side: int) -> np.ndarray:
    """Return the triangles (t, 3) that a lip consists of on the last level of ``body``, which ``halved`` has made."""
    triangles = body.fine.triangles
    return triangles[_among(coarse_triangles(body.prolongation, triangles), cut.lips[:, side])]


def pulled(problem: Grasping, hooks: Sequence[Hook]) -> np.ndarray:
    """Return the positions (n, 3) [m] when hooks are where they go; errors as ``Grasping.push``."""
    ways, largest = np.zeros_like(problem.mesh.nodes), max(float(np.linalg.norm(h.shift_m)) for h in hooks)
    for hook in hooks:
        ways[hook.patch.nodes_of(problem.mesh)] = hook.shift_m / largest
    (state,) = problem.push(ways[problem.grasped], [largest], TOLERANCE)
    return state.x


def forces_on(problem: Grasping, hooks: Sequence[Hook], x: np.ndarray) -> np.ndarray:
    """Return the force [N] of each hook on the body at ``x`` (n, 3) [m], along its way."""
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
        patch = Patch(np.concatenate([hook.patch.corners for hook in hooks]))
        free = [np.setdiff1d(each, patch.nodes_of(mesh)) for each, mesh in zip(body.anchors, body.levels, strict=True)]
        self.problem = Grasping(replace(body, anchors=free), depth, 2, patch)
        self._mesh, self._body = body.levels[depth], body

    def pull(self) -> np.ndarray:
        """Return the positions (n, 3) [m] of nodes and edge midpoints when the hooks are where they go.

        Raises NotConverged where no stable equilibrium is found, or an element is inverted.
        """
        return pulled(self.problem, self._hooks)

    def answer(self, x: np.ndarray, surface: np.ndarray, places: np.ndarray) -> Pulled:
        """Return the answer at positions ``x``; surface, places : points (n, 3), (k, 3) [m] of skin and mouth."""
        moved, side = x - self.problem.mesh.nodes, self._side_of_skin()
        assert self._cut.cut is not None
        # the mesh may have bent the cut to a place beside it, which is then on both lips
        own = np.where(self._cut.cut.across(surface) >= 0.0, 1.0, -1.0)
        displacement = skin_map(self._mesh, side, surface, own) @ moved
        # where the cut crosses an edge of the skin the lips end beside it, and the place is on one of them
        first, second = (skin_map(self._mesh, side, places, sign, beside=BESIDE) @ moved for sign in (1.0, -1.0))
        return Pulled(displacement, first - second, forces_on(self.problem, self._hooks, x))

    def least_opening(self, x: np.ndarray) -> tuple[float, float]:
        """Return the least and the largest distance [m] of the lips' nodes along the normal of the cut."""
        sides, rest = [lips_of(self._cut, self._body, side) for side in (0, 1)], self.problem.mesh.nodes
        # the lips are halved apart, so that a node of one may have none opposite
        first, second = map(np.unique, sides)
        keys, others = (np.ascontiguousarray(rest[each] + 0.0).view("V24").ravel() for each in (first, second))
        _, one, other = np.intersect1d(keys, others, return_indices=True)
        first, second = first[one], second[other]
        normals = np.zeros_like(rest)
        for corner in range(3):
            np.add.at(normals, sides[0][:, corner], area_normals(rest, sides[0]))
        wide = -((x[first] - x[second]) * unit(normals[first])).sum(axis=1)
        return float(wide.min(initial=0.0)), float(wide.max(initial=0.0))

    def _side_of_skin(self) -> np.ndarray:
        """Return how far across the cut each triangle of the mesh lies (t,) [m], NaN on the lips."""
        triangles = self._mesh.triangles
        coarse = coarse_triangles(self._body.up_to(len(self._body.levels) - 2).prolongation, triangles)
        assert self._cut.cut is not None
        side = self._cut.cut.across(self._mesh.nodes[triangles].mean(axis=1))
        side[_among(coarse, self._cut.lips.reshape(-1, 3))] = np.nan
        return side


def _grasped(cut: CutBody, patch: Patch) -> np.ndarray:
    """Return the nodes of a cut mesh that a hook grasps, increasing; InputError where it may not."""
    mesh, nodes = cut.coarse, patch.nodes_of(cut.coarse)
    held = Patch(mesh.nodes[mesh.triangles[np.isin(mesh.triangles, nodes).all(axis=1)]])
    if np.isin(nodes, cut.lips).any() or abs(held.area_m2 - patch.area_m2) > 1e-6 * patch.area_m2:
        raise InputError(f"{cut.name}: a hook is so near the cut that the mesh there is not the body's; move it away.")
    if np.isin(nodes, cut.anchors[0]).any():
        raise InputError(f"{cut.name}: a hook grasps what is held; move it away.")
    return nodes


def _among(triangles: np.ndarray, of: np.ndarray) -> np.ndarray:
    """Return which of ``triangles`` (t, 3) have the nodes of any of another list (k, 3), (t,) bool."""
    known = set(map(tuple, np.sort(of, axis=1).tolist()))
    return np.array([tuple(each) in known for each in np.sort(triangles, axis=1).tolist()], dtype=bool)


def with_patches(body: Body, hooks: Sequence[Hook], level: int) -> Body:
    """Return a ``level`` of the body as the last one, with the finest one's triangles where hooks grasp."""
    if not (depth := len(body.levels) - 1 - level):
        return body
    corners = np.concatenate([hook.patch.corners for hook in hooks])
    reach = float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max())
    radii = (reach * 2.0 ** np.arange(depth)[::-1]).tolist()
    return LocalRefinement(body.from_level(level), depth).around(corners.reshape(-1, 3), radii)


def truth_of_cut(
    body: Body, cut: Cut, hooks: Sequence[Hook], edge_m: float, front_m: float, places: np.ndarray | None = None
) -> CutTruth:
    """Find the truth of a cut body whose lips are pulled.

    edge_m, front_m : as of ``cut_body``, on the mesh that is halved
    places : (k, 3) [m] of the mouth where the opening is asked, by default ``mouth``
    """
    begin, surface = perf_counter(), body.fine.nodes[body.fine.surface]
    places = mouth(body.fine, cut) if places is None else places
    coarser = cut_body(with_patches(body, hooks, len(body.levels) - 2), cut, edge_m, front_m)
    base = cut_body(body, cut, edge_m, front_m)
    first = CutMesh(coarser, hooks, 0, 0)
    before, answers, nodes = first.answer(first.pull(), surface, places), {}, 0
    for front, rim in CROSS:
        mesh = CutMesh(base, hooks, front, rim)
        x = mesh.pull()
        answers[front, rim] = mesh.answer(x, surface, places)
        nodes = max(nodes, len(x))
    limit = limit_over(answers, (1, 1), (None, None))
    limit.off.append([combined((WHOLE, -WHOLE), (answers[0, 0], before))])
    own, (least, widest) = limit.own(pull_errors).sum(axis=0), mesh.least_opening(x)
    assert isinstance(base.coarse, TetMesh)
    return CutTruth(
        limit.answer,
        own,
        front_ratio=limit.ratios[0].displacement,
        rim_ratio=limit.ratios[1].displacement,
        least_opening_m=least,
        least_det=mesh.problem.least_det(x),
        least_angle=float(dihedral_angles(base.coarse).min()),
        nodes=nodes,
        seconds=perf_counter() - begin,
        rejected=rejection(
            (
                own[0] <= MOST_SURFACE and own[1] <= MOST_OPENING,
                f"the meshes are too far apart (own error {own[0]:.1%}, of the opening {own[1]:.1%})",
            ),
            (least >= -CLOSED * widest, f"the lips close (overlap {-1e3 * least:.2g} mm)"),
        ),
    )


WHOLE = 1.0 / 3.0
"""Part of the change from the level before that all elements together may be off by: of order 2, their errors are."""
