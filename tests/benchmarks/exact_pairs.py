"""Compare the triangle pairs found to intersect with those found in whole numbers by another method.

`make bench` runs this in the project's folder: a million pairs, most of them degenerate, each in all its 72 orders.
The exit code is 1 if a single answer differs.
"""

import os
import sys
from itertools import combinations, permutations

from palpate.run.job import kernel_cache

os.environ["NUMBA_CACHE_DIR"] = str(kernel_cache())  # read when numba is imported

import numpy as np

from palpate.collision.triangles.intersection import pairs_intersect

BATCH = 10_000
ORDERS = [(p, q) for p in permutations(range(3)) for q in permutations(range(3, 6))]
SHORT = 13
"""Bits of coordinates with which ``parted`` stays within 64: it multiplies four differences, and sums 18 products."""


def generic(rng, n):
    return rng.normal(size=(n, 6, 3))


def lattice(rng, n):
    return rng.integers(0, rng.integers(2, 9, (n, 1, 1)), (n, 6, 3)).astype(float)


def shared_vertex(rng, n):
    pairs = generic(rng, n)
    pairs[:, 3] = pairs[:, 0]
    return pairs


def shared_edge(rng, n):
    pairs = shared_vertex(rng, n)
    pairs[:, 4] = pairs[:, 1]
    return pairs


def coplanar(rng, n, apart=0):
    """On a plane through lattice points, in a frame of two vectors; b is moved by up to ``apart`` times these."""
    frame = rng.integers(-9, 10, (n, 2, 3))
    at = rng.integers(-4, 5, (n, 6, 2))
    at[:, 3:] += apart * rng.integers(-1, 2, (n, 1, 2))
    return (rng.integers(-99, 100, (n, 1, 3)) + at @ frame).astype(float)


def coplanar_apart(rng, n):
    return coplanar(rng, n, apart=8)


def vertex_on_face(rng, n):
    pairs = 16 * rng.integers(-20, 21, (n, 6, 3))
    weights = np.sort(rng.integers(-1, 18, (n, 2)), axis=1)
    weights = np.column_stack([weights[:, 0], weights[:, 1] - weights[:, 0], 16 - weights[:, 1]])
    pairs[:, 3] = np.einsum("nk,nkc->nc", weights, pairs[:, :3]) // 16
    return pairs.astype(float)


def edge_through_vertex(rng, n):
    pairs = rng.integers(-50, 51, (n, 6, 3))
    way = rng.integers(-9, 10, (n, 3))
    pairs[:, 3] = pairs[:, 0] + rng.integers(0, 5, (n, 1)) * way
    pairs[:, 4] = pairs[:, 0] - rng.integers(-1, 5, (n, 1)) * way
    return pairs.astype(float)


def zero_area(rng, n):
    """Points, segments and three corners on a line, for one triangle or both, on a small lattice."""
    pairs = rng.integers(-2, 3, (n, 6, 3))
    for first, shape in ((0, rng.integers(0, 4, n)), (3, rng.integers(0, 3, n))):
        pairs[shape < 2, first + 2] = pairs[shape < 2, first + 1]
        pairs[shape == 0, first + 1] = pairs[shape == 0, first + 2] = pairs[shape == 0, first]
        on_line = 2 * pairs[:, first + 1] - pairs[:, first]
        pairs[shape == 2, first + 2] = on_line[shape == 2]
    return pairs.astype(float)


def degenerate(rng, n):
    parts = (shared_vertex, shared_edge, coplanar, coplanar_apart, vertex_on_face, edge_through_vertex, zero_area)
    return rng.permutation(np.concatenate([part(rng, -(-n // len(parts))) for part in parts]))[:n]


def tiny(rng, n):
    return degenerate(rng, n) * 2.0**-1000


def huge(rng, n):
    return degenerate(rng, n) * 2.0**990


def tiny_and_huge(rng, n):
    """Degenerate pairs stretched along each axis, of which some coordinates are replaced by some of another size."""
    pairs = degenerate(rng, n) * 2.0 ** rng.choice([-1000, 0, 990], (n, 1, 3))
    replaced = rng.random(pairs.shape) < 0.1
    return np.where(replaced, rng.normal(size=pairs.shape) * 10.0 ** rng.choice([-300, 0, 300], pairs.shape), pairs)


def one_ulp_away(rng, n):
    """Degenerate pairs, turned and therefore rounded or not, with one coordinate moved to the next number."""
    pairs = degenerate(rng, n)
    turn, _ = np.linalg.qr(rng.normal(size=(n, 3, 3)))
    turned = rng.random(n) < 0.5
    pairs[turned] = pairs[turned] @ turn[turned]
    at = (np.arange(n), rng.integers(0, 6, n), rng.integers(0, 3, n))
    pairs[at] = np.nextafter(pairs[at], rng.choice([-np.inf, np.inf], n))
    return pairs


SHARES = {
    generic: 0.25,
    lattice: 0.2,
    shared_vertex: 0.03,
    shared_edge: 0.03,
    coplanar: 0.06,
    coplanar_apart: 0.04,
    vertex_on_face: 0.07,
    edge_through_vertex: 0.07,
    zero_area: 0.07,
    tiny: 0.04,
    huge: 0.04,
    tiny_and_huge: 0.03,
    one_ulp_away: 0.07,
}
"""What part of all pairs is of each kind; all but the first two kinds are degenerate by construction."""


def whole(pairs):
    """The pairs (n, 6, 3) in whole numbers, each divided by a power of two of its own, and which of them are short."""
    mantissas, exponents = np.frexp(pairs)
    mantissas, exponents = (mantissas * 2.0**53).astype(np.int64), exponents - 53
    zeros = np.frexp((mantissas & -mantissas).astype(float))[1] - 1
    zeros[mantissas == 0] = 0
    mantissas, exponents = mantissas >> zeros, exponents + zeros
    least = np.where(mantissas == 0, 9999, exponents).min(axis=(1, 2), keepdims=True)
    shifts = np.where(mantissas == 0, 0, exponents - least)
    bits = shifts + np.frexp(mantissas.astype(float))[1]
    return mantissas, shifts, bits.max(axis=(1, 2)) <= SHORT


def intersect(pairs):
    """Whether triangles (n, 6, 3) intersect, (n,) bool: Python's integers where 64 bits are too few."""
    mantissas, shifts, short = whole(pairs)
    found = np.empty(len(pairs), dtype=bool)
    for chosen, kind in ((short, np.int64), (~short, object)):
        found[chosen] = ~parted(np.left_shift(mantissas[chosen].astype(kind), shifts[chosen].astype(kind)))
    return found


def parted(pairs):
    """Whether 0 is outside the convex hull of the nine differences of a's corners and b's, (n,) bool.

    It is if, and only if, these span a cone that contains no line. Such a cone has a face that goes through two of
    them, has all others on one side, and has those in its plane between the two; or all are along one direction.
    """
    rays = (pairs[:, :3, None] - pairs[:, None, 3:]).reshape(-1, 9, 3)
    out, line = np.zeros(len(rays), dtype=bool), np.ones(len(rays), dtype=bool)
    for i, j in combinations(range(9), 2):
        left = np.flatnonzero(~out)
        normal = cross(rays[left, i], rays[left, j])
        proper = (normal != 0).any(axis=1)
        line[left[proper]] = False
        height = dot(rays[left], normal[:, None])
        left, normal, height = (x[proper & one_sided(height)] for x in (left, normal, height))
        some, normal = rays[left], normal[:, None]
        after = dot(cross(some[:, i, None], some), normal) >= 0
        before = dot(cross(some, some[:, j, None]), normal) >= 0
        out[left] = ((height != 0) | (after & before & (some != 0).any(axis=2))).all(axis=1)
    out[line] = (dot(rays[line], rays[line, :1]) > 0).all(axis=1)
    return out


def one_sided(height):
    return (height >= 0).all(axis=1) | (height <= 0).all(axis=1)


def cross(a, b):
    (p, q, r), (x, y, z) = np.moveaxis(a, -1, 0), np.moveaxis(b, -1, 0)
    return np.stack([q * z - r * y, r * x - p * z, p * y - q * x], axis=-1)


def dot(a, b):
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2]


def in_all_orders(pairs):
    """What ``crosses`` says of pairs (n, 6, 3) in each order of corners and arguments, (72, n) bool."""
    points, first = np.ascontiguousarray(pairs.reshape(-1, 3)), 6 * np.arange(len(pairs))[:, None]
    each = np.repeat(np.arange(len(pairs)), 2).reshape(-1, 2)
    triangles = [(first + p, first + q) for p, q in ORDERS]
    return np.array(
        [pairs_intersect(points, one, points, other, each) for a, b in triangles for one, other in ((a, b), (b, a))]
    )


def compare(kind, n, rng):
    """Compare ``n`` pairs of a kind; how many differ in any order, and how many intersect."""
    pairs = kind(rng, n)
    truth = intersect(pairs)
    return int((in_all_orders(pairs) != truth).any(axis=0).sum()), int(truth.sum())


def main(total: int = 1_000_000) -> None:
    print("kind,pairs,intersecting,wrong")
    rng, every_wrong = np.random.default_rng(5), 0
    for kind, share in SHARES.items():
        sizes = np.diff([*range(0, round(share * total), BATCH), round(share * total)])
        hits = wrong = 0
        for done, n in enumerate(sizes):
            found = compare(kind, n, rng)
            wrong, hits = wrong + found[0], hits + found[1]
            print(f"\r{kind.__name__} {done + 1}/{len(sizes)}", end="", file=sys.stderr, flush=True)
        print("\r" + " " * 40 + "\r", end="", file=sys.stderr, flush=True)
        print(f"{kind.__name__},{sum(sizes)},{hits},{wrong}", flush=True)
        every_wrong += wrong
    sys.exit(f"{every_wrong} pairs of triangles are told wrong" if every_wrong else 0)


if __name__ == "__main__":
    main()
