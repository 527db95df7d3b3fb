"""Neo-Hookean law with logarithms: Ψ = μ/2 (tr FᵀF − 3) − μ ln J + λ/2 ln² J (Bonet and Wood 2008, eq. 6.28).

The usual law of rubber and soft tissue at moderate strains. Its energy is infinite for elements that are flat or
inverted, so that none becomes so; a search that starts from such a state is refused. Limit: in tension it does not
stiffen as fibrous tissue does, and ln² J is not convex above J = e.
"""

from math import inf, log1p


def shape(s, mu, gradient, hessian):
    """Return W = μ/2 Σ (sᵢ² − 1) − μ ln J, and write its derivatives; infinite, with no slope, unless J > 0."""
    gradient[:], hessian[:] = 0.0, 0.0
    if not s[2] > 0.0:
        return inf
    energy = 0.0
    for i in range(3):
        strain = s[i] - 1.0
        energy += mu * (strain * (1.0 + 0.5 * strain) - log1p(strain))
        gradient[i] = mu * strain * (s[i] + 1.0) / s[i]
        hessian[i, i] = mu * (1.0 + 1.0 / (s[i] * s[i]))
    return energy


def measure(s, gradient, hessian):
    """Return θ = J = s₁ s₂ s₃, the ratio of volumes, and write its derivatives."""
    for i in range(3):
        gradient[i] = s[(i + 1) % 3] * s[(i + 2) % 3]
        for j in range(3):
            hessian[i, j] = 0.0 if i == j else s[3 - i - j]
    return s[0] * s[1] * s[2]


def volume(theta, mu, lam, derivatives):
    """Return U = λ/2 ln² θ, and write U′ and U″; infinite, with no slope, unless θ > 0."""
    derivatives[:] = 0.0
    if not theta > 0.0:
        return inf
    log = log1p(theta - 1.0)
    derivatives[0], derivatives[1] = lam * log / theta, lam * (1.0 - log) / (theta * theta)
    return 0.5 * lam * log * log
