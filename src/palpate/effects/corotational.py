"""Corotational elasticity at many deformation gradients, in loops that the compiler vectorises.

**Law.** Two functions of the signed singular values s₁ ≥ s₂ ≥ |s₃| of F = U diag(s) Vᵀ. ``first`` gives the energy and
the principal stresses ∂Ψ/∂s, ``second`` all that the Hessian with respect to F consists of: the second derivatives
∂²Ψ/∂s², and the eigenvalues of what turns the frames U and V, two for each pair of axes (2, 3), (3, 1) and (1, 2),
flips (∂ᵢΨ − ∂ⱼΨ)/(sᵢ − sⱼ) and twists (∂ᵢΨ + ∂ⱼΨ)/(sᵢ + sⱼ) (Smith, de Goes, Kim 2019, section 5.1).

**Blocks.** A block is an array (9, BLOCK) with the entries of F, row by row; each column is one deformation gradient.
Rotations are found by Newton's iteration R ← (R + R⁻ᵀ)/2. From its first step on every singular value of R is at least
1, so that ‖R‖² − 3 bounds the distance of each from 1 (Higham 1986). Where it converges and det F > 0, the stretches
lie between about 1/50 and 50, and R is the rotation of the signed singular value decomposition; other elements,
collapsed, inverted or extreme, are left to that decomposition, which also knows of the energy's fold. Pairs and
gradients of Hessians are those of ``principal``.
"""

import numba
import numpy as np

from palpate.effects.principal import PAIRS, clamp, clamp_pairs, decompose, turn, write_blocks

FOLD = 0.05
"""Width over which the fold of the energy is smoothed, in s₂ + s₃ (which is 2 at rest)."""

LEAST_DIFFERENCE = 1e-8
"""Lower bound of a denominator in flips and twists."""


@numba.njit(cache=True, error_model="numpy")
def smoothed_trace(s, mu, lam):
    """Compute tr S with its fold smoothed, T = s₁ + τ(s₂ + s₃), then τ', τ'' and c = ∂Ψ/∂T.

    τ(t) is the C² quartic that meets |t| at t = FOLD. Ψ = μ (Σs² − 2T + 3) + λ/2 (T − 3)²: only T depends on R.
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
    """Return Ψ(s) [J/m³] and write ∂Ψ/∂s [Pa] into ``stresses`` (3,); c : ∂Ψ/∂T of ``smoothed_trace``."""
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
    t, flip_slope, twist_slope = s[1] + s[2], (1.0 - slope) * c, (1.0 + slope) * c
    flips[0] = 2.0 * mu
    flips[1] = 2.0 * mu + flip_slope / max(s[0] - s[2], LEAST_DIFFERENCE)
    flips[2] = 2.0 * mu + flip_slope / max(s[0] - s[1], LEAST_DIFFERENCE)
    twists[0] = 2.0 * mu + 2.0 * c * (curvature if t <= 0.0 else slope / t)
    twists[1] = 2.0 * mu + twist_slope / max(s[2] + s[0], LEAST_DIFFERENCE)
    twists[2] = 2.0 * mu + twist_slope / max(s[0] + s[1], LEAST_DIFFERENCE)
    return curvature != 0.0


BLOCK = 256
"""Deformation gradients in one block: their F and R stay in the first cache."""
_CERTAIN_STEPS, _MOST_STEPS = 4, 8
_ROUNDING = 1e-14
ARITHMETIC = {"contract", "nsz", "arcp"}


@numba.njit(cache=True, error_model="numpy")
def rotations(f, r, count, accepted):
    """Find the rotations of the polar decompositions F = R S of the first ``count`` columns of ``f``, by iteration.

    f, r : (9, BLOCK), a column the rows of a 3 × 3 matrix; accepted : (BLOCK,) bool, written: which iterations have
    converged to a rotation, which those of matrices with det F < 0 never do
    """
    for i in range(9):
        for k in range(count):
            r[i, k] = f[i, k]
    for _ in range(_CERTAIN_STEPS):
        _step(r, count)
    for _ in range(_CERTAIN_STEPS, _MOST_STEPS):
        if _settled(f, r, count, accepted) == count:
            break
        _step(r, count)
    _settled(f, r, count, accepted)


@numba.njit(cache=True, error_model="numpy")
def stresses(f, p, count, mu, lam, energies, accepted):
    """Write P = ∂Ψ/∂F [Pa] of the first ``count`` columns of ``f`` into ``p``, and Ψ [J/m³] into ``energies``.

    f, p : (9, BLOCK); mu, lam : (count,) Lamé's constants of each column [Pa]; energies : (BLOCK,)
    accepted : (BLOCK,) bool, scratch
    """
    rotations(f, p, count, accepted)
    _polar_stresses(f, p, count, mu, lam, energies)
    for k in range(count):
        if not accepted[k]:
            energies[k] = _principal_stress(f, p, k, mu[k], lam[k])


@numba.njit(cache=True, error_model="numpy", fastmath=ARITHMETIC)
def _step(r, count):
    """Take a step of Newton's iteration R ← (R + R⁻ᵀ)/2 in each column of ``r``."""
    for k in range(count):
        r00, r01, r02 = r[0, k], r[1, k], r[2, k]
        r10, r11, r12 = r[3, k], r[4, k], r[5, k]
        r20, r21, r22 = r[6, k], r[7, k], r[8, k]
        c00, c01, c02 = r11 * r22 - r12 * r21, r12 * r20 - r10 * r22, r10 * r21 - r11 * r20
        c10, c11, c12 = r02 * r21 - r01 * r22, r00 * r22 - r02 * r20, r01 * r20 - r00 * r21
        c20, c21, c22 = r01 * r12 - r02 * r11, r02 * r10 - r00 * r12, r00 * r11 - r01 * r10
        h = 0.5 / (r00 * c00 + r01 * c01 + r02 * c02)
        r[0, k], r[1, k], r[2, k] = 0.5 * r00 + h * c00, 0.5 * r01 + h * c01, 0.5 * r02 + h * c02
        r[3, k], r[4, k], r[5, k] = 0.5 * r10 + h * c10, 0.5 * r11 + h * c11, 0.5 * r12 + h * c12
        r[6, k], r[7, k], r[8, k] = 0.5 * r20 + h * c20, 0.5 * r21 + h * c21, 0.5 * r22 + h * c22


@numba.njit(cache=True, error_model="numpy", fastmath=ARITHMETIC)
def _settled(f, r, count, accepted):
    """Return the number of columns that need no further step, among them those of det F < 0, which are not accepted."""
    settled = 0
    for k in range(count):
        f00, f01, f02 = f[0, k], f[1, k], f[2, k]
        c0 = f[4, k] * f[8, k] - f[5, k] * f[7, k]
        c1 = f[5, k] * f[6, k] - f[3, k] * f[8, k]
        c2 = f[3, k] * f[7, k] - f[4, k] * f[6, k]
        norm = r[0, k] * r[0, k] + r[1, k] * r[1, k] + r[2, k] * r[2, k] + r[3, k] * r[3, k] + r[4, k] * r[4, k]
        norm += r[5, k] * r[5, k] + r[6, k] * r[6, k] + r[7, k] * r[7, k] + r[8, k] * r[8, k]
        converged, upright = norm - 3.0 < _ROUNDING, f00 * c0 + f01 * c1 + f02 * c2 > 0.0
        accepted[k] = converged & upright
        settled += 1 if converged or not upright else 0
    return settled


@numba.njit(cache=True, error_model="numpy", fastmath=ARITHMETIC)
def _polar_stresses(f, r, count, mu, lam, energies):
    """Replace the rotations ``r`` by P = 2μ (F − R) + λ tr(S − I) R, where tr S = R : F."""
    for k in range(count):
        r00, r01, r02 = r[0, k], r[1, k], r[2, k]
        r10, r11, r12 = r[3, k], r[4, k], r[5, k]
        r20, r21, r22 = r[6, k], r[7, k], r[8, k]
        strain = f[0, k] * r00 + f[1, k] * r01 + f[2, k] * r02 + f[3, k] * r10 + f[4, k] * r11 + f[5, k] * r12
        strain += f[6, k] * r20 + f[7, k] * r21 + f[8, k] * r22 - 3.0
        d00, d01, d02 = f[0, k] - r00, f[1, k] - r01, f[2, k] - r02
        d10, d11, d12 = f[3, k] - r10, f[4, k] - r11, f[5, k] - r12
        d20, d21, d22 = f[6, k] - r20, f[7, k] - r21, f[8, k] - r22
        squares = d00 * d00 + d01 * d01 + d02 * d02 + d10 * d10 + d11 * d11 + d12 * d12
        squares += d20 * d20 + d21 * d21 + d22 * d22
        pressure, twice = lam[k] * strain, 2.0 * mu[k]
        energies[k] = mu[k] * squares + 0.5 * pressure * strain
        r[0, k], r[1, k] = twice * d00 + pressure * r00, twice * d01 + pressure * r01
        r[2, k], r[3, k] = twice * d02 + pressure * r02, twice * d10 + pressure * r10
        r[4, k], r[5, k] = twice * d11 + pressure * r11, twice * d12 + pressure * r12
        r[6, k], r[7, k] = twice * d20 + pressure * r20, twice * d21 + pressure * r21
        r[8, k] = twice * d22 + pressure * r22


@numba.njit(cache=True, error_model="numpy")
def _principal_stress(f, p, k, mu, lam):
    """Write P = U diag(∂Ψ/∂s) Vᵀ [Pa] of column ``k`` of ``f`` into that of ``p``, and return Ψ [J/m³]."""
    given, u, v, s, principal = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty(3), np.empty(3)
    decompose(f, k, given, u, s, v)
    energy = first(s, mu, lam, principal)
    turn(u, principal, v, p, k)
    return energy


_SWEEPS, _EIGEN_ROUNDING = 6, 1e-16
_TIE = 1e-12
"""Twists below zero by less than this part of μ are rounding: at rest those of rotations are zero."""


@numba.njit(cache=True, error_model="numpy")
def hessians(f, gradients, shares, count, mu, lam, definite, rotated, blocks):
    """Write the Hessians of the first ``count`` columns of ``f`` (9, BLOCK) into ``blocks`` (54, BLOCK) [N/m].

    gradients : (9, BLOCK), the three vectors g of each column [1/m]; shares : (BLOCK,), their volumes [m³]
    mu, lam : (count,), Lamé's constants of each column [Pa]
    definite : replaces negative eigenvalues of ∂²Ψ/∂F² by zero (Smith, de Goes, Kim 2019, section 5)
    rotated : (15, BLOCK), scratch
    """
    accepted, unclamped, scratch = np.empty(BLOCK, dtype=np.bool_), np.empty(BLOCK, dtype=np.bool_), np.empty((7, 3, 3))
    rotations(f, rotated, count, accepted)
    if definite:
        _without_clamp(f, rotated, count, mu, lam, unclamped)
    turned(f, gradients, shares, count, mu, lam, rotated)
    if definite:
        for k in range(count):
            if accepted[k] and not unclamped[k]:
                _clamp_spin(rotated, k, -mu[k] * shares[k], scratch[0], scratch[1])
    for pair in range(6):
        _polar_blocks(rotated, shares, count, mu, lam, pair, blocks)
    for k in range(count):
        if not accepted[k]:
            _principal_blocks(f, gradients, shares[k], k, mu[k], lam[k], definite, scratch, blocks)


@numba.njit(cache=True, error_model="numpy", fastmath=ARITHMETIC)
def _without_clamp(f, r, count, mu, lam, sure):
    """Write into ``sure`` (BLOCK,) bool which columns have a Hessian that is sure to have no negative eigenvalue.

    Those that can be negative are 2μ + 2c/(sᵢ + sⱼ) with c = λ tr(S − I) − 2μ: none is if G + c/μ I is positive
    semidefinite, where G = tr(S) I − S has the eigenvalues sᵢ + sⱼ.
    """
    for k in range(count):
        s00 = f[0, k] * r[0, k] + f[1, k] * r[1, k] + f[2, k] * r[2, k]
        s11 = f[3, k] * r[3, k] + f[4, k] * r[4, k] + f[5, k] * r[5, k]
        s22 = f[6, k] * r[6, k] + f[7, k] * r[7, k] + f[8, k] * r[8, k]
        a01 = -(f[0, k] * r[3, k] + f[1, k] * r[4, k] + f[2, k] * r[5, k])
        a02 = -(f[0, k] * r[6, k] + f[1, k] * r[7, k] + f[2, k] * r[8, k])
        a12 = -(f[3, k] * r[6, k] + f[4, k] * r[7, k] + f[5, k] * r[8, k])
        shift = (lam[k] * (s00 + s11 + s22 - 3.0) - 2.0 * mu[k]) / mu[k] + _TIE
        a00, a11, a22 = s11 + s22 + shift, s00 + s22 + shift, s00 + s11 + shift
        minor = a00 * a11 - a01 * a01
        det = a22 * minor - a12 * (a00 * a12 - a01 * a02) + a02 * (a01 * a12 - a11 * a02)
        sure[k] = (a00 >= 0.0) & (minor >= 0.0) & (det >= 0.0)


@numba.njit(cache=True, error_model="numpy")
def _clamp_spin(rotated, k, least, a, axes):
    """Raise the eigenvalues of the symmetric matrix in rows 9 to 14 of column ``k`` to at least ``least``, −μ V.

    ``turned`` has written it; they are c V/(sᵢ + sⱼ), V being the volume, and are found by Jacobi's rotations. Then no
    eigenvalue V (2μ + 2c/(sᵢ + sⱼ)) of the Hessian is negative, and no others can be; a, axes : (3, 3), scratch
    """
    row = 9
    for i in range(3):
        for j in range(i, 3):
            a[i, j] = a[j, i] = rotated[row, k]
            axes[i, j] = axes[j, i] = 1.0 if i == j else 0.0
            row += 1
    for _ in range(_SWEEPS):
        for p in range(2):
            for q in range(p + 1, 3):
                if abs(a[p, q]) <= _EIGEN_ROUNDING * (abs(a[0, 0]) + abs(a[1, 1]) + abs(a[2, 2])):
                    continue
                cotangent = (a[q, q] - a[p, p]) / (2.0 * a[p, q])  # of twice the angle
                tangent = (1.0 if cotangent >= 0.0 else -1.0) / (abs(cotangent) + np.sqrt(cotangent * cotangent + 1.0))
                cosine = 1.0 / np.sqrt(tangent * tangent + 1.0)
                for i in range(3):
                    x, y = a[i, p], a[i, q]
                    a[i, p], a[i, q] = cosine * (x - tangent * y), cosine * (tangent * x + y)
                for i in range(3):
                    x, y = a[p, i], a[q, i]
                    a[p, i], a[q, i] = cosine * (x - tangent * y), cosine * (tangent * x + y)
                    x, y = axes[i, p], axes[i, q]
                    axes[i, p], axes[i, q] = cosine * (x - tangent * y), cosine * (tangent * x + y)
    row = 9
    for i in range(3):
        for j in range(i, 3):
            entry = 0.0
            for p in range(3):
                entry += axes[i, p] * max(a[p, p], least) * axes[j, p]
            rotated[row, k] = entry
            row += 1


@numba.njit(cache=True, error_model="numpy", fastmath=ARITHMETIC)
def turned(f, gradients, shares, count, mu, lam, rotated):
    """Replace R in ``rotated`` by gradients R g; write c V (R G Rᵀ)⁻¹, see ``_without_clamp``, into rows 9 to 14."""
    for k in range(count):
        r00, r01, r02 = rotated[0, k], rotated[1, k], rotated[2, k]
        r10, r11, r12 = rotated[3, k], rotated[4, k], rotated[5, k]
        r20, r21, r22 = rotated[6, k], rotated[7, k], rotated[8, k]
        s00 = f[0, k] * r00 + f[1, k] * r01 + f[2, k] * r02
        s11 = f[3, k] * r10 + f[4, k] * r11 + f[5, k] * r12
        s22 = f[6, k] * r20 + f[7, k] * r21 + f[8, k] * r22
        a01 = -(f[0, k] * r10 + f[1, k] * r11 + f[2, k] * r12)
        a02 = -(f[0, k] * r20 + f[1, k] * r21 + f[2, k] * r22)
        a12 = -(f[3, k] * r20 + f[4, k] * r21 + f[5, k] * r22)
        a00, a11, a22 = s11 + s22, s00 + s22, s00 + s11
        c00, c01, c02 = a11 * a22 - a12 * a12, a02 * a12 - a01 * a22, a01 * a12 - a02 * a11
        c11, c12, c22 = a00 * a22 - a02 * a02, a01 * a02 - a00 * a12, a00 * a11 - a01 * a01
        weight = shares[k] * (lam[k] * (s00 + s11 + s22 - 3.0) - 2.0 * mu[k]) / (a00 * c00 + a01 * c01 + a02 * c02)
        rotated[9, k], rotated[10, k], rotated[11, k] = weight * c00, weight * c01, weight * c02
        rotated[12, k], rotated[13, k], rotated[14, k] = weight * c11, weight * c12, weight * c22
        g0, g1, g2 = gradients[0, k], gradients[1, k], gradients[2, k]
        g3, g4, g5 = gradients[3, k], gradients[4, k], gradients[5, k]
        g6, g7, g8 = gradients[6, k], gradients[7, k], gradients[8, k]
        rotated[0, k], rotated[3, k] = r00 * g0 + r01 * g1 + r02 * g2, r00 * g3 + r01 * g4 + r02 * g5
        rotated[6, k], rotated[1, k] = r00 * g6 + r01 * g7 + r02 * g8, r10 * g0 + r11 * g1 + r12 * g2
        rotated[4, k], rotated[7, k] = r10 * g3 + r11 * g4 + r12 * g5, r10 * g6 + r11 * g7 + r12 * g8
        rotated[2, k], rotated[5, k] = r20 * g0 + r21 * g1 + r22 * g2, r20 * g3 + r21 * g4 + r22 * g5
        rotated[8, k] = r20 * g6 + r21 * g7 + r22 * g8


@numba.njit(cache=True, error_model="numpy", fastmath=ARITHMETIC)
def _polar_blocks(rotated, shares, count, mu, lam, pair, blocks):
    """Write the block V (2μ g·h I + λ g hᵀ) + [g]ᵀ M [h] of rotated gradients g and h; [g] is the matrix of g ×.

    M is what ``turned`` has written: the derivative of R turns by G⁻¹ times the axis of Rᵀ δF − δFᵀ R.
    """
    c, d = PAIRS[pair]
    for k in range(count):
        g0, g1, g2 = rotated[3 * c, k], rotated[3 * c + 1, k], rotated[3 * c + 2, k]
        h0, h1, h2 = rotated[3 * d, k], rotated[3 * d + 1, k], rotated[3 * d + 2, k]
        m00, m01, m02 = rotated[9, k], rotated[10, k], rotated[11, k]
        m11, m12, m22 = rotated[12, k], rotated[13, k], rotated[14, k]
        y00, y01, y02 = m01 * h2 - m02 * h1, m02 * h0 - m00 * h2, m00 * h1 - m01 * h0
        y10, y11, y12 = m11 * h2 - m12 * h1, m12 * h0 - m01 * h2, m01 * h1 - m11 * h0
        y20, y21, y22 = m12 * h2 - m22 * h1, m22 * h0 - m02 * h2, m02 * h1 - m12 * h0
        shear, volume = 2.0 * mu[k] * shares[k] * (g0 * h0 + g1 * h1 + g2 * h2), lam[k] * shares[k]
        h0, h1, h2 = volume * h0, volume * h1, volume * h2
        blocks[9 * pair, k] = shear + g0 * h0 + g2 * y10 - g1 * y20
        blocks[9 * pair + 1, k] = g0 * h1 + g2 * y11 - g1 * y21
        blocks[9 * pair + 2, k] = g0 * h2 + g2 * y12 - g1 * y22
        blocks[9 * pair + 3, k] = g1 * h0 + g0 * y20 - g2 * y00
        blocks[9 * pair + 4, k] = shear + g1 * h1 + g0 * y21 - g2 * y01
        blocks[9 * pair + 5, k] = g1 * h2 + g0 * y22 - g2 * y02
        blocks[9 * pair + 6, k] = g2 * h0 + g1 * y00 - g0 * y10
        blocks[9 * pair + 7, k] = g2 * h1 + g1 * y01 - g0 * y11
        blocks[9 * pair + 8, k] = shear + g2 * h2 + g1 * y02 - g0 * y12


@numba.njit(cache=True, error_model="numpy")
def _principal_blocks(f, gradients, share, k, mu, lam, definite, scratch, blocks):
    """Write the blocks of column ``k`` from the principal stretches; scratch : (7, 3, 3)."""
    matrix, u, v, curvatures = scratch[0], scratch[1], scratch[2], scratch[3]
    s, flips, twists = scratch[4, 0], scratch[4, 1], scratch[4, 2]
    decompose(f, k, matrix, u, s, v)
    may_be_negative = second(s, mu, lam, curvatures, flips, twists)
    if definite and may_be_negative:
        clamp(curvatures, flips, twists)
    elif definite:
        clamp_pairs(flips, twists)
    write_blocks(u, v, curvatures, flips, twists, gradients, share, k, scratch[5], scratch[6], blocks)
