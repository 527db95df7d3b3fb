"""Stresses and Hessians of any law at many deformation gradients, each of which is decomposed.

F is a sum Σ d_c g_cᵀ over three fixed vectors g_c, the gradients of an element's shape functions at its second to
fourth corner. A Hessian here is that of the energy with respect to the three d_c, in six blocks of 3 × 3: those of the
pairs PAIRS, as rows 9 p to 9 p + 8 of an array (54, BLOCK) whose columns are the deformation gradients.

Columns are worked on in groups that share the mean of their measure of volume: column k with k + n, k + 2 n …, n being
``count`` over ``group``. Groups of one are the plain law; those of an element's points are mean dilatation (Nagtegaal,
Parks, Rice 1974; Simo, Taylor, Pister 1985), Ψ = W + U(mean θ).
"""

import numba
import numpy as np

from palpate.linalg.polar import signed_svd

PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
"""The pairs of gradients whose blocks are kept; the others are transposes."""


@numba.njit(cache=True, error_model="numpy")
def write_blocks(u, v, hessian, flips, twists, gradients, share, k, h, b, blocks):
    """Write the Hessian of column ``k``, F = U diag(s) Vᵀ, to ``blocks``; share : its volume [m³]; h, b : scratch.

    With h = Vᵀ g the block of gradients g and g' is U b Uᵀ. bᵢⱼ is ``share`` ∂²Ψ/∂sᵢ∂sⱼ hᵢ h'ⱼ; for axes i, j, flip and
    twist (see ``corotational``) add share/2 (flip + twist) hⱼ h'ⱼ to bᵢᵢ, share/2 (flip − twist) hⱼ h'ᵢ to bᵢⱼ.
    """
    for c in range(3):
        for i in range(3):
            h[c, i] = (
                gradients[3 * c, k] * v[0, i] + gradients[3 * c + 1, k] * v[1, i] + gradients[3 * c + 2, k] * v[2, i]
            )
    for pair in range(6):
        c, d = PAIRS[pair]
        for i in range(3):
            for j in range(3):
                b[i, j] = share * hessian[i, j] * h[c, i] * h[d, j]
        for axis in range(3):
            i, j = (axis + 1) % 3, (axis + 2) % 3
            diagonal = 0.5 * share * (flips[axis] + twists[axis])
            crossed = 0.5 * share * (flips[axis] - twists[axis])
            b[i, i] += diagonal * h[c, j] * h[d, j]
            b[j, j] += diagonal * h[c, i] * h[d, i]
            b[i, j] += crossed * h[c, j] * h[d, i]
            b[j, i] += crossed * h[c, i] * h[d, j]
        for i in range(3):
            ub0 = u[i, 0] * b[0, 0] + u[i, 1] * b[1, 0] + u[i, 2] * b[2, 0]
            ub1 = u[i, 0] * b[0, 1] + u[i, 1] * b[1, 1] + u[i, 2] * b[2, 1]
            ub2 = u[i, 0] * b[0, 2] + u[i, 1] * b[1, 2] + u[i, 2] * b[2, 2]
            for j in range(3):
                blocks[9 * pair + 3 * i + j, k] = ub0 * u[j, 0] + ub1 * u[j, 1] + ub2 * u[j, 2]


@numba.njit(cache=True, error_model="numpy")
def clamp(hessian, flips, twists):
    """Replace the negative eigenvalues of what a Hessian consists of by zero, in place."""
    values, vectors = np.linalg.eigh(hessian)
    hessian[:] = (vectors * np.maximum(values, 0.0)) @ vectors.T
    clamp_pairs(flips, twists)


@numba.njit(cache=True, error_model="numpy")
def clamp_pairs(flips, twists):
    """Replace negative ``flips`` and ``twists`` by zero, in place."""
    for axis in range(3):
        flips[axis], twists[axis] = max(flips[axis], 0.0), max(twists[axis], 0.0)


EQUAL_STRETCHES = 1e-5
"""Stretches whose difference is below this part of them count as equal; limits then replace quotients, to 1e-10."""


@numba.njit(cache=True, error_model="numpy")
def stresses(f, p, count, group, mu, lam, shape, measure, volume, energies):
    """Write P = ∂Ψ/∂F [Pa] of the first ``count`` columns of ``f`` into ``p``, and Ψ [J/m³] into ``energies``.

    f, p : (9, BLOCK); mu, lam : (count,) [Pa], the same in a group k of columns q; rates, derivatives : ∂θ/∂s; U′, U″
    """
    matrix, u, v, s = np.empty((3, 3)), np.empty((group, 3, 3)), np.empty((group, 3, 3)), np.empty((group, 3))
    gradient, rates, unused, derivatives = np.empty((group, 3)), np.empty((group, 3)), np.empty((3, 3)), np.empty(2)
    stride = count // group
    for k in range(stride):
        mean = 0.0
        for q in range(group):
            decompose(f, q * stride + k, matrix, u[q], s[q], v[q])
            energies[q * stride + k] = shape(s[q], mu[k], gradient[q], unused)
            mean += measure(s[q], rates[q], unused) / group
        energy = volume(mean, mu[k], lam[k], derivatives)
        for q in range(group):
            energies[q * stride + k] += energy
            for i in range(3):
                gradient[q, i] += derivatives[0] * rates[q, i]
            turn(u[q], gradient[q], v[q], p, q * stride + k)


@numba.njit(cache=True, error_model="numpy")
def hessians(f, gradients, shares, count, group, mu, lam, shape, measure, volume, definite, blocks, pulls, stiffnesses):
    """Write the Hessians of the first ``count`` columns of ``f`` (9, BLOCK) into ``blocks`` (54, BLOCK) [N/m].

    gradients : (9, BLOCK), the three vectors g of each column [1/m]; shares : (BLOCK,), their volumes [m³]
    definite : replaces negative eigenvalues by zero (Smith, de Goes, Kim 2019, section 5)
    pulls, stiffnesses : in groups of more than one the blocks lack U″ of the mean; ∂θ/∂F of each column is written to
        ``pulls`` (9, BLOCK), and U″ of each group to ``stiffnesses`` (BLOCK,) [Pa]
    """
    matrix, u, v, s = np.empty((3, 3)), np.empty((group, 3, 3)), np.empty((group, 3, 3)), np.empty((group, 3))
    gradient, rates = np.empty((group, 3)), np.empty((group, 3))
    second, curves = np.empty((group, 3, 3)), np.empty((group, 3, 3))
    derivatives, flips, twists, h, b = np.empty(2), np.empty(3), np.empty(3), np.empty((3, 3)), np.empty((3, 3))
    stride = count // group
    for k in range(stride):
        mean = 0.0
        for q in range(group):
            decompose(f, q * stride + k, matrix, u[q], s[q], v[q])
            shape(s[q], mu[k], gradient[q], second[q])
            mean += measure(s[q], rates[q], curves[q]) / group
        volume(mean, mu[k], lam[k], derivatives)
        if definite:
            derivatives[1] = max(derivatives[1], 0.0) if group > 1 else derivatives[1]
        stiffnesses[k] = derivatives[1]
        for q in range(group):
            column = q * stride + k
            _add_volume(gradient[q], second[q], rates[q], curves[q], derivatives, flips, twists, s[q], group == 1)
            if definite and not _positive(second[q]):
                clamp(second[q], flips, twists)
            elif definite:
                clamp_pairs(flips, twists)
            write_blocks(u[q], v[q], second[q], flips, twists, gradients, shares[column], column, h, b, blocks)
            if group > 1:
                turn(u[q], rates[q], v[q], pulls, column)


@numba.njit(cache=True, error_model="numpy")
def density(s, mu, lam, shape, measure, volume, gradient, hessian):
    """Return Ψ [J/m³] at the stretches ``s`` (3,), and write ∂Ψ/∂s and ∂²Ψ/∂s² [Pa]."""
    rates, bends, derivatives, unused = np.empty(3), np.empty((3, 3)), np.empty(2), np.empty(3)
    energy = shape(s, mu, gradient, hessian)
    energy += volume(measure(s, rates, bends), mu, lam, derivatives)
    _add_volume(gradient, hessian, rates, bends, derivatives, unused, unused, s, True)
    return energy


@numba.njit(cache=True, error_model="numpy")
def _add_volume(gradient, second, rates, bends, derivatives, flips, twists, s, plain):
    """Add the derivatives of U(θ) by s to those of W, and write flips and twists, which ``corotational`` explains.

    rates, bends : ∂θ/∂s, ∂²θ/∂s²; derivatives : U′, U″; plain : adds the term of U″, too, which no flip or twist has
    """
    for i in range(3):
        gradient[i] += derivatives[0] * rates[i]
        for j in range(3):
            second[i, j] += derivatives[0] * bends[i, j]
    for axis in range(3):
        i, j = (axis + 1) % 3, (axis + 2) % 3
        difference, total, least = s[i] - s[j], s[i] + s[j], EQUAL_STRETCHES * (abs(s[i]) + abs(s[j]))
        diagonal = 0.5 * (second[i, i] + second[j, j])
        flips[axis] = (gradient[i] - gradient[j]) / difference if abs(difference) > least else diagonal - second[i, j]
        twists[axis] = (gradient[i] + gradient[j]) / total if abs(total) > least else diagonal + second[i, j]
    if plain:
        for i in range(3):
            for j in range(3):
                second[i, j] += derivatives[1] * rates[i] * rates[j]


@numba.njit(cache=True, error_model="numpy")
def decompose(f, column, given, u, s, v):
    """Write the signed singular value decomposition of a column of ``f``; given : (3, 3), scratch."""
    for i in range(9):
        given[i // 3, i % 3] = f[i, column]
    signed_svd(given, u, s, v)


@numba.njit(cache=True, error_model="numpy")
def turn(u, principal, v, out, k):
    """Write U diag(principal) Vᵀ into column ``k`` of ``out`` (9, BLOCK)."""
    for i in range(3):
        for j in range(3):
            sum_of_two = u[i, 0] * principal[0] * v[j, 0] + u[i, 1] * principal[1] * v[j, 1]
            out[3 * i + j, k] = sum_of_two + u[i, 2] * principal[2] * v[j, 2]


@numba.njit(cache=True, error_model="numpy")
def _positive(a):
    """Return whether the symmetric ``a`` (3, 3) is positive definite."""
    minor = a[0, 0] * a[1, 1] - a[0, 1] * a[0, 1]
    det = a[2, 2] * minor - a[1, 2] * (a[0, 0] * a[1, 2] - a[0, 1] * a[0, 2])
    det += a[0, 2] * (a[0, 1] * a[1, 2] - a[1, 1] * a[0, 2])
    return a[0, 0] > 0.0 and minor > 0.0 and det > 0.0


@numba.njit(cache=True, error_model="numpy")
def add_blocks(hessians, slots, begin, count, a, b, values):
    """Add the ``hessians`` (9, m) of the nodes ``a`` and ``b`` of ``count`` elements from ``begin`` on to ``values``.

    slots : (n_elements, k, k) the places of blocks in ``values``; what belongs to ``b`` and ``a`` is the transpose
    """
    for e in range(count):
        slot, transposed = slots[begin + e, a, b], slots[begin + e, b, a]
        for i in range(3):
            for j in range(3):
                values[slot, i, j] += hessians[3 * i + j, e]
                if a != b:
                    values[transposed, j, i] += hessians[3 * i + j, e]
