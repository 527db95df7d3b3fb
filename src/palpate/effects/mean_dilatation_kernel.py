"""Stiffness of ten-node tetrahedra whose measure of volume is averaged over each element (P2 / P0)."""

import numba
import numpy as np

from palpate.effects import principal
from palpate.effects.corotational_stress import BLOCK
from palpate.effects.quadratic_kernel import (
    BATCH,
    POINTS,
    deformation_gradients,
    forces,
    gather,
    half_product,
    scatter,
    whole_product,
)


@numba.njit(cache=True, error_model="numpy")
def add_stiffness(
    x, ten, slopes, gradients, volumes, mu, lam, shape, measure, volume, definite, most, slots, values, rows, rests
):
    """Add the Hessian's blocks [N/m] to ``values`` (n_blocks, 3, 3), those of element e at ``slots[e]`` (10, 10).

    An element's Hessian is that of its points at a constant pressure U′, and U″ V r rᵀ with r the derivative of its
    mean θ. What U″ exceeds ``most`` (n_elements,) [Pa] by is left out; it is written over V into ``rests``
    (n_elements,) [Pa/m³], and V r into ``rows`` (n_elements, 10, 3) [m²].
    """
    places, stretched = np.empty((30, BATCH)), np.empty((9, BATCH))
    g, shares = np.empty((9, BLOCK)), np.empty((3, BLOCK))
    f, pulls, blocks, stiffnesses = np.empty((9, BLOCK)), np.empty((9, BLOCK)), np.empty((54, BLOCK)), np.empty(BLOCK)
    half, whole = np.empty((POINTS, 3, 9, BATCH)), np.empty((9, BATCH))
    for begin in range(0, len(ten), BATCH):
        count = min(BATCH, len(ten) - begin)
        gather(x, ten, gradients, volumes, mu, lam, begin, count, places, g, shares)
        deformation_gradients(places, slopes, g, stretched, f)
        moduli, law = (shares[1], shares[2]), (shape, measure, volume)
        principal.hessians(f, g, shares[0], BLOCK, POINTS, *moduli, *law, definite, blocks, pulls, stiffnesses)
        forces(pulls, slopes, g, shares[0], stretched, places)
        for e in range(count):
            kept = min(stiffnesses[e], most[begin + e])
            rests[begin + e] = (stiffnesses[e] - kept) / volumes[begin + e]
            stiffnesses[e] = kept / volumes[begin + e]
            for a in range(10):
                for i in range(3):
                    rows[begin + e, a, i] = places[3 * a + i, e]
        for a in range(10):
            half_product(blocks, slopes, a, half)
            for b in range(a, 10):
                whole_product(half, slopes, b, whole)
                for i in range(3):
                    for j in range(3):
                        for e in range(count):
                            whole[3 * i + j, e] += stiffnesses[e] * places[3 * a + i, e] * places[3 * b + j, e]
                scatter(whole, slots, begin, count, a, b, values)
