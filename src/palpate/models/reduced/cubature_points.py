"""The elastic energy of a body in few coordinates, summed over weighted cubature points, and its derivatives.

A cubature point is an integration point of an element, or the mean of some elements; ``cubature`` chooses them.
"""

from typing import NamedTuple

import numba
import numpy as np

from palpate.effects import principal
from palpate.effects.corotational import BLOCK, hessians, rotations, stresses, turned


@numba.njit(cache=True, error_model="numpy")
def point_stresses(q, slopes, volumes, mu, lam, shape, measure, volume, f, p, energies, accepted):
    """Compute F (9, k) and the stresses times volumes (9, k) [J] of k cubature points; return their energy [J].

    q : (r,) coordinates; slopes : (9 k, r) of F by q; f, p : where results are written
    energies, accepted : (k,) workspace; shape, measure, volume : functions of the law, or None for the corotational one
    """
    count = len(volumes)
    moved = np.dot(slopes, q)
    for i in range(9):
        diagonal = 1.0 if i % 4 == 0 else 0.0
        for k in range(count):
            f[i, k] = moved[i * count + k] + diagonal
    if shape is None:
        stresses(f, p, count, mu, lam, energies, accepted)
    else:
        principal.stresses(f, p, count, 1, mu, lam, shape, measure, volume, energies)
    total = 0.0
    for k in range(count):
        total += volumes[k] * energies[k]
    for i in range(9):
        for k in range(count):
            p[i, k] *= volumes[k]
    return total


@numba.njit(cache=True, error_model="numpy")
def elastic(q, body, scratch):
    """Return the elastic energy [J] at coordinates ``q`` (r,) and its gradient (r,).

    body : as ``ReducedEnergy.in_blocks`` returns it; scratch : workspace of ``scratch_of``
    Cubature points are summed block by block, so that a block stays in the cache.
    """
    slopes, volumes, mu, lam, rest, shape, measure, volume = body
    pull = np.dot(rest, q)
    energy = 0.5 * np.dot(pull, q)
    for b in range(len(slopes)):
        energy += point_stresses(q, slopes[b], volumes[b], mu[b], lam[b], shape, measure, volume, *scratch)
        pull += np.dot(scratch[1].ravel(), slopes[b])
    return energy, pull


@numba.njit(cache=True, error_model="numpy")
def scratch_of(body):
    """Return the arrays that ``point_stresses`` writes a block of cubature points into."""
    count = body[1].shape[1]
    return np.empty((9, count)), np.empty((9, count)), np.empty(count), np.empty(count, dtype=np.bool_)


@numba.njit(cache=True, error_model="numpy")
def pulled_by_each(p, slopes, pulls):
    """Write each point's gradient into ``pulls`` (k, r), from P V ``p`` (9, k) [J] and ``slopes`` (9, k, r)."""
    pulls[:] = 0.0
    for i in range(9):
        for k in range(pulls.shape[0]):
            for j in range(pulls.shape[1]):
                pulls[k, j] += p[i, k] * slopes[i, k, j]


@numba.njit(cache=True, error_model="numpy")
def least_det(q, slopes, count):
    """Return the smallest det F of ``count`` cubature points at coordinates ``q`` (r,); slopes : (9 count, r)."""
    moved, least = np.dot(slopes, q), np.inf
    for k in range(count):
        a, b, c = moved[k] + 1.0, moved[count + k], moved[2 * count + k]
        d, e, g = moved[3 * count + k], moved[4 * count + k] + 1.0, moved[5 * count + k]
        h, i, j = moved[6 * count + k], moved[7 * count + k], moved[8 * count + k] + 1.0
        least = min(least, a * (e * j - g * i) - b * (d * j - g * h) + c * (d * i - e * h))
    return least


@numba.njit(cache=True, error_model="numpy")
def _plain_tangent(q, slopes, volumes, mu, lam, begin, end):
    """Return the corotational Hessian (r, r) of the points ``begin`` to ``end``, less that of 2 μ V |δF|².

    With the columns g of R it is λ V (Σ g · δF g)² + tᵀ M t for t = Σ g × δF g, M as in ``corotational.turned``. NaN
    where the rotation of a point is not known.
    """
    r, size = len(q), end - begin
    f, axes, rotated = np.empty((9, BLOCK)), np.zeros((9, BLOCK)), np.empty((15, BLOCK))
    sure = np.empty(BLOCK, dtype=np.bool_)
    for i in range(9):
        f[i, :size] = np.dot(slopes[i, begin:end], q)
    f[::4] += 1.0
    axes[::4] = 1.0
    rotations(f, rotated, size, sure)
    turned(f, axes, volumes[begin:end], size, mu[begin:end], lam[begin:end], rotated)
    rows, stiff_rows = np.empty((4 * size, r)), np.empty((4 * size, r))
    for k in range(size):
        if not sure[k]:
            return np.full((r, r), np.nan)
        a, b, c, d, e, g = rotated[9, k], rotated[10, k], rotated[11, k], rotated[12, k], rotated[13, k], rotated[14, k]
        g00, g01, g02 = rotated[0, k], rotated[1, k], rotated[2, k]
        g10, g11, g12 = rotated[3, k], rotated[4, k], rotated[5, k]
        g20, g21, g22 = rotated[6, k], rotated[7, k], rotated[8, k]
        n, share = begin + k, lam[begin + k] * volumes[begin + k]
        for m in range(r):
            x0, x1, x2 = slopes[0, n, m], slopes[1, n, m], slopes[2, n, m]
            y0, y1, y2 = slopes[3, n, m], slopes[4, n, m], slopes[5, n, m]
            z0, z1, z2 = slopes[6, n, m], slopes[7, n, m], slopes[8, n, m]
            s = g00 * x0 + g01 * y0 + g02 * z0 + g10 * x1 + g11 * y1 + g12 * z1 + g20 * x2 + g21 * y2 + g22 * z2
            u = g01 * z0 - g02 * y0 + g11 * z1 - g12 * y1 + g21 * z2 - g22 * y2
            v = g02 * x0 - g00 * z0 + g12 * x1 - g10 * z1 + g22 * x2 - g20 * z2
            w = g00 * y0 - g01 * x0 + g10 * y1 - g11 * x1 + g20 * y2 - g21 * x2
            rows[4 * k, m], rows[4 * k + 1, m], rows[4 * k + 2, m], rows[4 * k + 3, m] = s, u, v, w
            stiff_rows[4 * k, m], stiff_rows[4 * k + 1, m] = share * s, a * u + b * v + c * w
            stiff_rows[4 * k + 2, m], stiff_rows[4 * k + 3, m] = b * u + d * v + e * w, c * u + e * v + g * w
    return np.dot(rows.T, stiff_rows)


@numba.njit(cache=True, error_model="numpy")
def _law_tangent(q, slopes, volumes, mu, lam, begin, end, shape, measure, volume, definite):
    """Return the energy's Hessian (r, r) of points ``begin`` to ``end`` by any law; ``definite``: each's is clamped."""
    r, size = len(q), end - begin
    f, axes, blocks = np.empty((9, BLOCK)), np.zeros((9, BLOCK)), np.empty((54, BLOCK))
    pulls, stiffnesses, stiff_slopes = np.empty((15, BLOCK)), np.empty(BLOCK), np.zeros((9, size, r))
    for i in range(9):
        f[i, :size] = np.dot(slopes[i, begin:end], q)
    f[::4] += 1.0
    axes[::4] = 1.0
    moduli, law = (mu[begin:end], lam[begin:end]), (shape, measure, volume)
    if shape is None:
        hessians(f, axes, volumes[begin:end], size, *moduli, definite, pulls, blocks)
    else:
        principal.hessians(f, axes, volumes[begin:end], size, 1, *moduli, *law, definite, blocks, pulls, stiffnesses)
    own_slopes = slopes[:, begin:end].copy()
    for pair in range(6):
        c, d = principal.PAIRS[pair]
        for n in range(9):
            i, j = n // 3, n % 3
            for k in range(size):
                block = blocks[9 * pair + n, k]
                for m in range(r):
                    stiff_slopes[3 * i + c, k, m] += block * own_slopes[3 * j + d, k, m]
                if c != d:
                    for m in range(r):
                        stiff_slopes[3 * j + d, k, m] += block * own_slopes[3 * i + c, k, m]
    return np.dot(own_slopes.reshape(9 * size, r).T, stiff_slopes.reshape(9 * size, r))


@numba.njit(cache=True, error_model="numpy")
def add_tangent(q, slopes, volumes, mu, lam, shape, measure, volume, tangent):
    """Add the part of the energy's Hessian that changes with ``q`` (r,) to ``tangent`` (r, r); slopes : (9, k, r)."""
    for begin in range(0, len(volumes), BLOCK):
        end = min(begin + BLOCK, len(volumes))
        if shape is None:
            tangent += _plain_tangent(q, slopes, volumes, mu, lam, begin, end)
        else:
            tangent += _law_tangent(q, slopes, volumes, mu, lam, begin, end, shape, measure, volume, False)


@numba.njit(cache=True, error_model="numpy")
def clamped_tangent(q, slopes, volumes, mu, lam, shape, measure, volume):
    """Return the Hessian (r, r) at ``q`` (r,), that of each of k points clamped positive; slopes : (9, k, r)."""
    tangent = np.zeros((len(q), len(q)))
    for begin in range(0, len(volumes), BLOCK):
        end = min(begin + BLOCK, len(volumes))
        tangent += _law_tangent(q, slopes, volumes, mu, lam, begin, end, shape, measure, volume, True)
    return tangent


class CubaturePoints(NamedTuple):
    """k cubature points, whose deformation gradients are F = I + slopes q at coordinates q (r,).

    slopes : (9, k, r), the entries of F row by row; volumes : (k,) [m³], times weights where some are chosen; mu, lam :
        (k,) [Pa]
    """

    slopes: np.ndarray
    volumes: np.ndarray
    mu: np.ndarray
    lam: np.ndarray

    def take(self, chosen: np.ndarray, weights: np.ndarray) -> "CubaturePoints":
        """Return the points with the numbers ``chosen`` (j,), their volumes multiplied by ``weights`` (j,)."""
        slopes = np.ascontiguousarray(self.slopes[:, chosen])
        return CubaturePoints(slopes, self.volumes[chosen] * weights, self.mu[chosen], self.lam[chosen])

    @property
    def stiffness(self) -> np.ndarray:
        """The Hessian (r, r) of the energy of all points at rest, Σ V (2μ e : e + λ tr e tr e)."""
        strain, trace = self._strains
        total = trace.T @ ((self.volumes * self.lam)[:, None] * trace)
        for part in strain:
            total += part.T @ ((2.0 * self.volumes * self.mu)[:, None] * part)
        return total

    def stiffnesses(self) -> np.ndarray:
        """Return the Hessian of the energy of each point at rest, (k, r, r)."""
        strain, trace = self._strains
        terms = (self.volumes * self.lam)[:, None, None] * (trace[:, :, None] * trace[:, None, :])
        for part in strain:
            terms += (2.0 * self.volumes * self.mu)[:, None, None] * (part[:, :, None] * part[:, None, :])
        return terms

    @property
    def _strains(self) -> tuple[np.ndarray, np.ndarray]:
        """The strains (9, k, r) of the points by each coordinate, and their traces (k, r)."""
        _, count, modes = self.slopes.shape
        f = self.slopes.reshape(3, 3, count, modes)
        strain = 0.5 * (f + f.transpose(1, 0, 2, 3)).reshape(9, count, modes)
        return strain, strain[0] + strain[4] + strain[8]
