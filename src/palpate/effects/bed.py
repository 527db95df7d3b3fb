"""Elastic beds: springs under a part of a body's surface, integrated with the element's own shape functions."""

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from scipy import sparse

from palpate.bodies.mesh import Mesh
from palpate.bodies.particles import Particles
from palpate.bodies.supports import Bed
from palpate.bodies.surface_quadrature import ball_points, midpoints, near_ball, triangle_shapes
from palpate.effects.effect import Effect, Energy, Stiffness


def make(particles: Particles, settings: object, elastic: Effect | None = None) -> "BedSprings":
    """Make the springs of all beds of ``particles``."""
    return BedSprings(particles, particles.beds)


class BedSprings(Energy, Stiffness):
    """Springs with E = ∫ ½ k u² over the surface in a bed's sphere, k = stiffness_n_m3 · (1 − (distance/radius)²)².

    u is the displacement, and the region is that of the rest shape, so that the stiffness is constant. k falls smoothly
    to zero at the sphere, so that stress is not singular there, as it is at the edge of held nodes; the bed ends
    sharply where it is limited to triangles that face one direction and the surface turns away. The integral is exact,
    for linear shape functions or, for ``order`` 2, quadratic ones, whose nodes are the mesh's, then its edge midpoints.

    beds : one, or several of bodies in one mesh, each with the triangles (m, 3) that it may support
    couples : (m, k) the nodes of each triangle; rest : (n, 3) [m]
    scalar : (n, n) [N/m], the stiffness, which is the same along x, y and z
    """

    def __init__(self, mesh: Mesh, beds: Bed | Sequence[tuple[Bed, np.ndarray]], order: int = 1):
        supports = [(beds, mesh.triangles)] if isinstance(beds, Bed) else beds
        elements = [_elements(mesh, bed, triangles, order) for bed, triangles in supports]
        self.couples = np.concatenate([couples for couples, _ in elements])
        self._blocks = np.concatenate([blocks for _, blocks in elements])
        count = len(mesh.nodes) + (len(mesh.edges) if order == 2 else 0)
        self.rest = mesh.nodes if order == 1 else np.vstack([mesh.nodes, mesh.nodes[mesh.edges].mean(axis=1)])
        rows = np.repeat(self.couples, self.couples.shape[1], axis=1).ravel()
        columns = np.tile(self.couples, (1, self.couples.shape[1])).ravel()
        self.scalar = sparse.coo_array((self._blocks.ravel(), (rows, columns)), shape=(count, count)).tocsr()

    @cached_property
    def matrix(self) -> sparse.bsr_array:
        """The stiffness (3n, 3n) [N/m] in 3 × 3 blocks."""
        return sparse.bsr_array(sparse.kron(self.scalar, np.eye(3), format="bsr"))

    @cached_property
    def roots(self) -> np.ndarray:
        """Rows r of each triangle (m, k, k) [√(N/m)] such that its energy is ½ Σ |r u|², with u (k, 3) of its nodes."""
        values, vectors = np.linalg.eigh(self._blocks)
        # rounding makes an eigenvalue of 0 slightly negative
        return np.sqrt(np.maximum(values, 0.0))[:, :, None] * vectors.transpose(0, 2, 1)

    @cached_property
    def lumped(self) -> np.ndarray:
        """The stiffness of each node (n,) [N/m] that resists a displacement of the whole body as the springs do."""
        return np.asarray(self.scalar.sum(axis=1)).ravel()

    def energy(self, x: np.ndarray) -> float:
        moved = x - self.rest
        return 0.5 * float(np.vdot(moved, self.scalar @ moved))

    def add_force(self, x: np.ndarray, v: np.ndarray | None, force: np.ndarray) -> None:
        force -= self.scalar @ (x - self.rest)

    def add_stiffness(self, x: np.ndarray, definite: bool, slots: np.ndarray, values: np.ndarray) -> None:
        """Add the constant stiffness to ``values`` (n_blocks, 3, 3) [N/m]; it is positive semidefinite."""
        for axis in range(3):
            np.add.at(values[:, axis, axis], slots.ravel(), self._blocks.ravel())


def _elements(mesh: Mesh, bed: Bed, triangles: np.ndarray, order: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the nodes (m, k) of the triangles that may meet the bed, and ∫ k Nᵢ Nⱼ (m, k, k) [N/m] of each."""
    triangles = triangles[bed.faces(mesh.nodes, triangles)]
    corners = mesh.nodes[triangles]
    touched = near_ball(corners, bed.center_m, bed.radius_m)
    triangles = triangles[touched]
    barycentric, weights, distance = ball_points(corners[touched], bed.center_m, bed.radius_m, 4 + 2 * order)
    shapes = triangle_shapes(barycentric, order)
    stiffness = bed.stiffness_n_m3 * weights * (1.0 - distance) ** 2
    couples = triangles if order == 1 else np.hstack([triangles, midpoints(mesh, triangles)])
    return couples, np.einsum("mk,mka,mkb->mab", stiffness, shapes, shapes)
