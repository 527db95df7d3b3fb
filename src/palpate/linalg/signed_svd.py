"""Signed singular value decomposition of 3 × 3 matrices, safe for inverted and collapsed elements."""

import numba
import numpy as np


@numba.njit(cache=True, error_model="numpy")
def signed_svd(f, u, s, v):
    """Write F = U diag(s) Vᵀ with U and V proper rotations and s₁ ≥ s₂ ≥ |s₃|, into ``u, s, v``.

    f, u, v : (3, 3); s : (3,)

    Only s₃ is negative if det F < 0 (Irving, Teran, Fedkiw 2004), so that R = U Vᵀ is the rotation nearest to F even
    for an inverted element. One-sided Jacobi rotations keep small singular values accurate, which the eigenvalues of
    FᵀF would not. It never divides by zero: missing directions are completed.
    """
    for i in range(3):
        for j in range(3):
            u[i, j] = f[i, j]
            v[i, j] = 1.0 if i == j else 0.0
    for _ in range(30):
        rotated = False
        for p in range(2):
            for q in range(p + 1, 3):
                alpha = u[0, p] * u[0, p] + u[1, p] * u[1, p] + u[2, p] * u[2, p]
                beta = u[0, q] * u[0, q] + u[1, q] * u[1, q] + u[2, q] * u[2, q]
                gamma = u[0, p] * u[0, q] + u[1, p] * u[1, q] + u[2, p] * u[2, q]
                if abs(gamma) > 1e-16 * np.sqrt(alpha * beta) and abs(gamma) > 1e-300:
                    rotated = True
                    zeta = (beta - alpha) / (2.0 * gamma)
                    t = (1.0 if zeta >= 0.0 else -1.0) / (abs(zeta) + np.sqrt(1.0 + zeta * zeta))
                    c = 1.0 / np.sqrt(1.0 + t * t)
                    sine = c * t
                    for i in range(3):
                        a, b = u[i, p], u[i, q]
                        u[i, p], u[i, q] = c * a - sine * b, sine * a + c * b
                        a, b = v[i, p], v[i, q]
                        v[i, p], v[i, q] = c * a - sine * b, sine * a + c * b
        if not rotated:
            break
    for j in range(3):
        s[j] = np.sqrt(u[0, j] * u[0, j] + u[1, j] * u[1, j] + u[2, j] * u[2, j])
    for a, b in ((0, 1), (1, 2), (0, 1)):
        if s[a] < s[b]:
            s[a], s[b] = s[b], s[a]
            for i in range(3):  # a swap with one change of sign keeps V a rotation
                u[i, a], u[i, b] = u[i, b], -u[i, a]
                v[i, a], v[i, b] = v[i, b], -v[i, a]
    _complete(u, s)


@numba.njit(cache=True, error_model="numpy")
def _complete(u, s):
    """Turn the orthogonal columns of ``u``, of lengths ``s``, into a rotation, and set the sign of s₃."""
    if s[0] <= 1e-300:
        for i in range(3):
            for j in range(3):
                u[i, j] = 1.0 if i == j else 0.0
        s[:] = 0.0
        return
    for i in range(3):
        u[i, 0] /= s[0]
    if s[1] > 1e-14 * s[0]:
        for i in range(3):
            u[i, 1] /= s[1]
    else:  # rank one: any direction normal to the first, near the axis of its smallest component
        k = 0
        for i in range(1, 3):
            if abs(u[i, 0]) < abs(u[k, 0]):
                k = i
        length = np.sqrt(max(0.0, 1.0 - u[k, 0] * u[k, 0]))
        for i in range(3):
            u[i, 1] = ((1.0 if i == k else 0.0) - u[k, 0] * u[i, 0]) / length
        s[1] = 0.0
    x = u[1, 0] * u[2, 1] - u[2, 0] * u[1, 1]
    y = u[2, 0] * u[0, 1] - u[0, 0] * u[2, 1]
    z = u[0, 0] * u[1, 1] - u[1, 0] * u[0, 1]
    s[2] = x * u[0, 2] + y * u[1, 2] + z * u[2, 2]
    u[0, 2], u[1, 2], u[2, 2] = x, y, z
