"""Clusters as paper 3 has them, one a tetrahedron and each with a pull of its own, beside averaged goals."""

from typing import Any

import numpy as np
import pandas as pd

from palpate.bodies.particles import Particles
from palpate.effects.held import Held
from palpate.effects.shape_matching import OVERLAPS, ShapeMatching, make_clusters
from palpate.errors import NotConverged
from palpate.solvers import goal_position
from palpate.solvers.system import System
from palpate.studies.shape_matching.clustered_column import STEP_S, column, settle

KINDS = ("tetrahedra", "each_tetrahedron")
"""Neighbourhoods until every tetrahedron is in one, and one neighbourhood for each tetrahedron."""

RATE_1_S, STILL_M = 40.0, 1e-8
"""Decay of velocities [1/s] and movement in a step [m] with which the column comes to rest quickly, within 1e-6 m."""

START_M, GROWN, STEPS, WITHIN = 1e-7, 1e3, 600, 1e-3
"""Of the search for the least unstable α: the disturbance [m], the growth that counts as unstable, within so many
steps, and the relative width at which the search ends."""


def measure(force_n: float, alpha: float, beta: float) -> pd.DataFrame:
    """Measure the rows of cluster_goals.csv: one for each kind of cluster and way to combine their goals.

    The column is that of ``clustered_column``, under the same force; with added goals α is ``alpha`` over the mean
    number of clusters of a particle, for the same mean stiffness.

    memberships : particles of all clusters together, which the cost of a step grows with
    clusters_mean, clusters_most : number of clusters of a particle
    alpha_limit : α up to which the column at rest is stable by its largest eigenvalue; alpha_limit_measured : from
        which on a small disturbance grows; both inf if above 1, where α ends
    alpha, peak_m : α of the loaded column, and the largest displacement of its particles at rest
    drift : change of the momentum in a step of the free column, over the sum of what its particles take up
    """
    body, rows = column(), []
    for kind in KINDS:
        for overlap in OVERLAPS:
            matched = _matched(body, kind, overlap, 1.0, beta)
            shared = matched.clusters.shared_by
            used = alpha / float(shared.mean()) if overlap == "sum" else alpha
            rest = settle(body, _matched(body, kind, overlap, used, beta), force_n, RATE_1_S, STILL_M)
            row = {"kind": kind, "goals": overlap, "clusters": len(matched.ranks)}
            row |= {"memberships": len(matched.clusters.members)}
            row |= {"clusters_mean": float(shared.mean()), "clusters_most": int(shared.max())}
            limit = _predicted(body, matched)
            row |= {"alpha_limit": limit, "alpha_limit_measured": _measured(body, kind, overlap, beta, limit)}
            row |= {"alpha": used, "peak_m": float(np.linalg.norm(rest - body.nodes, axis=1).max())}
            rows.append(row | {"drift": _drift(body, matched)})
    return pd.DataFrame(rows)


def _matched(body: Particles, kind: str, overlap: str, alpha: float, beta: float) -> ShapeMatching:
    """Make the shape matching without the check of α, which is to be tried beyond."""
    clusters = make_clusters(body, {"kind": kind})
    return ShapeMatching(body, clusters, "quadratic", alpha, beta, overlap == "sum")


def _predicted(body: Particles, matched: ShapeMatching) -> float:
    """Compute 4/λ, λ being the largest eigenvalue of −∂(α (g − x))/∂x at rest for α = 1; inf if it is above 1."""
    free = np.setdiff1d(np.arange(len(body.nodes)), body.held)
    unknowns = (3 * free[:, None] + np.arange(3)).ravel()
    pull = np.empty((len(unknowns), len(unknowns)))
    for number, unknown in enumerate(unknowns):
        moved = []
        for sign in (1.0, -1.0):
            x, goal = body.nodes.copy(), np.empty_like(body.nodes)
            x.ravel()[unknown] += sign * START_M
            matched.goals(x, goal)
            moved.append(matched.alpha * (x - goal).ravel()[unknowns])
        pull[:, number] = (moved[0] - moved[1]) / (2.0 * START_M)
    limit = 4.0 / float(np.linalg.eigvals(pull).real.max())
    return limit if limit <= 1.0 else np.inf


def _measured(body: Particles, kind: str, overlap: str, beta: float, predicted: float) -> float:
    """Search by bisection for the α from which on a small disturbance grows; inf if it does not at α = 1."""
    if not _grows(body, _matched(body, kind, overlap, 1.0, beta)):
        return np.inf
    stable, unstable = 0.0, 1.0
    if np.isfinite(predicted):  # nearly there, if theory is right; otherwise the search covers everything
        for guess in (0.98 * predicted, 1.02 * predicted):
            grows = _grows(body, _matched(body, kind, overlap, guess, beta))
            stable, unstable = (stable, min(unstable, guess)) if grows else (max(stable, guess), unstable)
    while unstable - stable > WITHIN * unstable:
        middle = 0.5 * (stable + unstable)
        if _grows(body, _matched(body, kind, overlap, middle, beta)):
            unstable = middle
        else:
            stable = middle
    return unstable


def _grows(body: Particles, matched: ShapeMatching) -> bool:
    """Return whether a small disturbance of the held, undamped column becomes GROWN times as large."""
    effects: dict[str, Any] = {"shape_matching": matched, "held": Held(body.held)}
    integrator = goal_position.make(System(body, effects), {})
    disturbance = np.random.default_rng(0).normal(size=body.nodes.shape)
    disturbance[body.held] = 0.0
    x, v = body.nodes + START_M * disturbance, np.zeros_like(body.nodes)
    for _ in range(STEPS):
        try:
            x, v = integrator.step(x, v, STEP_S)
        except NotConverged:
            return True
        if np.abs(x - body.nodes).max() > GROWN * START_M:
            return True
    return False


def _drift(body: Particles, matched: ShapeMatching) -> float:
    """Measure how far momentum is from kept: Σ m (g − x) over Σ m |g − x|, in a column out of shape."""
    x = body.nodes + 0.1 * body.size * np.random.default_rng(1).normal(size=body.nodes.shape)
    goal = np.empty_like(x)
    matched.goals(x, goal)
    pull = body.masses[:, None] * (goal - x)
    return float(np.linalg.norm(pull.sum(axis=0)) / np.linalg.norm(pull, axis=1).sum())
