"""Elasticity of axisymmetric quadrilaterals with nine nodes and linear dilatation, which do not lock.

A deformation without twist has two principal stretches in the half-plane of r and z, those of its (2, 2) gradient, and
the hoop stretch x_r / r. The energy density of a law is W(s) + U(θ(s)), θ being its measure of volume. In each element
θ is replaced by its projection on linear functions of r and z: the pair of Q2 and discontinuous P1 (Simo, Taylor,
Pister 1985; Sussman and Bathe 1987). Integrals are over the whole ring, at 3 × 3 points.
"""

from typing import NamedTuple

import numba
import numpy as np

from palpate.effects.law import Law
from palpate.effects.principal import EQUAL_STRETCHES

NODES = POINTS = 9
_GAUSS = np.sqrt(0.6) * np.array([-1.0, 0.0, 1.0])
_WEIGHTS = np.array([5.0, 8.0, 5.0]) / 9.0


class Rings(NamedTuple):
    """A mesh of m axisymmetric elements on n nodes, with its shape functions at the 9 points of integration of each.

    nodes : (n, 2) r and z at rest [m]; quads : (m, 9), nodes row by row of a 3 × 3 grid
    slopes : (m, 9, 9, 2) of each point the derivatives of shape functions by r and z [1/m]
    hoop : (m, 9, 9) of each point the shape functions over r [1/m]; volumes : (m, 9) of the points' rings [m³]
    projections : (m, 9, 9), matrices from values at the points to those of the nearest linear function there
    """

    nodes: np.ndarray
    quads: np.ndarray
    slopes: np.ndarray
    hoop: np.ndarray
    volumes: np.ndarray
    projections: np.ndarray


def _lines(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the quadratic shape functions of a line at ``t`` (k,) in −1 to 1, and their derivatives, (k, 3)."""
    values = np.stack([0.5 * t * (t - 1.0), 1.0 - t * t, 0.5 * t * (t + 1.0)], axis=1)
    return values, np.stack([t - 0.5, -2.0 * t, t + 0.5], axis=1)


def rings(nodes: np.ndarray, quads: np.ndarray) -> Rings:
    """Evaluate the shape functions of elements ``quads`` (m, 9) on ``nodes`` (n, 2) [m], whose areas are positive."""
    line, rate = _lines(_GAUSS)
    shapes = np.einsum("pa,qb->pqab", line, line).reshape(POINTS, NODES)
    by_s = np.einsum("pa,qb->pqab", rate, line).reshape(POINTS, NODES)
    by_t = np.einsum("pa,qb->pqab", line, rate).reshape(POINTS, NODES)
    at_nodes = nodes[quads]
    jacobian = np.stack([np.einsum("qa,mai->mqi", by_s, at_nodes), np.einsum("qa,mai->mqi", by_t, at_nodes)], axis=3)
    areas = np.linalg.det(jacobian)
    assert (areas > 0.0).all()
    slopes = np.einsum("qak,mqki->mqai", np.stack([by_s, by_t], axis=2), np.linalg.inv(jacobian))
    points = np.einsum("qa,mai->mqi", shapes, at_nodes)
    hoop = shapes[None] / points[..., :1]
    volumes = 2.0 * np.pi * points[..., 0] * areas * np.outer(_WEIGHTS, _WEIGHTS).ravel()
    # the nearest linear function, by least squares with the volumes as weights
    middle = points.mean(axis=1, keepdims=True)
    scale = np.abs(points - middle).max(axis=1, keepdims=True)
    linear_basis = np.concatenate([np.ones((*points.shape[:2], 1)), (points - middle) / scale], axis=2)
    weighted = linear_basis * volumes[..., None]
    gram = np.einsum("mqi,mqj->mij", weighted, linear_basis)
    projections = np.einsum("mqi,mij,mpj->mqp", linear_basis, np.linalg.inv(gram), weighted)
    arrays = (nodes, quads.astype(np.int64), slopes, hoop, volumes, projections)
    return Rings(*(np.ascontiguousarray(each) for each in arrays))


@numba.njit(cache=True, error_model="numpy")
def _write_gradient(x, quads, slopes, hoop, e, q, f):
    """Write the deformation gradient (2, 2) in r and z of point q of element e into ``f``; return the hoop stretch."""
    f[:] = 0.0
    hoop_stretch = 0.0
    for a in range(NODES):
        n = quads[e, a]
        for i in range(2):
            f[i, 0] += x[n, i] * slopes[e, q, a, 0]
            f[i, 1] += x[n, i] * slopes[e, q, a, 1]
        hoop_stretch += x[n, 0] * hoop[e, q, a]
    return hoop_stretch


@numba.njit(cache=True, error_model="numpy")
def least_volume(x, quads, slopes, hoop):
    """Return the smallest of det F and of the hoop stretch over all points, for positions ``x`` (n, 2)."""
    f, least = np.empty((2, 2)), np.inf
    for e in range(len(quads)):
        for q in range(POINTS):
            hoop_stretch = _write_gradient(x, quads, slopes, hoop, e, q, f)
            det = (f[0, 0] * f[1, 1] - f[0, 1] * f[1, 0]) * hoop_stretch
            least = min(least, det, hoop_stretch)
    return least


@numba.njit(cache=True, error_model="numpy")
def _singular_values(f, u, v):
    """Return the singular values s₁ ≥ |s₂| of F = U diag(s₁, s₂) Vᵀ (2, 2), and write the rotations into ``u``, ``v``.

    F is a multiple of a rotation plus one of a reflection: their angles are the difference and the sum of U's and V's.
    """
    cosine, sine = 0.5 * (f[0, 0] + f[1, 1]), 0.5 * (f[1, 0] - f[0, 1])
    mirrored_cosine, mirrored_sine = 0.5 * (f[0, 0] - f[1, 1]), 0.5 * (f[1, 0] + f[0, 1])
    rotation, reflection = np.hypot(cosine, sine), np.hypot(mirrored_cosine, mirrored_sine)
    reflected_by, rotated_by = np.arctan2(mirrored_sine, mirrored_cosine), np.arctan2(sine, cosine)
    for angle, rotation_matrix in ((0.5 * (rotated_by + reflected_by), u), (0.5 * (reflected_by - rotated_by), v)):
        rotation_matrix[0, 0] = rotation_matrix[1, 1] = np.cos(angle)
        rotation_matrix[1, 0] = np.sin(angle)
        rotation_matrix[0, 1] = -rotation_matrix[1, 0]
    return rotation + reflection, rotation - reflection


@numba.njit(cache=True, error_model="numpy")
def _sort_stretches(s, ranks, ranked):
    """Write the stretches ``s`` (3,) in descending order, as laws take them, into ``ranked``, and their ranks."""
    for i in range(3):
        rank = 0
        for j in range(3):
            rank += s[j] > s[i] or (s[j] == s[i] and j < i)
        ranks[i] = rank
        ranked[rank] = s[i]


@numba.njit(cache=True, error_model="numpy")
def _write_strain_rows(slopes, hoop, u, v, b):
    """Write the derivatives of a point's three stretches and two shears, in principal axes, by the nodes' r and z.

    slopes, hoop : of the point; u, v : rotations of its singular values; b : (5, 18) [1/m], the result
    """
    for a in range(NODES):
        along = slopes[a, 0] * v[0, 0] + slopes[a, 1] * v[1, 0]
        across = slopes[a, 0] * v[0, 1] + slopes[a, 1] * v[1, 1]
        for k in range(2):
            c = 2 * a + k
            b[0, c], b[1, c] = u[k, 0] * along, u[k, 1] * across
            b[2, c] = hoop[a] if k == 0 else 0.0
            b[3, c], b[4, c] = u[k, 0] * across, u[k, 1] * along


@numba.njit(cache=True, error_model="numpy")
def _write_moduli(s, gradient, second, d):
    """Write the second derivatives of the energy density by three stretches and two shears into ``d`` (5, 5) [Pa].

    s : (3,) the stretches; gradient : (3,) [Pa], second : (3, 3) [Pa], derivatives by them. Shears in principal axes
    have the moduli of a flip and a twist (Smith, de Goes, Kim 2019, section 4)
    """
    difference, total = s[0] - s[1], s[0] + s[1]
    near, mean = EQUAL_STRETCHES * (abs(s[0]) + abs(s[1])), 0.5 * (second[0, 0] + second[1, 1])
    flip = (gradient[0] - gradient[1]) / difference if difference > near else mean - second[0, 1]
    twist = (gradient[0] + gradient[1]) / total if total > near else mean + second[0, 1]
    d[:] = 0.0
    d[:3, :3] = second
    d[3, 3] = d[4, 4] = 0.5 * (flip + twist)
    d[3, 4] = d[4, 3] = 0.5 * (flip - twist)


@numba.njit(cache=True, error_model="numpy")
def _add_point(weight, b, d, weighted, matrix):
    """Add weight · bᵀ d b of a point to the lower half of ``matrix`` (18, 18) [N/m]; weighted : (5, 18), scratch."""
    for c in range(2 * NODES):
        for i in range(3):
            weighted[i, c] = weight * (d[i, 0] * b[0, c] + d[i, 1] * b[1, c] + d[i, 2] * b[2, c])
        weighted[3, c] = weight * (d[3, 3] * b[3, c] + d[3, 4] * b[4, c])
        weighted[4, c] = weight * (d[4, 3] * b[3, c] + d[4, 4] * b[4, c])
    for c in range(2 * NODES):
        for k in range(c + 1):
            part = weighted[0, c] * b[0, k] + weighted[1, c] * b[1, k] + weighted[2, c] * b[2, k]
            matrix[c, k] += part + weighted[3, c] * b[3, k] + weighted[4, c] * b[4, k]


@numba.njit(cache=True, error_model="numpy")
def _add_pressures(volumes, bend, projection, changes, mixed, matrix):
    """Add the stiffness of U by the projected θ to the lower half of ``matrix`` (18, 18) [N/m]; mirror that half.

    volumes : (9,) [m³] of the points; bend : U″ (9,) [Pa] there; projection : (9, 9)
    changes : (9, 18) [1/m] derivatives of θ at the points by the nodes' r and z; mixed : (9, 9), scratch for PᵀVU″P
    """
    for p in range(POINTS):
        for k in range(p + 1):
            entry = 0.0
            for q in range(POINTS):
                entry += volumes[q] * bend[q] * projection[q, p] * projection[q, k]
            mixed[p, k] = mixed[k, p] = entry
    spread = mixed @ changes
    for c in range(2 * NODES):
        for k in range(c + 1):
            entry = matrix[c, k]
            for q in range(POINTS):
                entry += changes[q, c] * spread[q, k]
            matrix[c, k] = matrix[k, c] = entry


@numba.njit(cache=True, error_model="numpy")
def energy_force_stiffness(
    x, quads, slopes, hoop, volumes, projections, mu, lam, shape, measure, volume, force, matrices
):
    """Return the energy [J], add its gradient to ``force`` (n, 2) [N], and write ``matrices`` (m, 18, 18) [N/m].

    x : positions (n, 2) [m]; quads … projections : of ``Rings``; mu, lam : Lamé's constants [Pa]; shape, measure,
    volume : of the law, W(s), θ(s) and U(θ). At points gradient and second are derivatives of the energy by s, rates
    and bends those of θ; slope and curve are U′ and U″ of the projected θ, us and vs the rotations of F.
    """
    us, vs, s = np.empty((POINTS, 2, 2)), np.empty((POINTS, 2, 2)), np.empty((POINTS, 3))
    gradient, rates = np.empty((POINTS, 3)), np.empty((POINTS, 3))
    second, bends = np.empty((POINTS, 3, 3)), np.empty((POINTS, 3, 3))
    theta, slope, curve = np.empty(POINTS), np.empty(POINTS), np.empty(POINTS)
    f, derivatives, ranked, ranks = np.empty((2, 2)), np.empty(2), np.empty(3), np.empty(3, dtype=np.int64)
    w_slopes, t_slopes, w_bends, t_bends = np.empty(3), np.empty(3), np.empty((3, 3)), np.empty((3, 3))
    b, d, changes = np.empty((5, 2 * NODES)), np.empty((5, 5)), np.empty((POINTS, 2 * NODES))
    weighted, mixed = np.empty((5, 2 * NODES)), np.empty((POINTS, POINTS))
    energy = 0.0
    for e in range(len(quads)):
        for q in range(POINTS):
            s[q, 2] = _write_gradient(x, quads, slopes, hoop, e, q, f)
            s[q, 0], s[q, 1] = _singular_values(f, us[q], vs[q])
            _sort_stretches(s[q], ranks, ranked)
            energy += volumes[e, q] * shape(ranked, mu, w_slopes, w_bends)
            theta[q] = measure(ranked, t_slopes, t_bends)
            for i in range(3):
                gradient[q, i], rates[q, i] = w_slopes[ranks[i]], t_slopes[ranks[i]]
                for j in range(3):
                    second[q, i, j] = w_bends[ranks[i], ranks[j]]
                    bends[q, i, j] = t_bends[ranks[i], ranks[j]]
        for q in range(POINTS):
            projected = 0.0
            for p in range(POINTS):
                projected += projections[e, q, p] * theta[p]
            energy += volumes[e, q] * volume(projected, mu, lam, derivatives)
            slope[q], curve[q] = derivatives[0], derivatives[1]
        matrices[e] = 0.0
        for q in range(POINTS):
            pressure = 0.0
            for p in range(POINTS):
                pressure += projections[e, q, p] * slope[p]
            for i in range(3):
                gradient[q, i] += pressure * rates[q, i]
                for j in range(3):
                    second[q, i, j] += pressure * bends[q, i, j]
            _write_strain_rows(slopes[e, q], hoop[e, q], us[q], vs[q], b)
            for c in range(2 * NODES):
                pull = b[0, c] * gradient[q, 0] + b[1, c] * gradient[q, 1] + b[2, c] * gradient[q, 2]
                force[quads[e, c // 2], c % 2] += volumes[e, q] * pull
                changes[q, c] = b[0, c] * rates[q, 0] + b[1, c] * rates[q, 1] + b[2, c] * rates[q, 2]
            _write_moduli(s[q], gradient[q], second[q], d)
            _add_point(volumes[e, q], b, d, weighted, matrices[e])
        _add_pressures(volumes[e], curve, projections[e], changes, mixed, matrices[e])
    return energy


class AxisymmetricElements:
    """One homogeneous material on ``rings``; lengths and moduli in any units that go together."""

    def __init__(self, mesh: Rings, law: Law, young_pa: float, poisson: float):
        self.mesh = mesh
        mu, lam = young_pa / (2.0 * (1.0 + poisson)), young_pa * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson))
        self._law = (mu, lam, law.shape, law.measure, law.volume)
        self.matrices = np.empty((len(mesh.quads), 2 * NODES, 2 * NODES))

    def linearise(self, x: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        """Return energy [J], gradient (n, 2) [N] and element stiffnesses (m, 18, 18) [N/m] at positions (n, 2) [m].

        Trap: the stiffnesses are ``matrices``, which the next call overwrites.
        """
        force = np.zeros_like(x)
        energy = energy_force_stiffness(x, *self.mesh[1:], *self._law, force, self.matrices)
        return energy, force, self.matrices

    def least_volume(self, x: np.ndarray) -> float:
        """Return the smallest of det F and of the hoop stretch over all points, at positions ``x`` (n, 2) [m]."""
        return float(least_volume(x, self.mesh.quads, self.mesh.slopes, self.mesh.hoop))
