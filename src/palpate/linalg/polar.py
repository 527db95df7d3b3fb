"""The rotation nearest to a 3 × 3 matrix: fast where it is unique, safe everywhere; the signed singular values.

R maximises tr(RᵀA). Newton's method on the unit quaternion of R converges cubically, and its result can be verified:
S = RᵀA is symmetric, and tr(S) I − S is positive definite, at the maximum only, where its eigenvalues are the sums of
two of A's signed singular values. A matrix without such a certificate is left to a Jacobi decomposition.
"""

import math

import numba
import numpy as np

from palpate.errors import InputError


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
    """Turn the orthogonal columns of ``u`` (3, 3), of lengths ``s`` (3,), into a rotation; set s₃ with its sign."""
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


CERTAIN = 1e-6
"""Newton's result is accepted if (s₁ + s₂)(s₂ + s₃)(s₃ + s₁) exceeds this fraction of (2 tr S)³: then the least
eigenvalue, s₂ + s₃, is above 8e-6 tr S, and a last rotation by 1e-6 rad cannot have changed its sign."""


def nearest_rotation(matrix: np.ndarray) -> np.ndarray:
    """Return the rotation (3, 3) nearest to ``matrix`` (3, 3) of any unit: U diag(1, 1, det U det V) Vᵀ.

    Müller, Heidelberger, Teschner, Gross 2005, section 3.3. Trap: where s₂ + s₃ = 0, with s₃ < 0 if det A < 0,
    several are equally near, and one of them is returned; the error grows like 1/(s₂ + s₃).
    Raises InputError for NaN or infinite entries.
    """
    if not np.isfinite(matrix).all():
        raise InputError("a matrix holds NaN or infinite entries, and so has no nearest rotation: leave it out.")
    rotation, no_guess = np.empty((3, 3)), np.zeros(4)
    nearest(np.ascontiguousarray(matrix, dtype=float), no_guess, np.empty((4, 3, 3)), rotation)
    return rotation


@numba.njit(cache=True, error_model="numpy")
def nearest(a, turn, work, out):
    """Write the rotation nearest to ``a`` (3, 3) into ``out`` (3, 3), starting from the quaternion ``turn`` (4,).

    ``turn`` is overwritten with the result, for the next call with a similar matrix; a first entry of 0 means no guess.
    work : (4, 3, 3), scratch
    """
    largest_entry = 0.0
    for i in range(3):
        for j in range(3):
            largest_entry = max(largest_entry, abs(a[i, j]))
    if not 1e-50 < largest_entry < 1e50:  # scale by a power of two, which is exact; in two factors, as 2^1073 overflows
        exponent = -math.frexp(largest_entry)[1]
        factor, rest_of_factor = math.ldexp(1.0, exponent // 2), math.ldexp(1.0, exponent - exponent // 2)
        for i in range(3):
            for j in range(3):
                work[3, i, j] = a[i, j] * factor * rest_of_factor
        a = work[3]
    if turn[0] != 0.0 and _newton(a, turn, out):
        return
    if _guess(a, turn, out) and _newton(a, turn, out):
        return
    u, v, s = work[0], work[1], work[2, 0]
    signed_svd(a, u, s, v)
    for i in range(3):
        for j in range(3):
            out[i, j] = u[i, 0] * v[j, 0] + u[i, 1] * v[j, 1] + u[i, 2] * v[j, 2]
    _quaternion(out, turn)


@numba.njit(cache=True, error_model="numpy")
def _newton(a, turn, r):
    """Improve the quaternion ``turn`` until its R maximises tr(RᵀA), and write R into ``r``; False if not certain.

    s : RᵀA; m : tr(S) I − S, made symmetric; c : cofactors of m, so that the next turn is c/det m times the axis of S
    """
    for _ in range(6):
        _matrix(turn, r)
        s00 = r[0, 0] * a[0, 0] + r[1, 0] * a[1, 0] + r[2, 0] * a[2, 0]
        s11 = r[0, 1] * a[0, 1] + r[1, 1] * a[1, 1] + r[2, 1] * a[2, 1]
        s22 = r[0, 2] * a[0, 2] + r[1, 2] * a[1, 2] + r[2, 2] * a[2, 2]
        s01 = r[0, 0] * a[0, 1] + r[1, 0] * a[1, 1] + r[2, 0] * a[2, 1]
        s10 = r[0, 1] * a[0, 0] + r[1, 1] * a[1, 0] + r[2, 1] * a[2, 0]
        s02 = r[0, 0] * a[0, 2] + r[1, 0] * a[1, 2] + r[2, 0] * a[2, 2]
        s20 = r[0, 2] * a[0, 0] + r[1, 2] * a[1, 0] + r[2, 2] * a[2, 0]
        s12 = r[0, 1] * a[0, 2] + r[1, 1] * a[1, 2] + r[2, 1] * a[2, 2]
        s21 = r[0, 2] * a[0, 1] + r[1, 2] * a[1, 1] + r[2, 2] * a[2, 1]
        m00, m11, m22 = s11 + s22, s00 + s22, s00 + s11
        m01, m02, m12 = -0.5 * (s01 + s10), -0.5 * (s02 + s20), -0.5 * (s12 + s21)
        c00, c11, c22 = m11 * m22 - m12 * m12, m00 * m22 - m02 * m02, m00 * m11 - m01 * m01
        c01, c02, c12 = m02 * m12 - m01 * m22, m01 * m12 - m02 * m11, m01 * m02 - m00 * m12
        det, trace = m00 * c00 + m01 * c01 + m02 * c02, m00 + m11 + m22
        if not (m00 > 0.0 and c22 > 0.0 and det > CERTAIN * trace * trace * trace):
            return False
        x, y, z = 0.5 / det * (s21 - s12), 0.5 / det * (s02 - s20), 0.5 / det * (s10 - s01)
        x, y, z = c00 * x + c01 * y + c02 * z, c01 * x + c11 * y + c12 * z, c02 * x + c12 * y + c22 * z
        square = x * x + y * y + z * z  # of half the remaining angle
        w, i, j, k = turn[0], turn[1], turn[2], turn[3]
        turn[0], turn[1] = w - i * x - j * y - k * z, i + w * x + j * z - k * y
        turn[2], turn[3] = j + w * y + k * x - i * z, k + w * z + i * y - j * x
        norm = 1.0 / math.sqrt(turn[0] ** 2 + turn[1] ** 2 + turn[2] ** 2 + turn[3] ** 2)
        for n in range(4):
            turn[n] *= norm
        if square < 2.5e-13:  # a rotation by 1e-6 rad; the remaining error is its cube
            _matrix(turn, r)
            return True
    return False


@numba.njit(cache=True, error_model="numpy")
def _guess(a, turn, r):
    """Write the quaternion of the rotation R nearest to A, for Newton's method to start at; False if R is not certain.

    R = ((κ + ‖A‖²) A + λ cof A − A Aᵀ A)/ζ with λ = s₁ + s₂ + s₃ (Markley 1993, eq. 15), where λ is the largest root of
    (λ² − ‖A‖²)² − 8 λ det A − 4 ‖cof A‖², κ = (λ² − ‖A‖²)/2 and ζ = κ λ − det A.
    """
    c00, c01 = a[1, 1] * a[2, 2] - a[1, 2] * a[2, 1], a[1, 2] * a[2, 0] - a[1, 0] * a[2, 2]
    c02, c10 = a[1, 0] * a[2, 1] - a[1, 1] * a[2, 0], a[0, 2] * a[2, 1] - a[0, 1] * a[2, 2]
    c11, c12 = a[0, 0] * a[2, 2] - a[0, 2] * a[2, 0], a[0, 1] * a[2, 0] - a[0, 0] * a[2, 1]
    c20, c21 = a[0, 1] * a[1, 2] - a[0, 2] * a[1, 1], a[0, 2] * a[1, 0] - a[0, 0] * a[1, 2]
    c22 = a[0, 0] * a[1, 1] - a[0, 1] * a[1, 0]
    det = a[0, 0] * c00 + a[0, 1] * c01 + a[0, 2] * c02
    minors = c00**2 + c01**2 + c02**2 + c10**2 + c11**2 + c12**2 + c20**2 + c21**2 + c22**2
    g00, g11 = a[0, 0] ** 2 + a[0, 1] ** 2 + a[0, 2] ** 2, a[1, 0] ** 2 + a[1, 1] ** 2 + a[1, 2] ** 2
    g22 = a[2, 0] ** 2 + a[2, 1] ** 2 + a[2, 2] ** 2
    square = g00 + g11 + g22
    # from above, Newton's method for a polynomial with real roots never overshoots
    root = math.sqrt(min(3.0 * square, square + math.sqrt(12.0 * minors)))
    for _ in range(12):
        excess = root * root - square
        change = (excess * excess - 8.0 * root * det - 4.0 * minors) / (4.0 * root * excess - 8.0 * det)
        root -= change
        if not abs(change) > 1e-4 * root:
            break
    kappa = 0.5 * (root * root - square)
    zeta = kappa * root - det
    if not zeta > CERTAIN * root**3:
        return False
    kappa += square
    g01 = a[0, 0] * a[1, 0] + a[0, 1] * a[1, 1] + a[0, 2] * a[1, 2]
    g02 = a[0, 0] * a[2, 0] + a[0, 1] * a[2, 1] + a[0, 2] * a[2, 2]
    g12 = a[1, 0] * a[2, 0] + a[1, 1] * a[2, 1] + a[1, 2] * a[2, 2]
    for j, x, y, z in ((0, c00, c10, c20), (1, c01, c11, c21), (2, c02, c12, c22)):
        r[0, j] = ((kappa - g00) * a[0, j] + root * x - g01 * a[1, j] - g02 * a[2, j]) / zeta
        r[1, j] = ((kappa - g11) * a[1, j] + root * y - g01 * a[0, j] - g12 * a[2, j]) / zeta
        r[2, j] = ((kappa - g22) * a[2, j] + root * z - g02 * a[0, j] - g12 * a[1, j]) / zeta
    _quaternion(r, turn)
    return True


@numba.njit(cache=True, error_model="numpy")
def _matrix(turn, r):
    w, x, y, z = turn[0], turn[1], turn[2], turn[3]
    r[0, 0], r[1, 1], r[2, 2] = 1 - 2 * (y * y + z * z), 1 - 2 * (x * x + z * z), 1 - 2 * (x * x + y * y)
    r[0, 1], r[1, 0] = 2 * (x * y - w * z), 2 * (x * y + w * z)
    r[0, 2], r[2, 0] = 2 * (x * z + w * y), 2 * (x * z - w * y)
    r[1, 2], r[2, 1] = 2 * (y * z - w * x), 2 * (y * z + w * x)


@numba.njit(cache=True, error_model="numpy")
def _quaternion(r, turn):
    """Compute the unit quaternion of a rotation or nearly one, from its largest entry: accurate near half a turn."""
    trace = r[0, 0] + r[1, 1] + r[2, 2]
    if trace > 0.0:
        turn[0] = 1.0 + trace
        turn[1], turn[2], turn[3] = r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]
    else:
        i = 0
        if r[1, 1] > r[0, 0]:
            i = 1
        if r[2, 2] > r[i, i]:
            i = 2
        j, k = (i + 1) % 3, (i + 2) % 3
        turn[0], turn[1 + i] = r[k, j] - r[j, k], 1.0 + r[i, i] - r[j, j] - r[k, k]
        turn[1 + j], turn[1 + k] = r[j, i] + r[i, j], r[k, i] + r[i, k]
    norm = 1.0 / math.sqrt(turn[0] ** 2 + turn[1] ** 2 + turn[2] ** 2 + turn[3] ** 2)
    for n in range(4):
        turn[n] *= norm


@numba.njit(cache=True)
def compose(u, s, v, product):
    """Write U diag(s) Vᵀ into ``product``."""
    for i in range(3):
        for j in range(3):
            product[i, j] = u[i, 0] * s[0] * v[j, 0] + u[i, 1] * s[1] * v[j, 1] + u[i, 2] * s[2] * v[j, 2]


@numba.njit(cache=True)
def multiply(left, right, product):
    """Write the first three columns of ``left`` times ``right`` into ``product``."""
    for i in range(3):
        for j in range(3):
            product[i, j] = left[i, 0] * right[0, j] + left[i, 1] * right[1, j] + left[i, 2] * right[2, j]
