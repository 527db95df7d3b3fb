"""Neo-Hookean law in two parts: Ψ = μ/2 (J^(−2/3) tr FᵀF − 3) + κ/4 (J² − 1 − 2 ln J), κ = λ + 2/3 μ.

The law of deal.II's step-44 and of its gallery program on Cook's membrane (Holzapfel 2000, section 6.4).
"""

from math import inf, log

from palpate.effects.laws.neo_hookean import measure

__all__ = ["measure", "shape", "volume"]


def shape(s, mu, gradient, hessian):
    """Return W = μ/2 (J^(−2/3) Σ sᵢ² − 3), J = s₁s₂s₃, and write its derivatives; infinite, flat, unless J > 0."""
    gradient[:], hessian[:] = 0.0, 0.0
    if not s[2] > 0.0:
        return inf
    squares = s[0] * s[0] + s[1] * s[1] + s[2] * s[2]
    scaled_mu = mu * (s[0] * s[1] * s[2]) ** (-2.0 / 3.0)
    for i in range(3):
        gradient[i] = scaled_mu * (s[i] - squares / (3.0 * s[i]))
        for j in range(3):
            mixed = 2.0 * squares / (9.0 * s[i] * s[j]) - 2.0 / 3.0 * (s[i] / s[j] + s[j] / s[i])
            hessian[i, j] = scaled_mu * (mixed + (1.0 + squares / (3.0 * s[i] * s[i]) if i == j else 0.0))
    return 0.5 * (scaled_mu * squares - 3.0 * mu)


def volume(theta, mu, lam, derivatives):
    """Return U = κ/4 (θ² − 1 − 2 ln θ), and write U′ and U″; infinite, with no slope, unless θ > 0."""
    derivatives[:] = 0.0
    if not theta > 0.0:
        return inf
    bulk = lam + 2.0 / 3.0 * mu
    derivatives[0], derivatives[1] = 0.5 * bulk * (theta - 1.0 / theta), 0.5 * bulk * (1.0 + 1.0 / (theta * theta))
    return 0.25 * bulk * (theta * theta - 1.0 - 2.0 * log(theta))
