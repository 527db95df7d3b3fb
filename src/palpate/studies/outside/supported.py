"""Equilibria of quadratic elements with single components of displacement held, as benchmarks ask for."""

from collections.abc import Callable

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from palpate.bodies.material import Material
from palpate.bodies.mesh import TetMesh
from palpate.bodies.refinement import refine
from palpate.bodies.simple_shapes import box
from palpate.bodies.surface_quadrature import surface_interpolation
from palpate.effects.elements import PLAIN_POISSON
from palpate.effects.quadratic_elements import MeanDilatation, QuadraticElements
from palpate.linalg.minimiser import Product, minimise_by_newton
from palpate.solvers.quadratic_motion import mass_matrix

TOLERANCE = 1e-9
"""Residual of an equilibrium over the load."""


class Supported:
    """Quadratic elements on ``mesh`` under nodal forces ``load`` (n, 3) [N], with the components ``held`` (n, 3) bool.

    nodes : (n, 3) [m], those of the mesh and the midpoints of its edges
    """

    def __init__(self, mesh: TetMesh, material: Material, held: Callable[[np.ndarray], np.ndarray]):
        self.mesh, self.nodes = mesh, refine(mesh)[0].nodes
        self.elements = (MeanDilatation if material.poisson > PLAIN_POISSON else QuadraticElements)(mesh, material)
        self.held, self.load = held(self.nodes), np.zeros_like(self.nodes)

    def energy(self, x: np.ndarray) -> float:
        return self.elements.energy(x) - float(np.vdot(self.load, x - self.nodes))

    def force(self, x: np.ndarray) -> np.ndarray:
        return np.where(self.held, 0.0, self.elements.force(x) + self.load)

    def linearise(self, x: np.ndarray, definite: bool) -> tuple[Product, Product]:
        """Return the products with the stiffness of the free components at ``x`` and with its inverse."""
        free = ~self.held.ravel()
        matrix = sparse.csc_array(self.elements.stiffness(x, definite))[free][:, free]
        factor = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})

        def of_free(solve: Callable[[np.ndarray], np.ndarray]) -> Product:
            def product(p: np.ndarray) -> np.ndarray:
                solved = p.copy().ravel()
                solved[free] = solve(solved[free])
                return solved.reshape(p.shape)

            return product

        return of_free(lambda p: matrix @ p), of_free(factor.solve)

    def masses(self) -> sparse.csr_array:
        """Return the consistent masses (n, n) [kg]."""
        return mass_matrix(self.mesh, self.elements.tissue.density_kg_m3 * self.mesh.volumes)

    def settle(self) -> np.ndarray:
        """Return the displacements (n, 3) [m] in equilibrium; raises NotConverged."""
        scale = float(np.linalg.norm(self.load[~self.held]))
        return minimise_by_newton(self, self.nodes, scale, TOLERANCE).x - self.nodes

    def respond(self, moved: np.ndarray | float = 0.0) -> np.ndarray:
        """Return the displacements (n, 3) [m] of linear elasticity with the held components displaced by ``moved``."""
        moved = np.where(self.held, moved, 0.0)
        pull = self.load - (self.elements.stiffness(self.nodes) @ moved.ravel()).reshape(moved.shape)
        return moved + np.where(self.held, 0.0, self.linearise(self.nodes, False)[1](np.where(self.held, 0.0, pull)))

    def press(self, where: Callable[[np.ndarray], np.ndarray], traction: np.ndarray) -> None:
        """Add a ``traction`` (3,) [Pa] on triangles whose corners are all in ``where``, a mask (k,) of nodes (k, 3)."""
        chosen = np.flatnonzero(where(self.mesh.nodes)[self.mesh.triangles].all(axis=1))
        sides = np.diff(self.mesh.nodes[self.mesh.triangles[chosen]], axis=1)
        areas = 0.5 * np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
        # the shape functions of corners have no integral over a triangle, those of midpoints a third of its area each
        for middle in np.array([[0.5, 0.5, 0.0], [0.0, 0.5, 0.5], [0.5, 0.0, 0.5]]):
            weights = surface_interpolation(self.mesh, chosen, np.tile(middle, (len(chosen), 1)), 2)
            self.load += np.outer(weights.T @ (areas / 3.0), traction)


def block(divisions: list[int], place: Callable[[np.ndarray], np.ndarray]) -> TetMesh:
    """Return the mesh of a unit cube of ``divisions`` (3,) cells with its nodes (n, 3) mapped by ``place``."""
    cube = box([1.0, 1.0, 1.0], divisions)
    return TetMesh(place(cube.nodes), cube.tetrahedra)
