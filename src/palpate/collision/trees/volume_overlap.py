"""Overlap of two bounding volumes: the numba kernels of a search's inner loop."""

import numba

SPHERE, BOTH, AABB, OBB, DOP14, DOP18 = range(6)
"""Kinds of a node's volume; BOTH, a sphere and an AABB, is a composite tree's middle layer."""
PARALLEL = 1e-12
"""Slack in the OBB's separating axes, relative to its half lengths: the cross product of parallel axes is noise."""


@numba.njit(cache=True, forceinline=True)
def volumes_overlap(kind_a, kind_b, spheres_a, spheres_b, boxes_a, boxes_b, a, b):
    """Test whether nodes ``a`` and ``b`` of two trees overlap, by the rule of paper 3, chapter 4.

    Sphere–sphere if both have spheres, AABB–AABB if both have boxes, else sphere–AABB; other kinds only with their own.
    Trap: numba counts references to arrays at every call and view; one here makes a search ten times as long.
    """
    if kind_a <= BOTH and kind_b <= BOTH:
        x, y = spheres_a[a, 0] - spheres_b[b, 0], spheres_a[a, 1] - spheres_b[b, 1]
        z, reach = spheres_a[a, 2] - spheres_b[b, 2], spheres_a[a, 3] + spheres_b[b, 3]
        return not x * x + y * y + z * z > reach * reach
    if kind_a <= AABB and kind_a != SPHERE and kind_b != SPHERE:
        if boxes_a[a, 0] > boxes_b[b, 3] or boxes_b[b, 0] > boxes_a[a, 3]:
            return False
        if boxes_a[a, 1] > boxes_b[b, 4] or boxes_b[b, 1] > boxes_a[a, 4]:
            return False
        return not (boxes_a[a, 2] > boxes_b[b, 5] or boxes_b[b, 2] > boxes_a[a, 5])
    if kind_a == SPHERE:
        return _sphere_overlaps_box(
            _triple(spheres_a, a, 0), spheres_a[a, 3], _triple(boxes_b, b, 0), _triple(boxes_b, b, 3)
        )
    if kind_b == SPHERE:
        return _sphere_overlaps_box(
            _triple(spheres_b, b, 0), spheres_b[b, 3], _triple(boxes_a, a, 0), _triple(boxes_a, a, 3)
        )
    if kind_a == OBB:
        return _obbs_overlap(
            (boxes_a[a, 0] - boxes_b[b, 0], boxes_a[a, 1] - boxes_b[b, 1], boxes_a[a, 2] - boxes_b[b, 2]),
            (_triple(boxes_a, a, 3), _triple(boxes_a, a, 6), _triple(boxes_a, a, 9)),
            (_triple(boxes_b, b, 3), _triple(boxes_b, b, 6), _triple(boxes_b, b, 9)),
            _triple(boxes_a, a, 12),
            _triple(boxes_b, b, 12),
        )
    half = boxes_a.shape[1] // 2
    for k in range(half):  # noqa: SIM110
        if boxes_a[a, k] > boxes_b[b, half + k] or boxes_b[b, k] > boxes_a[a, half + k]:
            return False
    return True


@numba.njit(cache=True, forceinline=True)
def _triple(rows, n, k):
    return rows[n, k], rows[n, k + 1], rows[n, k + 2]


@numba.njit(cache=True)
def _sphere_overlaps_box(centre, radius, low, high):
    """Test whether the nearest point of a box is within the radius (Arvo 1990)."""
    x = max(low[0] - centre[0], centre[0] - high[0], 0.0)
    y = max(low[1] - centre[1], centre[1] - high[1], 0.0)
    z = max(low[2] - centre[2], centre[2] - high[2], 0.0)
    return not x * x + y * y + z * z > radius * radius


@numba.njit(cache=True)
def _obbs_overlap(offset, u, v, a, b):
    """Test 15 separating axes (Gottschalk, Lin, Manocha 1996): axes ``u``, ``v`` (3, 3), half lengths ``a``, ``b``."""
    (r00, r01, r02), (r10, r11, r12), (r20, r21, r22) = _products(u[0], v), _products(u[1], v), _products(u[2], v)
    s00, s01, s02 = abs(r00) + PARALLEL, abs(r01) + PARALLEL, abs(r02) + PARALLEL
    s10, s11, s12 = abs(r10) + PARALLEL, abs(r11) + PARALLEL, abs(r12) + PARALLEL
    s20, s21, s22 = abs(r20) + PARALLEL, abs(r21) + PARALLEL, abs(r22) + PARALLEL
    t0, t1, t2 = _products(offset, u)
    apart = abs(t0) > a[0] + b[0] * s00 + b[1] * s01 + b[2] * s02
    apart |= abs(t1) > a[1] + b[0] * s10 + b[1] * s11 + b[2] * s12
    apart |= abs(t2) > a[2] + b[0] * s20 + b[1] * s21 + b[2] * s22
    apart |= abs(t0 * r00 + t1 * r10 + t2 * r20) > b[0] + a[0] * s00 + a[1] * s10 + a[2] * s20
    apart |= abs(t0 * r01 + t1 * r11 + t2 * r21) > b[1] + a[0] * s01 + a[1] * s11 + a[2] * s21
    apart |= abs(t0 * r02 + t1 * r12 + t2 * r22) > b[2] + a[0] * s02 + a[1] * s12 + a[2] * s22
    if apart:
        return False
    apart |= abs(t2 * r10 - t1 * r20) > a[1] * s20 + a[2] * s10 + b[1] * s02 + b[2] * s01
    apart |= abs(t2 * r11 - t1 * r21) > a[1] * s21 + a[2] * s11 + b[0] * s02 + b[2] * s00
    apart |= abs(t2 * r12 - t1 * r22) > a[1] * s22 + a[2] * s12 + b[0] * s01 + b[1] * s00
    apart |= abs(t0 * r20 - t2 * r00) > a[0] * s20 + a[2] * s00 + b[1] * s12 + b[2] * s11
    apart |= abs(t0 * r21 - t2 * r01) > a[0] * s21 + a[2] * s01 + b[0] * s12 + b[2] * s10
    apart |= abs(t0 * r22 - t2 * r02) > a[0] * s22 + a[2] * s02 + b[0] * s11 + b[1] * s10
    apart |= abs(t1 * r00 - t0 * r10) > a[0] * s10 + a[1] * s00 + b[1] * s22 + b[2] * s21
    apart |= abs(t1 * r01 - t0 * r11) > a[0] * s11 + a[1] * s01 + b[0] * s22 + b[2] * s20
    apart |= abs(t1 * r02 - t0 * r12) > a[0] * s12 + a[1] * s02 + b[0] * s21 + b[1] * s20
    return not apart


@numba.njit(cache=True)
def _products(t, u):
    return (
        t[0] * u[0][0] + t[1] * u[0][1] + t[2] * u[0][2],
        t[0] * u[1][0] + t[1] * u[1][1] + t[2] * u[1][2],
        t[0] * u[2][0] + t[1] * u[2][1] + t[2] * u[2][2],
    )
