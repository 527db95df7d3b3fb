"""Quadratic neo-Hookean law, that of Newton's bodies: Ψ = μ/2 (tr FᵀF − 3) + l/2 (J − a)², l = λ + μ, a = 1 + μ/l.

Smith, de Goes, Kim 2018, eq. 13, with the constants of their section 3.4. A body has this law if it
names this file as its law, as one of the user's own, so that the engine's answers have a truth.
"""

from palpate.effects.laws.stable_neo_hookean import measure, volume

__all__ = ["measure", "shape", "volume"]


def shape(s, mu, gradient, hessian):
    """Return W = μ/2 (Σ sᵢ² − 3) − μ (J − 1) + μ/2 (J − 1)², and write its derivatives."""
    change = s[0] * s[1] * s[2] - 1.0
    energy = (0.5 * change - 1.0) * mu * change
    for i in range(3):
        area_i = s[(i + 1) % 3] * s[(i + 2) % 3]
        energy += 0.5 * mu * (s[i] - 1.0) * (s[i] + 1.0)
        gradient[i] = mu * (s[i] + (change - 1.0) * area_i)
        for j in range(3):
            area_j = s[(j + 1) % 3] * s[(j + 2) % 3]
            hessian[i, j] = mu * area_i * area_j + (mu if i == j else mu * (change - 1.0) * s[3 - i - j])
    return energy
