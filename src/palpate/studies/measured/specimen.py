"""Models of a measured body: loads on its surface, masses, markers, and equilibria of elements and of springs."""

from collections.abc import Sequence
from typing import cast

import numpy as np
from scipy import sparse

from palpate.bodies.body import Body
from palpate.bodies.mesh import Mesh, TetMesh
from palpate.bodies.particles import particles_of
from palpate.bodies.surface_quadrature import ball_points, near_ball, surface_interpolation
from palpate.collision.triangles.closest_points import POINT_TRIANGLE, closest_points
from palpate.effects.elements import locking_is_measured
from palpate.effects.springs import make as make_springs
from palpate.linalg.block_pattern import product
from palpate.linalg.minimiser import Product, minimise_by_newton
from palpate.linalg.multigrid import Factor
from palpate.linalg.polar import nearest_rotation
from palpate.models.springs.mass_spring import LoadedSprings
from palpate.solvers import quadratic_motion
from palpate.solvers.equilibrium import Equilibrium
from palpate.studies.measured.settings import Load


def rest_of(mesh: Mesh, order: int) -> np.ndarray:
    """Return the positions (n, 3) [m] of the nodes of elements of ``order``: corners, and for 2 middles of edges."""
    return mesh.nodes if order == 1 else np.vstack([mesh.nodes, mesh.nodes[mesh.edges].mean(axis=1)])


def nearest_points(mesh: Mesh, points: np.ndarray, order: int) -> sparse.csr_array:
    """Return the interpolation (k, n) from nodes of elements of ``order`` to the surface points nearest to ``points``.

    points : (k, 3) [m], at rest
    """
    corners = mesh.nodes[mesh.triangles]
    middles = corners.mean(axis=1)
    reach = np.linalg.norm(corners - middles[:, None], axis=2).max(axis=1)  # of a triangle from its middle
    triangles, weights = np.empty(len(points), dtype=np.int64), np.empty((len(points), 3))
    for i, point in enumerate(points):
        distances = np.linalg.norm(middles - point, axis=1)
        near = np.flatnonzero(distances - reach <= (distances + reach).min())  # no other can be nearest
        x = np.vstack([point, corners[near].reshape(-1, 3)])
        stencils = np.column_stack([np.zeros(len(near), dtype=np.int64), 1 + np.arange(3 * len(near)).reshape(-1, 3)])
        distance, coordinates, _ = closest_points(np.full(len(near), POINT_TRIANGLE), stencils, x)
        best = int(np.argmin(distance))
        triangles[i], weights[i] = near[best], -coordinates[best, 1:]  # of point less place
    return surface_interpolation(mesh, triangles, weights, order)


def disc_points(mesh: Mesh, center: np.ndarray, radius: float, order: int) -> tuple[sparse.csr_array, np.ndarray]:
    """Return a quadrature of the surface within ``radius`` [m] of ``center``: interpolation (k, n), weights (k,) [m²].

    The interpolation is from the n nodes to the k points. The weights integrate polynomials of degree 4 exactly over
    that part of the surface; single ones may be negative.
    """
    corners = mesh.nodes[mesh.triangles]
    touched = np.flatnonzero(near_ball(corners, center, radius))
    barycentric, weights, _ = ball_points(corners[touched], center, radius, 4)
    used = weights != 0.0
    return surface_interpolation(mesh, np.repeat(touched, used.sum(axis=1)), barycentric[used], order), weights[used]


def mass_matrix(mesh: TetMesh, density_kg_m3: np.ndarray, order: int) -> sparse.csr_array:
    """Compute the consistent masses (n, n) [kg] of elements of ``order`` with densities (n_elements,) [kg/m³]."""
    element_masses = density_kg_m3 * mesh.volumes
    if order == 2:
        return quadratic_motion.mass_matrix(mesh, element_masses)
    values = np.outer(element_masses, (np.ones((4, 4)) + np.eye(4)) / 20.0)
    rows, columns = np.repeat(mesh.tetrahedra, 4, axis=1).ravel(), np.tile(mesh.tetrahedra, (1, 4)).ravel()
    return sparse.coo_array((values.ravel(), (rows, columns)), shape=2 * (len(mesh.nodes),)).tocsr()


POINTS = 240
"""Points of a line over which a force is distributed evenly; a multiple of the divisions of most meshes."""


def nodal_loads(mesh: Mesh, loads: Sequence[Load], down: np.ndarray, order: int) -> np.ndarray:
    """Return the forces (n, 3) [N] of ``loads`` on nodes of elements of ``order``; gravity is along ``down`` (3,)."""
    total = np.zeros_like(rest_of(mesh, order))
    for load in loads:
        interpolation, shares = _load_points(mesh, load, order)
        force = np.array(load.force_n, dtype=float) if load.weight_n is None else load.weight_n * down
        total += np.outer(interpolation.T @ shares, force)
    return total


GRAVITY_M_S2 = 9.81


def hung_masses(mesh: Mesh, loads: Sequence[Load], gravity_m_s2: float, order: int) -> sparse.csr_array:
    """Return the consistent masses (n, n) [kg] of what hangs on the surface and moves with it; forces have no mass."""
    count = len(rest_of(mesh, order))
    total = sparse.csr_array((count, count))
    for load in loads:
        if load.weight_n is not None:
            at_points, shares = _load_points(mesh, load, order)
            total = total + at_points.T @ sparse.diags_array(load.weight_n / gravity_m_s2 * shares) @ at_points
    return total.tocsr()


def _load_points(mesh: Mesh, load: Load, order: int) -> tuple[sparse.csr_array, np.ndarray]:
    """Return the interpolation (k, n) from nodes to points that carry a load, and the fraction (k,) of it at each."""
    if load.line_m is not None:
        start, end = np.array(load.line_m, dtype=float)
        points = start + (np.arange(POINTS)[:, None] + 0.5) / POINTS * (end - start)
        return nearest_points(mesh, points, order), np.full(POINTS, 1.0 / POINTS)
    center = nearest_points(mesh, np.array([load.at_m], dtype=float), order)
    if load.radius_m == 0.0:
        return center, np.ones(1)
    interpolation, areas = disc_points(mesh, (center @ rest_of(mesh, order))[0], load.radius_m, order)
    return interpolation, areas / areas.sum()


LEAST_RADIUS = 0.02
"""Least radius of the surface patch that carries a marker, over the body's size: for markers on the surface itself."""


class Carried:
    """Markers at ``places`` (m, 3) [m] at rest that move with the surface of elements of ``order`` on ``mesh``.

    A marker moves by the rigid motion that fits best to the surface patch around its nearest point; the radius of the
    patch is the marker's distance from the surface. Trap: with the displacement of the nearest point alone, a marker
    6 mm off a bending beam of 100 mm misses a third of its motion along the beam.
    """

    def __init__(self, mesh: Mesh, places: np.ndarray, order: int):
        rest = rest_of(mesh, order)
        self._places = places
        self._patches = [self._patch(mesh, rest, place, order) for place in self._places]

    @staticmethod
    def _patch(mesh: Mesh, rest: np.ndarray, place: np.ndarray, order: int) -> tuple:
        """Return the points of a patch: interpolation (k, n), weights (k,), offsets (k, 3) from the mean, and this."""
        foot = (nearest_points(mesh, place[None], order) @ rest)[0]
        radius = max(float(np.linalg.norm(place - foot)), LEAST_RADIUS * mesh.size)
        interpolation, areas = disc_points(mesh, foot, radius, order)
        weights, points = areas / areas.sum(), interpolation @ rest
        mean = weights @ points
        return interpolation, weights, points - mean, mean

    def of(self, x: np.ndarray) -> np.ndarray:
        """Return the positions (m, 3) [m] of the markers where the nodes are at ``x`` (n, 3) [m]."""
        positions = np.empty_like(self._places)
        for i, (interpolation, weights, offsets, mean) in enumerate(self._patches):
            points = interpolation @ x
            mean_now = weights @ points
            rotation = nearest_rotation((points - mean_now).T @ (weights[:, None] * offsets))
            positions[i] = mean_now + rotation @ (self._places[i] - mean)
        return positions


TOLERANCE = 1e-5
"""Relative residual of equilibria, far below the differences between repeats."""


class FemSpecimen:
    """A body as finite elements of ``order`` on one of its levels.

    rest : (n, 3) [m]; held : (k,) nodes; masses : (n, n) [kg]; mesh : that of the level, without middles of edges
    linearise : returns the products with the stiffness [N/m] at positions, and with a preconditioner for it
    """

    def __init__(self, body: Body, level: int, order: int):
        with locking_is_measured():
            self._equilibrium = Equilibrium(body, level, order)
        self.rest, self.held = self._equilibrium.mesh.nodes, body.anchors[level + order - 1]
        self.linearise = self._equilibrium.linearise
        self.mesh = cast(TetMesh, body.levels[level])
        self.order = order
        self.masses = mass_matrix(self.mesh, body.tissue(level).density_kg_m3, order)

    def settle(self, load: np.ndarray, start: np.ndarray | None) -> np.ndarray:
        """Return the equilibrium (n, 3) [m] under ``load`` (n, 3) [N], sought from ``start``; NotConverged if none."""
        return self._equilibrium.solve(load, TOLERANCE, start).x


class SpringSpecimen(LoadedSprings):
    """A body as springs on the edges of a level's tetrahedra, of its modulus (paper 2, eq. 5), and lumped masses."""

    def __init__(self, body: Body, level: int):
        super().__init__(particles_of(body, level, surface=False))
        self.held = self.particles.held
        self.mesh: Mesh = body.levels[level]
        self.order = 1
        self.masses = sparse.diags_array(self.particles.masses).tocsr()
        self.act(make_springs(self.particles, None))
        self._factor = Factor(self.stiffness(self.rest, definite=True))

    def settle(self, load: np.ndarray, start: np.ndarray | None) -> np.ndarray:
        self.load(load)
        scale = float(np.linalg.norm(self._load))
        return minimise_by_newton(self, self.rest if start is None else start, scale, TOLERANCE).x

    def linearise(self, x: np.ndarray, definite: bool = False) -> tuple[Product, Product]:
        return product(self.stiffness(x, definite)), self._factor.solve


Specimen = FemSpecimen | SpringSpecimen


class Bench:
    """A specimen with markers at ``places`` (m, 3) [m] at rest, under gravity and loads."""

    def __init__(self, specimen: Specimen, places: Sequence[Sequence[float]]):
        self.specimen = specimen
        self._carried = Carried(specimen.mesh, np.array(places, dtype=float), specimen.order)
        self._at_rest = self._carried.of(specimen.rest)
        self._own = specimen.masses.sum(axis=1)

    def load(self, loads: Sequence[Load], down: np.ndarray) -> np.ndarray:
        """Return the forces (n, 3) [N] of gravity along ``down`` (3,) and of ``loads``."""
        weight = GRAVITY_M_S2 * np.outer(self._own, down)
        return weight + nodal_loads(self.specimen.mesh, loads, down, self.specimen.order)

    def masses(self, loads: Sequence[Load]) -> sparse.csr_array:
        """Return the mass matrix (n, n) [kg] of the body and of what hangs on it."""
        hung = hung_masses(self.specimen.mesh, loads, GRAVITY_M_S2, self.specimen.order)
        return (self.specimen.masses + hung).tocsr()

    def moves(self, x: np.ndarray) -> np.ndarray:
        """Return the markers' moves (m, 3) [m] from rest to where the nodes are at ``x`` (n, 3) [m]."""
        return self._carried.of(x) - self._at_rest
