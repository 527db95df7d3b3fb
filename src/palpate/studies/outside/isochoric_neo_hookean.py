"""Neo-Hookean law in two parts: Ψ = μ/2 (J^(−2/3) tr FᵀF − 3) + κ/4 (J² − 1 − 2 ln J), κ = λ + 2/3 μ.

The law of deal.II's step-44 and of its gallery program on Cook's membrane (Holzapfel 2000, section 6.4).
"""

from math import inf, log

from palpate.effects.laws.neo_hookean import measure

__all__ = ["measure", "shape", "volume"]


def shape(s, mu, gradient, hessian):
    """Return W = μ/2 (J^(−2/3) Σ sᵢ² − 3), and write its derivatives; infinite, with no slope, unless J > 0."""
    gradient[:], hessian[:] = 0.0, 0.0
    if not s[2] > 0.0:
        return inf
    total = s[0] * s[0] + s[1] * s[1] + s[2] * s[2]
    stiff = mu * (s[0] * s[1] * s[2]) ** (-2.0 / 3.0)
    for i in range(3):
        gradient[i] = stiff * (s[i] - total / (3.0 * s[i]))
        for j in range(3):
            mixed = 2.0 * total / (9.0 * s[i] * s[j]) - 2.0 / 3.0 * (s[i] / s[j] + s[j] / s[i])
            hessian[i, j] = stiff * (mixed + (1.0 + total / (3.0 * s[i] * s[i]) if i == j else 0.0))
    return 0.5 * (stiff * total - 3.0 * mu)


def volume(theta, mu, lam, derivatives):
    """Return U = κ/4 (θ² − 1 − 2 ln θ), and write U′ and U″; infinite, with no slope, unless θ > 0."""
    derivatives[:] = 0.0
    if not theta > 0.0:
        return inf
    bulk = lam + 2.0 / 3.0 * mu
    derivatives[0], derivatives[1] = 0.5 * bulk * (theta - 1.0 / theta), 0.5 * bulk * (1.0 + 1.0 / (theta * theta))
    return 0.25 * bulk * (theta * theta - 1.0 - 2.0 * log(theta))
