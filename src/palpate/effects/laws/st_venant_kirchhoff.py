"""St. Venant and Kirchhoff's law: Ψ = μ tr E² + λ/2 tr² E with Green's strain E = (FᵀF − I)/2.

The simplest law of large rotations (Bonet and Wood 2008, section 6.4.2). Its limit: it softens under compression. A bar
pushed along its axis has the largest force at a stretch of 1/√3, and none when flat; below that it collapses, without
resistance. Use it for small strains and large rotations.
"""


def shape(s, mu, gradient, hessian):
    """Return W = μ Σ eᵢ² with eᵢ = (sᵢ² − 1)/2, and write its derivatives."""
    energy = 0.0
    hessian[:] = 0.0
    for i in range(3):
        strain = 0.5 * (s[i] - 1.0) * (s[i] + 1.0)
        energy += mu * strain * strain
        gradient[i] = 2.0 * mu * strain * s[i]
        hessian[i, i] = 2.0 * mu * (s[i] * s[i] + strain)
    return energy


def measure(s, gradient, hessian):
    """Return θ = tr E, and write its derivatives."""
    total = 0.0
    hessian[:] = 0.0
    for i in range(3):
        total += 0.5 * (s[i] - 1.0) * (s[i] + 1.0)
        gradient[i], hessian[i, i] = s[i], 1.0
    return total


def volume(theta, mu, lam, derivatives):
    """Return U = λ/2 θ², and write U′ and U″."""
    derivatives[0], derivatives[1] = lam * theta, lam
    return 0.5 * lam * theta * theta
