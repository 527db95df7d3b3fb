"""A law of one's own: Hencky's, quadratic in the logarithms of the stretches."""

import math


def shape(s, mu, gradient, hessian):
    """Return W = μ Σ ln² sᵢ, and write its derivatives; infinite unless all stretches are positive."""
    gradient[:], hessian[:] = 0.0, 0.0
    if not s[2] > 0.0:
        return math.inf
    energy = 0.0
    for i in range(3):
        log = math.log(s[i])
        energy += mu * log * log
        gradient[i] = 2.0 * mu * log / s[i]
        hessian[i, i] = 2.0 * mu * (1.0 - log) / (s[i] * s[i])
    return energy


def measure(s, gradient, hessian):
    """Return θ = J, and write its derivatives."""
    for i in range(3):
        gradient[i] = s[(i + 1) % 3] * s[(i + 2) % 3]
        for j in range(3):
            hessian[i, j] = 0.0 if i == j else s[3 - i - j]
    return s[0] * s[1] * s[2]


def volume(theta, mu, lam, derivatives):
    """Return U = λ/2 ln² θ, and write U′ and U″."""
    derivatives[:] = 0.0
    if not theta > 0.0:
        return math.inf
    log = math.log(theta)
    derivatives[0], derivatives[1] = lam * log / theta, lam * (1.0 - log) / (theta * theta)
    return 0.5 * lam * log * log
