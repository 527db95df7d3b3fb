"""Quadratic neo-Hookean law, that of Newton's bodies: Ψ = μ/2 (tr FᵀF − 3) + l/2 (J − a)², l = λ + μ, a = 1 + μ/l.

Smith, de Goes, Kim 2018, eq. 13, with the constants of their section 3.4. A file of a law, as docs/add-a-law.md has it,
so that a body may have this law and an engine's answers a truth.
"""

from palpate.effects.laws.neo_hookean import measure

__all__ = ["measure", "shape", "volume"]


def shape(s, mu, slopes, curvatures):
    """Return W = μ/2 (Σ sᵢ² − 3) − μ (J − 1) + μ/2 (J − 1)², and write its derivatives."""
    change = s[0] * s[1] * s[2] - 1.0
    energy = (0.5 * change - 1.0) * mu * change
    for i in range(3):
        area = s[(i + 1) % 3] * s[(i + 2) % 3]
        energy += 0.5 * mu * (s[i] - 1.0) * (s[i] + 1.0)
        slopes[i] = mu * (s[i] + (change - 1.0) * area)
        for j in range(3):
            other = s[(j + 1) % 3] * s[(j + 2) % 3]
            curvatures[i, j] = mu * area * other + (mu if i == j else mu * (change - 1.0) * s[3 - i - j])
    return energy


def volume(theta, mu, lam, derivatives):
    """Return U = λ/2 (θ − 1)², and write U′ and U″."""
    derivatives[0], derivatives[1] = lam * (theta - 1.0), lam
    return 0.5 * lam * (theta - 1.0) ** 2
