"""Static equilibrium of a body whose surface is grasped at a patch that is moved: nothing slides or lets go."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from palpate.bodies.body import Body
from palpate.bodies.mesh import Mesh, area_normals, corner_normals
from palpate.errors import InputError, NotConverged
from palpate.linalg.minimiser import Solution, descend_or
from palpate.solvers.continuation import steps_to
from palpate.solvers.equilibrium import FastEquilibrium
from palpate.solvers.indentation import Touching, at_depth

ON_PATCH = 1e-9
"""Distance of a node from the patch that it lies on, over the size of its mesh."""
FACING = 0.5
"""Least cosine between the normals of a patch's triangles and of the node in its middle."""
SMALL, RESPONSE = 1e-6, 1e-6
"""Displacement of the patch, over the body's size, by which linear responses are found, and their residual."""


@dataclass(frozen=True, eq=False)
class GraspedPatch:
    """Triangles of a surface that are grasped, with ``corners`` (t, 3, 3) [m] at rest.

    As they are whole, meshes that halve them are grasped at the same area.
    """

    corners: np.ndarray

    @property
    def area_m2(self) -> float:
        """The area at rest [m²]."""
        return float(0.5 * np.linalg.norm(corner_normals(self.corners), axis=1).sum())

    def nodes_of(self, mesh: Mesh) -> np.ndarray:
        """Return the nodes of a mesh that lie on the patch, increasing."""
        middle, tolerance = self.corners.reshape(-1, 3).mean(axis=0), ON_PATCH * mesh.size
        reach = np.linalg.norm(self.corners - middle, axis=2).max() + tolerance
        nodes = mesh.surface[np.linalg.norm(mesh.nodes[mesh.surface] - middle, axis=1) <= reach]
        origins, sides = self.corners[:, 0], np.swapaxes(self.corners[:, 1:] - self.corners[:, :1], 1, 2)
        offsets = mesh.nodes[nodes][:, None] - origins
        # coordinates along two sides of each triangle, moved into it: exact for nodes on it, an upper bound for others
        shares = np.einsum("tab,nta->ntb", np.swapaxes(np.linalg.pinv(sides), 1, 2), offsets)
        shares = np.clip(shares, 0.0, None)
        shares /= np.maximum(shares.sum(axis=2, keepdims=True), 1.0)
        gaps = np.linalg.norm(offsets - np.einsum("tab,ntb->nta", sides, shares), axis=2).min(axis=1, initial=np.inf)
        return nodes[gaps <= tolerance]

    def held_of(self, body: Body) -> Body:
        """Return the body with the patch held beside its anchors, on all levels."""
        patched = (self.nodes_of(mesh) for mesh in body.levels)
        return replace(body, anchors=[np.union1d(*each) for each in zip(body.anchors, patched, strict=True)])


def patch_around(mesh: Mesh, node: int, radius_m: float) -> GraspedPatch:
    """Return the patch of the triangles of ``mesh`` within ``radius_m`` of a surface node, at least those around it.

    Triangles that face another direction are left out, as those on the far side of a thin body.
    """
    corners = mesh.nodes[mesh.triangles]
    within = (np.linalg.norm(corners - mesh.nodes[node], axis=2) <= radius_m).all(axis=1)
    normals = area_normals(mesh.nodes, mesh.triangles)
    facing = normals @ mesh.normals[node] > FACING * np.linalg.norm(normals, axis=1)
    return GraspedPatch(corners[(within & facing) | (mesh.triangles == node).any(axis=1)])


class Grasping(FastEquilibrium):
    """The static problem on one level of a body whose ``patch`` is moved; other arguments as of ``Equilibrium``.

    grasped : the nodes of the patch
    Raises what ``Equilibrium`` does, and NotConverged if no node lies on the patch or one of them is held.
    """

    def __init__(self, body: Body, level: int, order: int, patch: GraspedPatch):
        finest = level + order - 1
        super().__init__(patch.held_of(body), level, order)
        self.patch, self.grasped = patch, patch.nodes_of(self.mesh)
        if not len(self.grasped):
            raise NotConverged(f"no node of level {level} lies on what is grasped", [float("nan")])
        if np.intersect1d(self.grasped, body.supported(finest)).size:
            raise NotConverged("what is grasped is held", [float("nan")])

    def response(self, direction: np.ndarray) -> np.ndarray:
        """Return the linear response (n, 3), per metre, to a displacement of the patch along ``direction``.

        direction : a unit vector (3,), or one for each node of ``grasped``, (k, 3), if parts of the patch move apart
        """
        shift, step = np.zeros_like(self.mesh.nodes), SMALL * self.mesh.size
        shift[self.grasped] = direction
        self.load = np.zeros_like(shift)
        load = (self.force(self.mesh.nodes + step * shift) - self.force(self.mesh.nodes)) / step
        return shift + self.linear_solver(RESPONSE)(load)

    def reaction(self, x: np.ndarray) -> np.ndarray:
        """Return the force (3,) [N] on the patch that holds the body at ``x`` (n, 3) [m]."""
        return -self.free_force(x)[self.grasped].sum(axis=0)

    def push(self, direction: np.ndarray, depths: Sequence[float], tolerance: float) -> Iterator[Touching]:
        """Move the patch along ``direction`` by each depth [m], and yield the equilibrium there.

        direction : as of ``response``; tolerance : of the residual, over the norm of the nodal forces on the patch
        Areas and pressures are NaN: the area is given, and the pressure at its rim is not bounded.
        Raises InputError for a depth that is negative or larger than the body, and NotConverged where no stable
        equilibrium is found, or an element is inverted.
        """
        largest = self.mesh.size
        for depth in depths:
            if not 0.0 <= depth < largest:
                raise InputError(f"a depth is {depth:g} m; give 0 to {largest:.3g} m, the size of the body.")
        x, reached, response = self.mesh.nodes, 0.0, self.response(direction)

        def follow(before: np.ndarray, _: float, step: float) -> np.ndarray:
            return self._balanced(before + step * response, tolerance)

        for depth in depths:
            if depth != reached:
                *_, (reached, x) = steps_to(depth, reached, max(depths), x, follow, at_depth)
            if (det := self.least_det(x)) <= 0.0:
                raise NotConverged(f"an element is inverted {at_depth(depth)}", [det])
            if depth:
                self.check_stable(x)
            yield Touching(depth, x, self.reaction(x), float("nan"), float("nan"), 0.0)

    def _balanced(self, start: np.ndarray, tolerance: float) -> np.ndarray:
        """Return the equilibrium (n, 3) [m] whose patch is where ``start`` (n, 3) [m] has it."""
        scale = float(np.linalg.norm(self.free_force(start)[self.grasped]))

        def newton(begin: np.ndarray) -> Solution:
            return self.balance(begin, scale, tolerance)

        return descend_or(self, self.at_rest(), start, scale, tolerance, newton, patient=True).x
