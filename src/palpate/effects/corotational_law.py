"""The corotational energy density as a function of the principal stretches: its value and derivatives.

A law is two functions of the signed singular values s₁ ≥ s₂ ≥ |s₃| of F = U diag(s) Vᵀ. ``first`` gives the energy and
the principal stresses ∂Ψ/∂s, ``second`` all that the Hessian with respect to F consists of: the second derivatives
∂²Ψ/∂s², and the eigenvalues of what turns the frames U and V, two for each pair of axes (2, 3), (3, 1) and (1, 2),
flips (∂ᵢΨ − ∂ⱼΨ)/(sᵢ − sⱼ) and twists (∂ᵢΨ + ∂ⱼΨ)/(sᵢ + sⱼ) (Smith, de Goes, Kim 2019, section 5.1).
"""

import numba

FOLD = 0.05
"""Width over which the fold of the energy is smoothed, in s₂ + s₃ (which is 2 at rest)."""

LEAST = 1e-8
"""Lower bound of a denominator in flips and twists."""


@numba.njit(cache=True, error_model="numpy")
def smoothed_trace(s, mu, lam):
    """Compute tr S with its fold smoothed, T = s₁ + τ(s₂ + s₃), then τ', τ'' and c = ∂Ψ/∂T.

    τ(t) is the C² quartic that meets |t| at t = FOLD. As Ψ = μ (Σs² − 2T + 3) + λ/2 (T − 3)², only T depends on the
    rotation.
    """
    t = s[1] + s[2]
    tau, slope, curvature = t, 1.0, 0.0
    if t < FOLD:
        q = t / FOLD
        tau = FOLD * (3.0 + 6.0 * q * q - q**4) / 8.0
        slope = (3.0 * q - q**3) / 2.0
        curvature = 1.5 * (1.0 - q * q) / FOLD
    trace = s[0] + tau
    return trace, slope, curvature, lam * (trace - 3.0) - 2.0 * mu


@numba.njit(cache=True, error_model="numpy")
def first(s, mu, lam, stresses):
    """Return Ψ(s) [J/m³] and write ∂Ψ/∂s [Pa] into ``stresses`` (3,)."""
    trace, slope, _, c = smoothed_trace(s, mu, lam)
    # Σ(s − 1)² exactly, away from the fold: Σs² − 2T + 3 would suffer from cancellation
    squares = (s[0] - 1.0) ** 2 + (s[1] - 1.0) ** 2 + (s[2] - 1.0) ** 2 + 2.0 * (s[0] + (s[1] + s[2]) - trace)
    energy = mu * squares + 0.5 * lam * (trace - 3.0) ** 2
    pressure = lam * (trace - 3.0)
    for k in range(3):
        stresses[k] = 2.0 * mu * (s[k] - 1.0) + pressure
    stresses[1] -= (1.0 - slope) * c
    stresses[2] -= (1.0 - slope) * c
    return energy


@numba.njit(cache=True, error_model="numpy")
def second(s, mu, lam, curvatures, flips, twists):
    """Write ∂²Ψ/∂s² into ``curvatures`` (3, 3), and the eigenvalues of the pairs into ``flips, twists`` (3,) [Pa].

    Return whether ``curvatures`` may have a negative eigenvalue.
    """
    _, slope, curvature, c = smoothed_trace(s, mu, lam)
    for i in range(3):
        for j in range(3):
            slopes = (1.0 if i == 0 else slope) * (1.0 if j == 0 else slope)
            curvatures[i, j] = lam * slopes + (c * curvature if i > 0 and j > 0 else 0.0)
        curvatures[i, i] += 2.0 * mu
    t, folded, free = s[1] + s[2], (1.0 - slope) * c, (1.0 + slope) * c
    flips[0] = 2.0 * mu
    flips[1] = 2.0 * mu + folded / max(s[0] - s[2], LEAST)
    flips[2] = 2.0 * mu + folded / max(s[0] - s[1], LEAST)
    twists[0] = 2.0 * mu + 2.0 * c * (curvature if t <= 0.0 else slope / t)
    twists[1] = 2.0 * mu + free / max(s[2] + s[0], LEAST)
    twists[2] = 2.0 * mu + free / max(s[0] + s[1], LEAST)
    return curvature != 0.0
