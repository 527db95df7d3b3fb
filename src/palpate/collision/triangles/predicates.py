"""Exact signs of orientation determinants, for any finite coordinates.

A determinant is first computed in floating point, and its sign is accepted if it exceeds Shewchuk's bound on the
rounding error (Adaptive precision floating-point arithmetic and fast robust geometric predicates, 1997, section 4).
Otherwise it is expanded into products of coordinates, each an integer times a power of two, which are summed without
rounding in one fixed-point number wide enough for the product of any three doubles. So nothing can overflow or
underflow there, and no case is left undecided.
"""

import math

import numba
import numpy as np

LIMB = 27
"""Bits of a digit of the fixed-point number: 72 products of two digits fit in 64 bits."""
MASK = (1 << LIMB) - 1
LOWEST = 3 * 1126
"""Minus the exponent of the lowest bit of a product of three mantissas; 1126 = 1074 + 52, for subnormal numbers."""
BOUND_3D = (7.0 + 56.0 * 2.0**-53) * 2.0**-53
BOUND_2D = (3.0 + 16.0 * 2.0**-53) * 2.0**-53
UNDERFLOW = 1e-290
"""Added to the bounds: far above the underflow of products, and not subnormal itself, which would be slow."""
_TURNS = (((0, 1, 2), 1), ((1, 2, 0), 1), ((2, 0, 1), 1), ((0, 2, 1), -1), ((1, 0, 2), -1), ((2, 1, 0), -1))
TERMS_3D = np.array(
    [
        (side * turn, *(row + (row >= left_out) for row in rows))
        for left_out, side in enumerate((1, -1, 1, -1))
        for rows, turn in _TURNS
    ]
)
"""Sign, and the points that give x, y and z, of each product of the (4, 4) determinant with a column of ones."""
TERMS_2D = np.array([(1, 1, 2), (-1, 2, 1), (-1, 0, 2), (1, 2, 0), (1, 0, 1), (-1, 1, 0)])


@numba.njit(cache=True)
def new_accumulator() -> np.ndarray:
    """Allocate the fixed-point number that predicates sum in, (256,) int64: zero between calls, one per thread."""
    return np.zeros(256, dtype=np.int64)


@numba.njit(cache=True)
def orient3d(points, i, j, k, l, sums):  # noqa: E741
    """Find the sign of (pₗ − pᵢ) · ((pⱼ − pᵢ) × (pₖ − pᵢ)): the side of the plane i, j, k on which l lies.

    points : (n, 3), finite; sums : from ``new_accumulator``
    """
    ux, uy, uz = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
    vx, vy, vz = points[k, 0] - points[i, 0], points[k, 1] - points[i, 1], points[k, 2] - points[i, 2]
    wx, wy, wz = points[l, 0] - points[i, 0], points[l, 1] - points[i, 1], points[l, 2] - points[i, 2]
    a, b, c, d, e, f = uy * vz, uz * vy, uz * vx, ux * vz, ux * vy, uy * vx
    determinant = wx * (a - b) + wy * (c - d) + wz * (e - f)
    x, y, z = abs(wx), abs(wy), abs(wz)
    size = x * (abs(a) + abs(b)) + y * (abs(c) + abs(d)) + z * (abs(e) + abs(f))
    bound = BOUND_3D * size + UNDERFLOW * (x + y + z + 1.0)
    # false where anything overflowed
    if determinant > bound:
        return 1
    if -determinant > bound:
        return -1
    return _exact3d(points, (i, j, k, l), sums)


@numba.njit(cache=True)
def orient2d(points, i, j, k, axis, sums):
    """Find the sign of twice the area of points i, j, k projected along ``axis`` (0, 1 or 2 for x, y or z).

    points : (n, 3), finite; sums : from ``new_accumulator``
    """
    s, t = (axis + 1) % 3, (axis + 2) % 3
    left = (points[j, s] - points[i, s]) * (points[k, t] - points[i, t])
    right = (points[j, t] - points[i, t]) * (points[k, s] - points[i, s])
    bound = BOUND_2D * (abs(left) + abs(right)) + UNDERFLOW
    if left - right > bound:
        return 1
    if right - left > bound:
        return -1
    return _exact2d(points, (i, j, k), s, t, sums)


@numba.njit(cache=True)
def coincide(points, i, j):
    return points[i, 0] == points[j, 0] and points[i, 1] == points[j, 1] and points[i, 2] == points[j, 2]


@numba.njit(cache=True)
def _exact3d(points, chosen, sums):
    """Return the sign of the determinant of four points by exact summation; 0 where two of them coincide."""
    for p in range(3):
        for q in range(p + 1, 4):
            if coincide(points, chosen[p], chosen[q]):
                return 0
    lowest, highest = len(sums), 0
    for term in TERMS_3D:
        x, y, z = points[chosen[term[1]], 0], points[chosen[term[2]], 1], points[chosen[term[3]], 2]
        if x != 0.0 and y != 0.0 and z != 0.0:
            digit = _add_product(term[0], x, y, z, sums)
            lowest, highest = min(lowest, digit), max(highest, digit)
    return _take_sign(lowest, highest, sums)


@numba.njit(cache=True)
def _exact2d(points, chosen, s, t, sums):
    low, high = len(sums), 0
    for term in TERMS_2D:
        x, y = points[chosen[term[1]], s], points[chosen[term[2]], t]
        if x != 0.0 and y != 0.0:
            place = _add_product(term[0], x, y, 1.0, sums)
            low, high = min(low, place), max(high, place)
    return _take_sign(low, high, sums)


@numba.njit(cache=True)
def _integer_mantissa(x):
    """Split ``x`` into an integer mantissa and its exponent."""
    mantissa, exponent = math.frexp(x)
    return np.int64(mantissa * 9007199254740992.0), exponent - 53


@numba.njit(cache=True)
def _add_product(sign, x, y, z, sums):
    """Add ± x y z to ``sums`` without carries, for up to 24 products; return the index of its lowest digit."""
    x, power_x = _integer_mantissa(x)
    y, power_y = _integer_mantissa(y)
    z, power_z = _integer_mantissa(z)
    if (x < 0) != (y < 0):
        sign = -sign
    if z < 0:
        sign = -sign
    x, y, z = abs(x), abs(y), abs(z)
    digit, shift = divmod(power_x + power_y + power_z + LOWEST, LIMB)
    x0, x1, y0, y1 = x & MASK, x >> LIMB, y & MASK, y >> LIMB
    low, middle, high = x0 * y0, x0 * y1 + x1 * y0, x1 * y1
    middle += low >> LIMB
    high += middle >> LIMB
    xy = (low & MASK, middle & MASK, high & MASK, high >> LIMB)
    z0, z1, z2 = (z << shift) & MASK, (z >> (LIMB - shift)) & MASK, z >> (2 * LIMB - shift)
    for limb in range(4):
        sums[digit + limb] += sign * xy[limb] * z0
        sums[digit + limb + 1] += sign * xy[limb] * z1
        sums[digit + limb + 2] += sign * xy[limb] * z2
    return digit


@numba.njit(cache=True)
def _take_sign(lowest, highest, sums):
    """Return the sign of the number in ``sums``, to which products at digits lowest … highest were added; zero it."""
    carry, digits = np.int64(0), np.int64(0)
    for limb in range(lowest, highest + 9):
        value = sums[limb] + carry
        carry = value >> LIMB
        digits |= value & MASK
        sums[limb] = 0
    if carry != 0:
        return -1 if carry < 0 else 1
    return 1 if digits != 0 else 0
