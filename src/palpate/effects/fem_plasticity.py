"""Plastic flow of corotational finite elements, which changes their rest shapes."""

import math

import numba
import numpy as np

from palpate.effects.corotational import FOLD, first
from palpate.effects.effect import Relaxation
from palpate.effects.linear_elements import LinearElements, deformation_gradient
from palpate.linalg.polar import compose, multiply, signed_svd


class FemPlasticity(Relaxation):
    """Plastic flow by F = Fₑ Fₚ, det Fₚ = 1 (Irving, Teran, Fedkiw 2004, section 6): the plastic part Fₚ has no energy.

    The elastic strain is that of Hencky, eᵢ = log sᵢ minus their mean, with the singular values s of Fₑ. Its size
    √(2/3 Σ eᵢ²) is the logarithmic strain of a bar of constant volume. Above the yield strain an element at rest
    relaxes towards it as exp(−creep t), exactly for any step; the strain of Fₚ is limited to ``max_strain``. The flow
    changes the rows of ``elastic.gradients`` to Fₚ⁻ᵀ g; volumes stay.

    Traps: collapsed and inverted elements (s₃ ≤ FOLD) have no such strain and do not flow. An element whose energy
    would increase does not flow either: below tr S − 3 ≈ −2μ/λ (volume reduced by 4 % at ν = 0.49, by 80 % at 0.3)
    shear decreases the corotational energy.
    """

    def __init__(self, elastic: LinearElements, yield_strain: float, creep: float, max_strain: float):
        self._elastic, self._creep = elastic, creep
        self._bounds = (yield_strain, max_strain)
        self._original = elastic.gradients.copy()
        self.plastic = np.tile(np.eye(3), (len(elastic.tetrahedra), 1, 1))

    def relax(self, x: np.ndarray, h: float) -> None:
        elastic, flow = self._elastic, -math.expm1(-self._creep * h)
        constants = elastic.tetrahedra, self._original, *elastic.moduli, flow, *self._bounds
        _relax(x, *constants, self.plastic, elastic.gradients)
        elastic.forget()


@numba.njit(cache=True, error_model="numpy")
def _relax(x, tetrahedra, original, mu, lam, flow, yield_strain, max_strain, plastic, gradients):
    """Let elements flow, in ``plastic`` and ``gradients``; flow : fraction of the strain above yield that relaxes."""
    f, u, v, s = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    logs, candidate, inverse, trial = np.empty(3), np.empty((3, 3)), np.empty((3, 3)), np.empty((4, 3))
    unused = np.empty(3)
    for e in range(len(tetrahedra)):
        deformation_gradient(x, tetrahedra[e], gradients[e], f)
        signed_svd(f, u, s, v)
        if not s[2] > FOLD:
            continue
        strain = _hencky(s, logs)
        if strain <= yield_strain:
            continue
        energy = first(s, mu[e], lam[e], unused)
        for k in range(3):
            s[k] = math.exp(flow * (1.0 - yield_strain / strain) * logs[k])
        compose(v, s, v, f)
        multiply(f, plastic[e], candidate)
        _bound(candidate, max_strain, inverse, u, s, v, logs)
        for a in range(4):
            for i in range(3):
                trial[a, i] = 0.0
                for j in range(3):
                    trial[a, i] += inverse[j, i] * original[e, a, j]
        deformation_gradient(x, tetrahedra[e], trial, f)
        signed_svd(f, u, s, v)
        if s[2] > FOLD and first(s, mu[e], lam[e], unused) < energy:
            plastic[e] = candidate
            gradients[e] = trial


@numba.njit(cache=True, error_model="numpy")
def _hencky(s, logs):
    """Write the deviatoric logarithms of ``s`` (3,) into ``logs``, and return their size."""
    mean = (math.log(s[0]) + math.log(s[1]) + math.log(s[2])) / 3.0
    total = 0.0
    for k in range(3):
        logs[k] = math.log(s[k]) - mean
        total += logs[k] * logs[k]
    return math.sqrt(2.0 / 3.0 * total)


@numba.njit(cache=True, error_model="numpy")
def _bound(candidate, max_strain, inverse, u, s, v, logs):
    """Limit the Hencky strain of Fₚ to ``max_strain``, set its determinant to 1, and compute its inverse."""
    signed_svd(candidate, u, s, v)
    strain = _hencky(s, logs)
    ratio = max_strain / strain if strain > max_strain else 1.0
    for k in range(3):
        s[k] = math.exp(ratio * logs[k])
    compose(u, s, v, candidate)
    for k in range(3):
        s[k] = 1.0 / s[k]
    compose(v, s, u, inverse)
