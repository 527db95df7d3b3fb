"""Shape matching: every cluster of particles is drawn towards the best fit of its rest shape."""

import numba
import numpy as np

from palpate.effects.shape_matching.clusters import Clusters, make_clusters
from palpate.effects.shape_matching.polynomial_fit import TERMS, determinant, fit, moment, orthonormal_terms
from palpate.errors import InputError
from palpate.linalg.nearest_rotation import nearest
from palpate.linalg.nearest_rotation import rotations as rotations

HALF, DOUBLE = 0.5, 2.0
"""Volumes, relative to rest, between which the linear mode restores all of it."""


def make(particles, settings: dict, elastic=None) -> "ShapeMatching":
    """Shape matching of ``particles``.

    settings : ``mode`` rigid | linear | quadratic, ``alpha`` (part of the way to the goals a step takes, 0 to 1),
        ``beta`` (how far goals follow the deformation, 0 to 1; rigid ignores it), ``clusters`` as ``make_clusters``
    Raises InputError for a setting out of range, or clusters that do not hold the body together.
    """
    if settings["mode"] not in TERMS:
        raise InputError(f"shape_matching.mode {settings['mode']} is unknown: choose one of {', '.join(TERMS)}")
    for name in ("alpha", "beta"):
        if not 0.0 <= settings[name] <= 1.0:
            raise InputError(f"shape_matching.{name} is {settings[name]}: give a number from 0 to 1")
    clusters = make_clusters(particles, settings["clusters"])
    return ShapeMatching(particles, clusters, settings["mode"], settings["alpha"], settings["beta"])


class ShapeMatching:
    """Goals of overlapping clusters (Müller, Heidelberger, Teschner, Gross 2005; paper 3, chapter 3).

    frames : (n_clusters, 3, 3) [m], the rest shape as q = L φ; plasticity changes it in place
    alpha : part of the way to its goal that a particle goes in a step

    A particle's mass is shared equally among its clusters, and its goal is the mean of theirs. As each cluster's
    goals keep its share of linear and angular momentum, α (g − x) keeps the body's, however clusters overlap.

    Two changes to the paper: the terms q̃ have their mean taken out, without which quadratic goals move the mass
    centre; and det(A)^(−1/3) of the linear mode, infinite for a flat cluster, stays as it is at DOUBLE volume above
    that, and falls from what it is at HALF to 1 for a flat or inverted one. Without these bounds an undamped
    body that starts flat or inverted swings a thousand times its size after 2000 steps with α = 1; with them tens
    of times after 10 000, and still growing: damp what may start so.

    Traps: the force α m (g − x)/h² depends on the step, and beyond the rigid mode it is no gradient, so there is
    no energy to offer. With β = 1 goals follow any (linear or quadratic) shape, an inverted one too. Clusters that
    share no more than a layer of particles have other shapes to come to rest in, turned outside in, which a wild
    start may lead to; sharing half, no start was found that does not come back.
    """

    def __init__(self, particles, clusters: Clusters, mode: str, alpha: float, beta: float):
        self.alpha, self.clusters, self.mode = alpha, clusters, mode
        self._beta = 0.0 if mode == "rigid" else beta
        self._weights = 1.0 / clusters.shared_by
        masses = (particles.masses * self._weights)[clusters.members]
        self.shares, self.basis, self.frames, self.ranks = orthonormal_terms(
            particles.nodes, masses, clusters.members, clusters.starts, TERMS[mode]
        )
        self._turns = np.tile([1.0, 0.0, 0.0, 0.0], (len(self.ranks), 1))

    def goals(self, x: np.ndarray, out: np.ndarray) -> None:
        """Write the goal positions (n, 3) [m] for positions ``x`` (n, 3) [m] into ``out``.

        Each cluster's rotation is sought from the one before, which changes the answer by rounding only, or where
        several are equally near.
        """
        rest = (self.clusters.members, self.clusters.starts, self.shares, self.basis, self.frames, self.ranks)
        _goals(x, *rest, self._beta, self.mode == "linear", self._weights, self._turns, out)


@numba.njit(cache=True, error_model="numpy")
def _goals(x, members, starts, shares, basis, frames, ranks, beta, keep_volume, weights, turns, out):
    terms = basis.shape[1]
    centre, h, a, r, work = np.empty(3), np.empty((3, terms)), np.empty((3, 3)), np.empty((3, 3)), np.empty((4, 3, 3))
    out[:] = 0.0
    for c in range(len(ranks)):
        first, last = starts[c], starts[c + 1]
        fit(x, members, shares, basis, first, last, centre, h)
        moment(h, frames[c], a)
        nearest(a, turns[c], work, r)
        part = beta
        if keep_volume and ranks[c] == 3:
            part *= _swelling(determinant(h) / determinant(frames[c]))
        for i in range(3):
            for j in range(terms):
                h[i, j] *= part
            for j in range(3):
                rest = r[i, 0] * frames[c, 0, j] + r[i, 1] * frames[c, 1, j] + r[i, 2] * frames[c, 2, j]
                h[i, j] += (1.0 - beta) * rest
        for n in range(first, last):
            gx, gy, gz = centre[0], centre[1], centre[2]
            for j in range(terms):
                gx += h[0, j] * basis[n, j]
                gy += h[1, j] * basis[n, j]
                gz += h[2, j] * basis[n, j]
            i = members[n]
            out[i, 0] += weights[i] * gx
            out[i, 1] += weights[i] * gy
            out[i, 2] += weights[i] * gz


@numba.njit(cache=True, error_model="numpy")
def _swelling(volume):
    """What a linear map is multiplied by to restore its volume, given relative to rest."""
    if volume > HALF:
        return min(volume, DOUBLE) ** (-1.0 / 3.0)
    return 1.0 + max(volume, 0.0) / HALF * (HALF ** (-1.0 / 3.0) - 1.0)
