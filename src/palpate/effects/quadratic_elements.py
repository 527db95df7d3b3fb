"""Elasticity of ten-node tetrahedra with straight sides, plain or with mean dilatation, which does not lock.

Kernels work on batches of BATCH elements; arrays of a batch end in an axis of its elements, so that inner loops run
over elements and are vectorised. Point q of element e stands in column q BATCH + e of a block of deformation gradients.
``slopes`` (4, 10, 3) are the derivatives of the shape functions at the points with respect to the barycentric
coordinates of the second to fourth corner, ``gradients`` (n_elements, 4, 3) those of these coordinates [1/m].
``mu, lam`` (n_elements,) are moduli [Pa]; ``shape, measure, volume`` the functions of the law, None for the
corotational one, which is compiled without a branch for others; ``group`` is N_POINTS for mean dilatation, else 1.
"""

from collections.abc import Callable

import numba
import numpy as np

from palpate.bodies.material import Material, Tissue
from palpate.bodies.mesh import Mesh
from palpate.bodies.refinement import QUADRATURE_POINTS, quadratic_gradients, ten_nodes
from palpate.effects import principal
from palpate.effects.corotational import ARITHMETIC, BLOCK, hessians, stresses
from palpate.effects.elements import Elements
from palpate.effects.law import law_of
from palpate.effects.principal import PAIRS, add_blocks
from palpate.linalg.block_pattern import product

N_POINTS = 4
BATCH = BLOCK // N_POINTS
_BY_ALL_FOUR = quadratic_gradients(QUADRATURE_POINTS)
SLOPES = np.ascontiguousarray(_BY_ALL_FOUR[:, :, 1:] - _BY_ALL_FOUR[:, :, :1])
"""Derivatives (4, 10, 3) of the shape functions at the points, as of ``Elements``: the first coordinate is 1 minus the
others."""


@numba.njit(cache=True, error_model="numpy")
def energy_and_force(x, ten, slopes, gradients, volumes, mu, lam, group, shape, measure, volume, force):
    """Add forces [N] of elements with nodes ``ten`` (m, 10) to ``force`` (n_nodes, 3), and return their energy [J]."""
    places, pulls, g, shares = np.empty((30, BATCH)), np.empty((9, BATCH)), np.empty((9, BLOCK)), np.empty((3, BLOCK))
    f, p = np.empty((9, BLOCK)), np.empty((9, BLOCK))
    energies, accepted = np.empty(BLOCK), np.empty(BLOCK, dtype=np.bool_)
    total = 0.0
    for begin in range(0, len(ten), BATCH):
        count = min(BATCH, len(ten) - begin)
        gather(x, ten, gradients, volumes, mu, lam, begin, count, places, g, shares)
        deformation_gradients(places, slopes, g, pulls, f)
        if shape is None:
            stresses(f, p, f.shape[1], shares[1], shares[2], energies, accepted)
        else:
            principal.stresses(f, p, f.shape[1], group, shares[1], shares[2], shape, measure, volume, energies)
        forces(p, slopes, g, shares[0], pulls, places)
        for e in range(count):
            for q in range(N_POINTS):
                total += shares[0, q * BATCH + e] * energies[q * BATCH + e]
            for a in range(10):
                for i in range(3):
                    force[ten[begin + e, a], i] -= places[3 * a + i, e]
    return total


@numba.njit(cache=True, error_model="numpy")
def add_stiffness(x, ten, slopes, gradients, volumes, mu, lam, group, shape, measure, volume, definite, slots, values):
    """Add the Hessian's blocks [N/m] to ``values`` (n_blocks, 3, 3), those of element e at ``slots[e]`` (10, 10).

    With mean dilatation an element's Hessian is that of its points at a constant pressure U′, and U″ V r rᵀ, r the
    derivative of its mean θ by its positions, over which it is written in ``places``.
    """
    places, stretched = np.empty((30, BATCH)), np.empty((9, BATCH))
    g, shares = np.empty((9, BLOCK)), np.empty((3, BLOCK))
    f, rotated, blocks = np.empty((9, BLOCK)), np.empty((15, BLOCK)), np.empty((54, BLOCK))
    half, hessian = np.empty((N_POINTS, 3, 9, BATCH)), np.empty((9, BATCH))
    pulls, stiffnesses = np.empty((9, BLOCK)), np.empty(BLOCK)
    for begin in range(0, len(ten), BATCH):
        count = min(BATCH, len(ten) - begin)
        gather(x, ten, gradients, volumes, mu, lam, begin, count, places, g, shares)
        deformation_gradients(places, slopes, g, stretched, f)
        point_hessians(f, g, shares, group, shape, measure, volume, definite, rotated, blocks, pulls, stiffnesses)
        if group > 1:
            forces(pulls, slopes, g, shares[0], stretched, places)
            for e in range(count):
                stiffnesses[e] /= volumes[begin + e]
        for a in range(10):
            half_product(blocks, slopes, a, half)
            for b in range(a, 10):
                whole_product(half, slopes, b, hessian)
                if group > 1:
                    for i in range(3):
                        for j in range(3):
                            for e in range(count):
                                hessian[3 * i + j, e] += stiffnesses[e] * places[3 * a + i, e] * places[3 * b + j, e]
                add_blocks(hessian, slots, begin, count, a, b, values)


@numba.njit(cache=True, error_model="numpy")
def point_hessians(f, g, shares, group, shape, measure, volume, definite, rotated, blocks, pulls, stiffnesses):
    """Write the Hessians with respect to F at a batch's points into ``blocks`` (54, BLOCK), as ``principal`` does."""
    if shape is None:
        hessians(f, g, shares[0], f.shape[1], shares[1], shares[2], definite, rotated, blocks)
    else:
        moduli, law = (shares[1], shares[2]), (shape, measure, volume)
        principal.hessians(f, g, shares[0], f.shape[1], group, *moduli, *law, definite, blocks, pulls, stiffnesses)


@numba.njit(cache=True, error_model="numpy")
def write_tangents(x, ten, slopes, gradients, volumes, mu, lam, group, shape, measure, volume, definite, tangents):
    """Write the Hessians with respect to F at all points into ``tangents`` (m, 54, BLOCK), one block for each batch."""
    places, stretched = np.empty((30, BATCH)), np.empty((9, BATCH))
    g, shares = np.empty((9, BLOCK)), np.empty((3, BLOCK))
    f, rotated = np.empty((9, BLOCK)), np.empty((15, BLOCK))
    pulls, stiffnesses = np.empty((9, BLOCK)), np.empty(BLOCK)
    for number in range(len(tangents)):
        begin = number * BATCH
        count = min(BATCH, len(ten) - begin)
        gather(x, ten, gradients, volumes, mu, lam, begin, count, places, g, shares)
        deformation_gradients(places, slopes, g, stretched, f)
        blocks = tangents[number]
        point_hessians(f, g, shares, group, shape, measure, volume, definite, rotated, blocks, pulls, stiffnesses)


@numba.njit(cache=True, error_model="numpy")
def add_product(u, ten, slopes, tangents, product):
    """Add the Hessian's product with ``u`` (n, 3) [m] to ``product`` (n, 3) [N], from ``tangents``."""
    moved, forces = np.empty((30, BATCH)), np.empty((30, BATCH))
    stretch, pulls = np.empty((9, BATCH)), np.empty((9, BATCH))
    for number in range(len(tangents)):
        begin = number * BATCH
        count = min(BATCH, len(ten) - begin)
        for e in range(BATCH):
            element = begin + min(e, count - 1)
            for a in range(10):
                for i in range(3):
                    moved[3 * a + i, e] = u[ten[element, a], i]
        _batch_product(moved, slopes, tangents[number], stretch, pulls, forces)
        for e in range(count):
            for a in range(10):
                for i in range(3):
                    product[ten[begin + e, a], i] += forces[3 * a + i, e]


@numba.njit(cache=True, error_model="numpy", fastmath=ARITHMETIC)
def _batch_product(moved, slopes, blocks, stretch, pulls, forces):
    """Write the product of one batch's Hessians with ``moved`` (30, BATCH) into ``forces`` (30, BATCH)."""
    forces[:] = 0.0
    for q in range(N_POINTS):
        stretch[:] = 0.0
        for a in range(10):
            for i in range(3):
                for c in range(3):
                    slope = slopes[q, a, c]
                    for e in range(BATCH):
                        stretch[3 * c + i, e] += slope * moved[3 * a + i, e]
        pulls[:] = 0.0
        for pair in range(6):
            c, d = PAIRS[pair]
            for i in range(3):
                for j in range(3):
                    row = 9 * pair + 3 * i + j
                    for e in range(BATCH):
                        pulls[3 * c + i, e] += blocks[row, q * BATCH + e] * stretch[3 * d + j, e]
                    if c != d:
                        for e in range(BATCH):
                            pulls[3 * d + j, e] += blocks[row, q * BATCH + e] * stretch[3 * c + i, e]
        for a in range(10):
            for i in range(3):
                s0, s1, s2 = slopes[q, a, 0], slopes[q, a, 1], slopes[q, a, 2]
                for e in range(BATCH):
                    forces[3 * a + i, e] += s0 * pulls[i, e] + s1 * pulls[3 + i, e] + s2 * pulls[6 + i, e]


@numba.njit(cache=True, error_model="numpy")
def gather(x, ten, gradients, volumes, mu, lam, begin, count, places, g, shares):
    """Write positions (30, BATCH), gradients (9, BLOCK), volumes and moduli (3, BLOCK) of ``count`` elements.

    They are those from ``begin`` on; idle columns get the last of them.
    """
    for e in range(BATCH):
        element = begin + min(e, count - 1)
        for a in range(10):
            for i in range(3):
                places[3 * a + i, e] = x[ten[element, a], i]
        for q in range(N_POINTS):
            k = q * BATCH + e
            shares[0, k], shares[1, k], shares[2, k] = volumes[element] / N_POINTS, mu[element], lam[element]
            for c in range(3):
                for j in range(3):
                    g[3 * c + j, k] = gradients[element, c + 1, j]


@numba.njit(cache=True, error_model="numpy", fastmath=ARITHMETIC)
def deformation_gradients(places, slopes, g, pulls, f):
    """Write F at all points of a batch, Σ ``places`` ⊗ ``slopes`` times gradients ``g``, into ``f`` (9, BLOCK)."""
    for q in range(N_POINTS):
        pulls[:] = 0.0
        for a in range(10):
            for i in range(3):
                for c in range(3):
                    slope = slopes[q, a, c]
                    for e in range(BATCH):
                        pulls[3 * i + c, e] += slope * places[3 * a + i, e]
        for i in range(3):
            for j in range(3):
                for e in range(BATCH):
                    k = q * BATCH + e
                    d = (
                        pulls[3 * i, e] * g[j, k]
                        + pulls[3 * i + 1, e] * g[3 + j, k]
                        + pulls[3 * i + 2, e] * g[6 + j, k]
                    )
                    f[3 * i + j, k] = d


@numba.njit(cache=True, error_model="numpy", fastmath=ARITHMETIC)
def forces(p, slopes, g, shares, pulls, forces):
    """Write the derivatives of the energy with respect to the ten nodes into ``forces`` (30, BATCH)."""
    forces[:] = 0.0
    for q in range(N_POINTS):
        for i in range(3):
            for c in range(3):
                for e in range(BATCH):
                    k = q * BATCH + e
                    d = (
                        p[3 * i, k] * g[3 * c, k]
                        + p[3 * i + 1, k] * g[3 * c + 1, k]
                        + p[3 * i + 2, k] * g[3 * c + 2, k]
                    )
                    pulls[3 * i + c, e] = shares[k] * d
        for a in range(10):
            for i in range(3):
                s0, s1, s2 = slopes[q, a, 0], slopes[q, a, 1], slopes[q, a, 2]
                for e in range(BATCH):
                    d = s0 * pulls[3 * i, e] + s1 * pulls[3 * i + 1, e] + s2 * pulls[3 * i + 2, e]
                    forces[3 * a + i, e] += d


@numba.njit(cache=True, error_model="numpy", fastmath=ARITHMETIC)
def half_product(blocks, slopes, a, half):
    """Write Σ_c slope_c B_cd of node ``a``, for all points and each d, into ``half`` (POINTS, 3, 9, BATCH)."""
    half[:] = 0.0
    for q in range(N_POINTS):
        for pair in range(6):
            c, d = PAIRS[pair]
            for i in range(3):
                for j in range(3):
                    row, slope_c, slope_d = 9 * pair + 3 * i + j, slopes[q, a, c], slopes[q, a, d]
                    for e in range(BATCH):
                        half[q, d, 3 * i + j, e] += slope_c * blocks[row, q * BATCH + e]
                    if c != d:
                        for e in range(BATCH):
                            half[q, c, 3 * j + i, e] += slope_d * blocks[row, q * BATCH + e]


@numba.njit(cache=True, error_model="numpy", fastmath=ARITHMETIC)
def whole_product(half, slopes, b, whole):
    """Write the Hessian of one node and node ``b``, Σ_q,d ``half`` slope_d, into ``whole`` (9, BATCH)."""
    for row in range(9):
        for e in range(BATCH):
            whole[row, e] = 0.0
        for q in range(N_POINTS):
            s0, s1, s2 = slopes[q, b, 0], slopes[q, b, 1], slopes[q, b, 2]
            for e in range(BATCH):
                whole[row, e] += s0 * half[q, 0, row, e] + s1 * half[q, 1, row, e] + s2 * half[q, 2, row, e]


class QuadraticElements(Elements):
    """The law of LinearElements at four points of each quadratic element on ``mesh``.

    The unknowns are the positions of the nodes and edge midpoints of ``mesh``, numbered as ``ten_nodes`` says. The
    elements are straight-sided: at rest the midpoints are halfway between the nodes.
    """

    slopes, group = SLOPES, 1

    def __init__(self, mesh: Mesh, tissue: Tissue | Material):
        super().__init__(mesh, ten_nodes(mesh), len(mesh.nodes) + len(mesh.edges), tissue, None)
        self._constants = (self.couples, SLOPES, self.gradients, self.volumes, *self.moduli, self.group)
        self._tangents: np.ndarray | None = None

    def evaluate(self, x: np.ndarray, force: np.ndarray) -> float:
        return energy_and_force(x, *self._constants, *self.law, force)

    def add_stiffness(self, x: np.ndarray, definite: bool, slots: np.ndarray, values: np.ndarray) -> None:
        add_stiffness(x, *self._constants, *self.law, definite, slots, values)

    def tangent(self, x: np.ndarray, definite: bool) -> Callable[[np.ndarray], np.ndarray]:
        """Return the product of the Hessian at ``x`` (n_nodes, 3) [m] with displacements (n_nodes, 3) [m], in [N].

        definite : as ``stiffness`` has it. For a few products this takes a third of the time of a matrix, and less
        memory; the next call ends the use of this product, which shares its memory
        """
        if self._tangents is None:
            self._tangents = np.empty((-(-len(self.couples) // BATCH), 54, BLOCK))
        tangents = self._tangents
        write_tangents(x, *self._constants, *self.law, definite, tangents)

        def multiply(u: np.ndarray) -> np.ndarray:
            forces = np.zeros_like(u)
            add_product(u, self.couples, SLOPES, tangents, forces)
            return forces

        return multiply


class MeanDilatation(QuadraticElements):
    """Elements with Ψ = W(s) at four points and V U(mean θ) of each (Nagtegaal, Parks, Rice 1974): P2 / P0.

    As the mean of θ is one number, an element of ten nodes keeps enough freedom when ν tends to 1/2; plain elements,
    which resist at four points, lock. In the linear case it is the mixed element of quadratic displacements and a
    constant pressure (Malkus and Hughes 1978).
    """

    group = N_POINTS

    def __init__(self, mesh: Mesh, tissue: Tissue | Material):
        super().__init__(mesh, tissue)
        self.law = law_of(self.tissue.law)

    def tangent(self, x: np.ndarray, definite: bool) -> Callable[[np.ndarray], np.ndarray]:
        """Return the product of a matrix, as points of an element are coupled by its mean."""
        return product(self.stiffness(x, definite))
