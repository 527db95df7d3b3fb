"""Shape matching: each cluster of particles moves towards the best fit of its rest shape."""

import numba
import numpy as np

from palpate.bodies.particles import Particles
from palpate.effects.effect import Effect, Goals
from palpate.effects.shape_matching.clustering import Clusters, make_clusters
from palpate.effects.shape_matching.polynomial_fit import TERMS, determinant, fit, moment, orthonormal_terms
from palpate.errors import InputError
from palpate.linalg.nearest_rotation import nearest
from palpate.linalg.nearest_rotation import rotations as rotations

OVERLAPS = ("mean", "sum")
"""Ways to move a particle of several clusters: to the mean of its goals, or towards each of them."""

HALF, DOUBLE = 0.5, 2.0
"""Range of volumes, relative to rest, in which the linear mode restores the volume completely."""


def make(particles: Particles, settings: dict, elastic: Effect | None = None) -> "ShapeMatching":
    """Make the shape matching of ``particles``.

    settings : ``mode`` (rigid, linear or quadratic), ``alpha`` (fraction of the way to the goals in a step, 0 to 1),
        ``beta`` (share of the deformation in the goals, 0 to 1; none in rigid), ``clusters`` (see ``make_clusters``),
        ``goals`` of a particle in several clusters (mean, unless it is given, or sum)

    Raises InputError for a setting out of range, clusters that do not hold the body together, a body of several
    stiffnesses, or goals whose sum may be unstable.
    """
    particles.refuse_regions("shape matching has")
    if settings["mode"] not in TERMS:
        raise InputError(f"shape_matching.mode {settings['mode']} is unknown: choose one of {', '.join(TERMS)}")
    for name in ("alpha", "beta"):
        if not 0.0 <= settings[name] <= 1.0:
            raise InputError(f"shape_matching.{name} is {settings[name]}: give a number from 0 to 1")
    overlap = settings.get("goals", OVERLAPS[0])
    if overlap not in OVERLAPS:
        raise InputError(f"shape_matching.goals {overlap} is unknown: choose one of {', '.join(OVERLAPS)}")
    clusters = make_clusters(particles, settings["clusters"])
    matched = ShapeMatching(
        particles, clusters, settings["mode"], settings["alpha"], settings["beta"], overlap == "sum"
    )
    if not matched.alpha < 4.0:
        raise InputError(
            f"shape_matching.alpha is {settings['alpha']}, and with goals: sum a particle in {matched.most} clusters "
            f"is sure to stay stable below {4.0 / matched.most:.3g} only; lower alpha, or choose goals: mean."
        )
    return matched


class ShapeMatching(Goals):
    """Goals of overlapping clusters (Müller, Heidelberger, Teschner, Gross 2005; paper 3, chapter 3).

    frames : (n_clusters, 3, 3) [m], the rest shape as q = L φ; plasticity changes it in place
    alpha : fraction of the way to its goal that a particle moves in a step; with ``add`` times ``most``, the largest
        number of clusters that a particle is in

    A particle's mass is divided equally among its clusters, and its goal is the mean of theirs. The goals of each
    cluster conserve its linear and angular momentum, so α (g − x) conserves that of the body for any overlap.

    ``add`` follows the paper to the letter: each cluster has the whole masses of its particles and moves them by its
    own α (g − x), so that a particle in k clusters moves by the sum, as with kα towards the mean. Momentum is conserved
    too, but stiffness depends on the overlap, and no step is sure to be stable with α above 4/``most``.

    Two changes to the paper: the mean of the terms q̃ is subtracted, as otherwise quadratic goals move the centre of
    mass; and det(A)^(−1/3) of the linear mode, infinite for a flat cluster, is constant above DOUBLE the volume, and
    below HALF decreases linearly to 1 at volume 0 and stays 1 for an inverted cluster. Without these bounds an undamped
    body that starts flat or inverted reaches a thousand times its size after 2000 steps with α = 1; with them, tens of
    times after 10 000, still growing. So use damping if a body may start in such a state.

    Traps: the force α m (g − x)/h² depends on the step, and except in the rigid mode it is not a gradient, so there is
    no energy. With β = 1 goals follow any linear or quadratic shape, inverted ones included. Clusters that share only a
    layer of particles have further shapes of equilibrium, turned inside out, which an extreme start may lead to; with
    clusters that share half of their particles, no such start was found.
    """

    def __init__(
        self, particles: Particles, clusters: Clusters, mode: str, alpha: float, beta: float, add: bool = False
    ):
        self.most = int(clusters.shared_by.max()) if add else 1
        self.alpha, self.clusters, self.mode = alpha * self.most, clusters, mode
        self._beta = 0.0 if mode == "rigid" else beta
        self._weights = 1.0 / clusters.shared_by
        self._pull = (clusters.shared_by / self.most)[:, None] if add else None
        masses = (particles.masses if add else particles.masses * self._weights)[clusters.members]
        self.shares, self.basis, self.frames, self.ranks = orthonormal_terms(
            particles.nodes, masses, clusters.members, clusters.starts, TERMS[mode]
        )
        self._turns = np.tile([1.0, 0.0, 0.0, 0.0], (len(self.ranks), 1))

    def goals(self, x: np.ndarray, out: np.ndarray) -> None:
        """Write the goal positions (n, 3) [m] for positions ``x`` (n, 3) [m] into ``out``.

        The search for each cluster's rotation begins at the previous one. That changes the result by rounding errors
        only, unless several rotations are equally near.
        """
        rest = (self.clusters.members, self.clusters.starts, self.shares, self.basis, self.frames, self.ranks)
        _goals(x, *rest, self._beta, self.mode == "linear", self._weights, self._turns, out)
        if self._pull is not None:
            out[:] = x + self._pull * (out - x)


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
            part *= _volume_factor(determinant(h) / determinant(frames[c]))
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
def _volume_factor(volume):
    """Compute the factor of a linear map that restores its volume, which is given relative to rest."""
    if volume > HALF:
        return min(volume, DOUBLE) ** (-1.0 / 3.0)
    return 1.0 + max(volume, 0.0) / HALF * (HALF ** (-1.0 / 3.0) - 1.0)
