"""Corotational elasticity: Ψ = μ ‖S − I‖² + λ/2 tr²(S − I) with F = R S (Müller and Gross 2004; McAdams et al. 2011).

Small-strain elasticity in the rotated frame: linear in the stretches, finite for collapsed and inverted elements. Its
resistance to volume is that to the sum of stretches, which allows det F → 0. The fold of tr S is smoothed.
"""

from palpate.effects.corotational import smoothed_trace


def shape(s, mu, gradient, hessian):
    """Return W = μ Σ (sᵢ − 1)², and write its derivatives; with the fold, tr S is T(s) (see smoothed_trace)."""
    trace, slope, curvature, _ = smoothed_trace(s, 0.0, 0.0)
    squares = (s[0] - 1.0) ** 2 + (s[1] - 1.0) ** 2 + (s[2] - 1.0) ** 2
    for i in range(3):
        gradient[i] = 2.0 * mu * (s[i] - (1.0 if i == 0 else slope))
        for j in range(3):
            bend = curvature if i > 0 and j > 0 else 0.0
            hessian[i, j] = 2.0 * mu * ((1.0 if i == j else 0.0) - bend)
    return mu * (squares + 2.0 * (s[0] + (s[1] + s[2]) - trace))


def measure(s, gradient, hessian):
    """Return θ = tr S − 3, and write its derivatives."""
    trace, slope, curvature, _ = smoothed_trace(s, 0.0, 0.0)
    for i in range(3):
        gradient[i] = 1.0 if i == 0 else slope
        for j in range(3):
            hessian[i, j] = curvature if i > 0 and j > 0 else 0.0
    return trace - 3.0


def volume(theta, mu, lam, derivatives):
    """Return U = λ/2 θ², and write U′ and U″."""
    derivatives[0], derivatives[1] = lam * theta, lam
    return 0.5 * lam * theta * theta
