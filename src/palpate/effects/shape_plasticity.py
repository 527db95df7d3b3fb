"""Lasting deformation of shape-matching clusters."""

import math

import numba
import numpy as np

from palpate.effects.effect import Relaxation
from palpate.effects.settings import Plasticity
from palpate.effects.shape_matching import ShapeMatching, determinant, fit
from palpate.errors import InputError
from palpate.linalg.polar import compose, multiply, signed_svd


class ShapePlasticity(Relaxation):
    """Rest shapes q = S_p (x⁰ − c⁰) that creep towards the deformation (Müller et al. 2005, section 4.4).

    plastic : (n_clusters, 3, 3), S_p, initially the identity

    With A = R S the best linear fit of a cluster's rest shape, S_p becomes [I + (1 − exp(−creep h)) (S − I)] S_p
    if the largest principal strain ‖S − I‖ exceeds the yield strain; the exponential, which replaces the paper's
    creep · h, cannot overshoot. Then ‖S_p − I‖ is limited to ``max_strain``, and the volume set to that at rest. No S_p
    changes the span of the terms φ, so only ``elastic.frames`` change, and nothing is inverted again.

    elastic : the shape matching, whose frames change in place

    Raises InputError for a ``max_strain`` out of range. Trap: a flat cluster has no thickness, so its area may change.
    """

    def __init__(self, settings: Plasticity, elastic: ShapeMatching):
        self._yield, self._creep, self._most = settings.yield_strain, settings.creep_1_s, settings.max_strain
        # a scene of finite elements may allow more, and its models take its settings over
        if not 0.0 < self._most < 1.0:
            raise InputError(f"plasticity.max_strain is {self._most}: give a number between 0 and 1 for shape matching")
        self._elastic = elastic
        self._rest = elastic.frames.copy()
        self._inverse = np.linalg.pinv(self._rest, rcond=1e-9)
        self.plastic = np.tile(np.eye(3), (len(self._rest), 1, 1))

    def relax(self, x: np.ndarray, h: float) -> None:
        matched = self._elastic
        clusters = matched.clusters.members, matched.clusters.starts, matched.shares, matched.basis
        bounds = self._yield, -math.expm1(-self._creep * h), self._most
        _relax(x, *clusters, self._inverse, matched.ranks, *bounds, self.plastic)
        np.matmul(self.plastic, self._rest, out=matched.frames)


@numba.njit(cache=True, error_model="numpy")
def _relax(x, members, starts, shares, basis, inverse, ranks, yield_strain, creep, max_strain, plastic):
    """Add the fraction ``creep`` of a cluster's strain above ``yield_strain`` to ``plastic``, up to ``max_strain``."""
    centre, h = np.empty(3), np.empty((3, basis.shape[1]))
    f, u, v, s, undo = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty(3), np.empty((3, 3))
    linear = np.empty((3, 3))
    for c in range(len(ranks)):
        fit(x, members, shares, basis, starts[c], starts[c + 1], centre, h)
        _invert(plastic[c], undo)
        multiply(h, inverse[c], linear)
        multiply(linear, undo, f)
        signed_svd(f, u, s, v)
        # a flat cluster has no strain normal to itself, and that direction is known only if it is strained
        if ranks[c] == 0 or (ranks[c] < 3 and s[ranks[c] - 1] <= 1e-6 * s[0]):
            continue
        strain = 0.0
        for k in range(3):
            s[k] = s[k] - 1.0 if k < ranks[c] else 0.0
            strain = max(strain, abs(s[k]))
        if not strain > yield_strain:
            continue
        compose(v, s, v, linear)
        linear *= creep
        for i in range(3):
            linear[i, i] += 1.0
        multiply(linear, plastic[c], f)
        _bound(f, max_strain, ranks[c] == 3, u, s, v)
        plastic[c] = f


@numba.njit(cache=True, error_model="numpy")
def _bound(f, max_strain, keep_volume, u, s, v):
    """Limit ‖f − I‖ to ``max_strain``, which is below 1 so that det f stays positive, and set det f to 1.

    In the paper the second step may undo the first; here they alternate until both hold.
    """
    for attempt in range(50):
        for i in range(3):
            f[i, i] -= 1.0
        signed_svd(f, u, s, v)
        within = s[0] <= max_strain * (1.0 + 1e-9)
        if not within:
            f *= max_strain / s[0]
        for i in range(3):
            f[i, i] += 1.0
        if not keep_volume or (within and attempt > 0):
            break
        f /= determinant(f) ** (1.0 / 3.0)


@numba.njit(cache=True)
def _invert(a, out):
    """Write the inverse of ``a``, whose determinant is positive, into ``out``."""
    scale = 1.0 / determinant(a)
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        for m in range(3):
            n, o = (m + 1) % 3, (m + 2) % 3
            out[m, i] = (a[j, n] * a[k, o] - a[j, o] * a[k, n]) * scale
