"""Quadratic elements that do not lock: their volume is resisted on average (mean dilatation, P2 / P0)."""

import numba
import numpy as np

from palpate.bodies.material import Material, Tissue
from palpate.bodies.mesh import Mesh
from palpate.effects import principal
from palpate.effects.corotational import BLOCK
from palpate.effects.law import law_of
from palpate.effects.quadratic_elements import (
    BATCH,
    N_POINTS,
    QuadraticElements,
    deformation_gradients,
    energy_and_force,
    forces,
    gather,
    half_product,
    scatter,
    whole_product,
)
from palpate.linalg.block_pattern import BlockPattern


@numba.njit(cache=True, error_model="numpy")
def add_stiffness(x, ten, slopes, gradients, volumes, mu, lam, shape, measure, volume, definite, slots, values):
    """Add the Hessian's blocks [N/m] to ``values`` (n_blocks, 3, 3), those of element e at ``slots[e]`` (10, 10).

    An element's Hessian is that of its points at a constant pressure U′, and U″ V r rᵀ with r the derivative of its
    mean θ.
    """
    places, stretched = np.empty((30, BATCH)), np.empty((9, BATCH))
    g, shares = np.empty((9, BLOCK)), np.empty((3, BLOCK))
    f, pulls, blocks, stiffnesses = np.empty((9, BLOCK)), np.empty((9, BLOCK)), np.empty((54, BLOCK)), np.empty(BLOCK)
    half, whole = np.empty((N_POINTS, 3, 9, BATCH)), np.empty((9, BATCH))
    for begin in range(0, len(ten), BATCH):
        count = min(BATCH, len(ten) - begin)
        gather(x, ten, gradients, volumes, mu, lam, begin, count, places, g, shares)
        deformation_gradients(places, slopes, g, stretched, f)
        moduli, law = (shares[1], shares[2]), (shape, measure, volume)
        principal.hessians(f, g, shares[0], BLOCK, N_POINTS, *moduli, *law, definite, blocks, pulls, stiffnesses)
        forces(pulls, slopes, g, shares[0], stretched, places)
        for e in range(count):
            stiffnesses[e] /= volumes[begin + e]
        for a in range(10):
            half_product(blocks, slopes, a, half)
            for b in range(a, 10):
                whole_product(half, slopes, b, whole)
                for i in range(3):
                    for j in range(3):
                        for e in range(count):
                            whole[3 * i + j, e] += stiffnesses[e] * places[3 * a + i, e] * places[3 * b + j, e]
                scatter(whole, slots, begin, count, a, b, values)


class MeanDilatation(QuadraticElements):
    """Ψ = W(s) at four points and V U(mean θ) for each element (Nagtegaal, Parks, Rice 1974).

    As the mean of θ is one number, an element of ten nodes keeps enough freedom when ν tends to 1/2; plain elements,
    which resist at four points, lock. In the linear case it is the mixed element of quadratic displacements and a
    constant pressure (Malkus and Hughes 1978).
    """

    def __init__(self, mesh: Mesh, tissue: Tissue | Material, pattern: BlockPattern | None = None):
        super().__init__(mesh, tissue, pattern)
        self.law = law_of(self.tissue.law)

    def evaluate(self, x: np.ndarray, force: np.ndarray) -> float:
        constants = (self.couples, self._slopes, self.gradients, self.volumes, *self.moduli)
        return energy_and_force(x, *constants, N_POINTS, *self.law, force)

    def add_stiffness(self, x: np.ndarray, definite: bool, slots: np.ndarray, values: np.ndarray) -> None:
        constants = (self.couples, self._slopes, self.gradients, self.volumes, *self.moduli, *self.law)
        add_stiffness(x, *constants, definite, slots, values)
