"""Stable neo-Hookean law: Ψ = m/2 (I − 3) − m/2 ln((I + 1)/4) + l/2 (J − 1)² − 3/4 m (J − 1), with I = tr FᵀF.

From Smith, de Goes, Kim 2018, eq. 14, less its value at rest; m = 4/3 μ and l = λ + 5/6 μ (their section 3.4) make
Lamé's constants at rest μ and λ. It is finite and smooth for collapsed and inverted elements, and restores them.
Limits: a flat or inverted element costs a finite energy only, so that strong forces do invert some; and a bar pushed
along its axis has its largest force at a stretch of 0.58 for ν = 0, and 0.38 for 0.3.
"""

from math import log1p

from palpate.effects.laws.neo_hookean import measure

__all__ = ["measure", "shape", "volume"]


def shape(s, mu, gradient, hessian):
    """Return W = Ψ − λ/2 (J − 1)² and write its derivatives; ``grown`` is I − 3, ``change`` J − 1, area ∂J/∂s."""
    m, grown, change = 4.0 / 3.0 * mu, 0.0, s[0] * s[1] * s[2] - 1.0
    for i in range(3):
        grown += (s[i] - 1.0) * (s[i] + 1.0)
    share, tension = 1.0 / (grown + 4.0), 5.0 / 6.0 * mu * change - mu
    for i in range(3):
        area_i = s[(i + 1) % 3] * s[(i + 2) % 3]
        gradient[i] = m * (1.0 - share) * s[i] + tension * area_i
        for j in range(3):
            area_j = s[(j + 1) % 3] * s[(j + 2) % 3]
            hessian[i, j] = 2.0 * m * share * share * s[i] * s[j] + 5.0 / 6.0 * mu * area_i * area_j
            hessian[i, j] += m * (1.0 - share) if i == j else tension * s[3 - i - j]
    return 0.5 * m * (grown - log1p(0.25 * grown)) + (5.0 / 12.0 * mu * change - mu) * change


def volume(theta, mu, lam, derivatives):
    """Return U = λ/2 (θ − 1)², and write U′ and U″."""
    derivatives[0], derivatives[1] = lam * (theta - 1.0), lam
    return 0.5 * lam * (theta - 1.0) ** 2
