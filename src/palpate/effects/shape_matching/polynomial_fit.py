"""Fits of polynomials of the rest positions to the particles of each cluster.

Paper 3, chapter 3, inverts Σ m q̃ q̃ᵀ. Here the terms q̃ are made orthonormal once, at rest: φ with Σ μ φ = 0 and
Σ μ φ φᵀ = I, where μ are the particles' shares of their cluster's mass. Then H = Σ μ x φᵀ gives the best fit c + H φ,
with q = L φ and A_pq = M H Lᵀ, and terms that are dependent in a flat, straight or tiny cluster are zero.
"""

import math

import numba
import numpy as np

TERMS = {"rigid": 3, "linear": 3, "quadratic": 9}
"""Entries of q̃ = (x, y, z, x², y², z², xy, yz, zx) in each mode."""

DEPENDENT = 1e-6
"""A term is dependent if its part orthogonal to the earlier terms is below this, relative to the cluster's size."""


def orthonormal_terms(
    nodes: np.ndarray, masses: np.ndarray, members: np.ndarray, starts: np.ndarray, terms: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Compute the orthonormal terms φ of all clusters, and the frames L that give q = L φ.

    nodes : (n, 3) [m]; masses : (n_members,) [kg], a particle's share of mass in this cluster; terms : their number
    Returns shares μ (n_members,), terms φ (n_members, terms), frames (n_clusters, 3, 3) [m], and the number of
    terms, of the first three, that are not zero, (n_clusters,): 2 in a plane, 1 on a line, 0 in a point.
    """
    shares, basis = np.empty(len(members)), np.zeros((len(members), terms))
    frames, ranks = np.zeros((len(starts) - 1, 3, 3)), np.zeros(len(starts) - 1, dtype=np.int64)
    _orthonormal(nodes, masses, members, starts, shares, basis, frames, ranks)
    return shares, basis, frames, ranks


@numba.njit(cache=True)
def _orthonormal(nodes, masses, members, starts, shares, basis, frames, ranks):
    for c in range(len(starts) - 1):
        first, last = starts[c], starts[c + 1]
        total = masses[first:last].sum()
        shares[first:last] = masses[first:last] / total
        share, phi = shares[first:last], basis[first:last]
        centre, square = np.zeros(3), 0.0
        for n in range(first, last):
            for i in range(3):
                centre[i] += shares[n] * nodes[members[n], i]
        for n in range(first, last):
            for i in range(3):
                basis[n, i] = nodes[members[n], i] - centre[i]
                square += shares[n] * basis[n, i] ** 2
        radius = math.sqrt(square)
        if radius == 0.0:
            phi[:] = 0.0
            continue
        phi[:, :3] /= radius
        if basis.shape[1] == 9:
            for n in range(first, last):
                x, y, z = basis[n, 0], basis[n, 1], basis[n, 2]
                basis[n, 3], basis[n, 4], basis[n, 5] = x * x, y * y, z * z
                basis[n, 6], basis[n, 7], basis[n, 8] = x * y, y * z, z * x
        for j in range(basis.shape[1]):
            phi[:, j] -= (share * phi[:, j]).sum()
            for _ in range(2):  # once is inaccurate for nearly dependent terms; twice is enough
                for k in range(j):
                    part = (share * phi[:, k] * phi[:, j]).sum()
                    phi[:, j] -= part * phi[:, k]
                    if j < 3:
                        frames[c, j, k] += radius * part
            length = math.sqrt((share * phi[:, j] ** 2).sum())
            if length < DEPENDENT:
                phi[:, j] = 0.0
                continue
            phi[:, j] /= length
            if j < 3:
                frames[c, j, j] = radius * length
                ranks[c] += 1


@numba.njit(cache=True)
def fit(x, members, shares, basis, first, last, centre, h):
    """Compute the centre of mass (3,) and H = Σ μ x φᵀ (3, terms) of the cluster with members ``first`` to ``last``.

    Sums are relative to the first particle, so that they are accurate far from the origin.
    """
    x0, y0, z0 = x[members[first], 0], x[members[first], 1], x[members[first], 2]
    cx, cy, cz = 0.0, 0.0, 0.0
    h[:] = 0.0
    for n in range(first, last):
        i = members[n]
        px, py, pz = shares[n] * (x[i, 0] - x0), shares[n] * (x[i, 1] - y0), shares[n] * (x[i, 2] - z0)
        cx += px
        cy += py
        cz += pz
        for j in range(basis.shape[1]):
            h[0, j] += px * basis[n, j]
            h[1, j] += py * basis[n, j]
            h[2, j] += pz * basis[n, j]
    centre[0], centre[1], centre[2] = x0 + cx, y0 + cy, z0 + cz


@numba.njit(cache=True)
def moment(h, frame, out):
    """Compute A_pq/M = H Lᵀ (3, 3) [m²], whose rotation is that of the cluster."""
    for i in range(3):
        for j in range(3):
            out[i, j] = h[i, 0] * frame[j, 0] + h[i, 1] * frame[j, 1] + h[i, 2] * frame[j, 2]


@numba.njit(cache=True)
def determinant(a):
    """Compute the determinant of the first three columns of ``a``."""
    return (
        a[0, 0] * (a[1, 1] * a[2, 2] - a[1, 2] * a[2, 1])
        + a[0, 1] * (a[1, 2] * a[2, 0] - a[1, 0] * a[2, 2])
        + a[0, 2] * (a[1, 0] * a[2, 1] - a[1, 1] * a[2, 0])
    )
