"""Exponential law: Ψ = μ/(2 b) (exp(b Q) − 1) + λ/2 ln² J with Q = tr FᵀF − 3 − 2 ln J, and a stiffening b ≥ 0.

A body names it with its stiffening, as ``exponential(8)``. Without change of volume Q = I₁ − 3, and the law is that of
Demiray 1972 (J. Biomech. 5, 309), Fung's for isotropic tissue. For other deformations − 2 ln J makes Q zero and
stationary at rest, as in the law of Holmes and Mow 1990 (J. Biomech. 23, 1145): there is no stress at rest, the
stiffness there is that of μ and λ for any b, and b → 0 is ``neo_hookean``. exp(b Q) is convex in F and J. Where an
element is flat, inverted, or so far stretched that b Q reaches LARGEST, the energy is infinite, so that a search backs
off. Limit: the stiffness is that of the ground tissue in all directions; fibres have none of their own.
"""

from math import exp, expm1, inf

from numba import njit

from palpate.effects.laws import neo_hookean
from palpate.effects.laws.neo_hookean import measure, volume

__all__ = ["measure", "shape_of", "volume"]

LARGEST = 500.0
"""Largest exponent: its exponential times moduli and squares of slopes is still far from overflow."""

_shape_at_unit = njit(error_model="numpy")(neo_hookean.shape)


def shape_of(stiffening):
    """Return the function ``shape`` of a law with the ``stiffening`` b."""
    two_b = 2.0 * stiffening
    if two_b == 0.0:
        return neo_hookean.shape

    def shape(s, mu, gradient, hessian):
        """Return W = μ/(2 b) (exp(2 b w) − 1), w being the neo-Hookean W for μ = 1, and write its derivatives."""
        exponent = two_b * _shape_at_unit(s, 1.0, gradient, hessian)
        if not exponent < LARGEST:
            gradient[:], hessian[:] = 0.0, 0.0
            return inf
        factor = mu * exp(exponent)
        for i in range(3):
            for j in range(3):
                hessian[i, j] = factor * (hessian[i, j] + two_b * gradient[i] * gradient[j])
        for i in range(3):
            gradient[i] *= factor
        return mu * expm1(exponent) / two_b

    return shape
