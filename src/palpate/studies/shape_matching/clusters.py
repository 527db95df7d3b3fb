"""Deformations that modes of shape matching can follow, and columns in clusters (paper 3, figures 3.10 and 3.11)."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd

from palpate.bodies.material import Material
from palpate.bodies.particles import Particles
from palpate.bodies.simple_shapes import box
from palpate.effects import settings, shape_matching
from palpate.effects.held import Held
from palpate.effects.shape_matching import OVERLAPS, TERMS, ShapeMatching, make_clusters
from palpate.effects.velocity_damping import VelocityDamping
from palpate.errors import NotConverged
from palpate.models.springs.spring_motion import Load, Press
from palpate.solvers import goal_position
from palpate.solvers.system import System
from palpate.studies.shape_matching import body_springs_poke
from palpate.studies.shape_matching import integrator_stability as stability
from palpate.studies.shape_matching.shape_matching_timing import time_shape_matching
from palpate.table_declaration import Table

SPACING_M = 0.02
DIVISIONS = (2, 2, 8)
STRETCH, SHEAR, BEND_1_M, TWIST_1_M = 1.25, 0.4, 5.0, 8.0
"""Stretch along z and shear of x with z, curvature of the axis, and angle of twist a length, of the deformations."""


def _linear(q: np.ndarray) -> np.ndarray:
    """Return the displacement (n, 3) [m] at ``q`` (n, 3) of a stretch along z that keeps the volume, and a shear."""
    across = STRETCH**-0.5 - 1.0
    return q * [across, across, STRETCH - 1.0] + SHEAR * q[:, [2]] * [1.0, 0.0, 0.0]


def _bent(q: np.ndarray) -> np.ndarray:
    """Return the displacement (n, 3) [m] at ``q`` (n, 3) of a bend of the axis in x, to second order: z² and xz."""
    x, z = q[:, 0], q[:, 2]
    return BEND_1_M * np.stack([0.5 * z**2, np.zeros_like(x), -x * z], axis=1)


def _twisted(q: np.ndarray) -> np.ndarray:
    """Return the displacement (n, 3) [m] at ``q`` (n, 3) of a twist around z, to second order: yz and zx."""
    x, y, z = q.T
    return TWIST_1_M * np.stack([-y * z, x * z, np.zeros_like(x)], axis=1)


DEFORMATIONS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "linear": _linear,
    "bent": _bent,
    "twisted": _twisted,
    "combined": lambda q: _linear(q) + _bent(q) + _twisted(q),
}

DEFORMATION_MODES = Table(
    "deformation_modes",
    "The goals that each mode of shape matching has for a block that is deformed in four ways.",
    """
    deformation mode particle: a deformation, a mode of shape matching, and a particle
    rest_x_m rest_y_m rest_z_m x_m y_m z_m goal_x_m goal_y_m goal_z_m: its place at rest, deformed, and its goal [m]
    left: RMS distance from goals to particles / from rest to particles
    """,
)


def deformation_modes() -> pd.DataFrame:
    """Compute the rows of deformation_modes.csv: the goals of a deformed block in each mode, with β = 1."""
    body, tables = block(), []
    from_centre = body.nodes - body.nodes.mean(axis=0)
    for deformation, displace in DEFORMATIONS.items():
        displacement = displace(from_centre)
        x = body.nodes + displacement
        for mode in TERMS:
            matching = settings.ShapeMatching.model_validate({"mode": mode, "alpha": 1.0, "beta": 1.0})
            goal = np.empty_like(x)
            shape_matching.make(body, matching).goals(x, goal)
            table = pd.DataFrame({"deformation": deformation, "mode": mode, "particle": np.arange(len(x))})
            for name, places in (("rest_", body.nodes), ("", x), ("goal_", goal)):
                table[[f"{name}{axis}_m" for axis in "xyz"]] = places
            tables.append(table.assign(left=np.linalg.norm(goal - x) / np.linalg.norm(displacement)))
    return pd.concat(tables, ignore_index=True)


def block() -> Particles:
    """Make the block of 3 × 3 × 9 particles of equal mass."""
    mesh = box([SPACING_M * n for n in DIVISIONS], list(DIVISIONS))
    masses, held = np.full(len(mesh.nodes), 0.01), np.empty(0, dtype=np.int64)
    return Particles("block", mesh.nodes, masses, held, mesh.triangles, mesh.tetrahedra, Material(3000.0, 0.3, 1000.0))


LAYERS = 15
EDGES_M = {1: 14 * SPACING_M, 2: 28 / 3 * SPACING_M, 5: 14 / 3 * SPACING_M}
"""Sides [m] of cubes by the number of clusters that they form; neighbouring cubes overlap by half."""

STEP_S, RATE_1_S = 1e-3, 100.0
STILL_M, MOST_STEPS = 1e-12, 100_000

CLUSTERS = Table(
    "clusters",
    "The rest position and the bent position of every particle of a column, for each number of clusters.",
    """
    clusters force_n particle: number of clusters, load on the top layer [N], and a particle
    rest_x_m rest_y_m rest_z_m x_m y_m z_m: its place at rest and bent [m]
    """,
)


def clustered_column(force_n: float, alpha: float, beta: float) -> pd.DataFrame:
    """Compute the rows of clusters.csv: the equilibrium of a column in each number of clusters.

    The column of 2 × 2 × 15 particles stands on its lowest layer. It has no weight; ``force_n`` [N] on the top layer
    bends it along x. alpha, beta : stiffness and deformation of shape matching
    Raises NotConverged if a column does not come to rest.
    """
    body = column()
    tables = []
    for count, edge in EDGES_M.items():
        cubes = settings.Clusters(kind="cubes", edge_m=edge)
        matching = settings.ShapeMatching(mode="quadratic", alpha=alpha, beta=beta, clusters=cubes)
        table = pd.DataFrame({"clusters": count, "force_n": force_n, "particle": np.arange(len(body.nodes))})
        table[["rest_x_m", "rest_y_m", "rest_z_m"]] = body.nodes
        table[["x_m", "y_m", "z_m"]] = settle(body, shape_matching.make(body, matching), force_n)
        tables.append(table)
    return pd.concat(tables, ignore_index=True)


def column() -> Particles:
    """Make the column of 2 × 2 × 15 particles, held at its foot."""
    side, height = SPACING_M, (LAYERS - 1) * SPACING_M
    mesh = box([side, side, height], [1, 1, LAYERS - 1])
    soft = Material(3000.0, 0.3, 1000.0)
    masses = np.full(len(mesh.nodes), soft.density_kg_m3 * side * side * height / len(mesh.nodes))
    foot = np.flatnonzero(mesh.nodes[:, 2] == 0.0)
    return Particles("column", mesh.nodes, masses, foot, mesh.triangles, mesh.tetrahedra, soft)


def settle(
    body: Particles,
    matched: shape_matching.ShapeMatching,
    force_n: float,
    rate_1_s: float = RATE_1_S,
    still_m: float = STILL_M,
) -> np.ndarray:
    """Compute the positions (n, 3) [m] of the column at rest, under ``force_n`` [N] along x on its top layer.

    rate_1_s : decay of velocities [1/s]; still_m : movement in a step [m] below which it is at rest
    Raises NotConverged if it does not come to rest.
    """
    top = np.flatnonzero(body.nodes[:, 2] == body.nodes[:, 2].max())
    push = Load(Press("on the top layer", top, np.array([force_n / len(top), 0.0, 0.0]), 1.0))
    push.factor = 1.0
    effects = {
        "shape_matching": matched,
        "held": Held(body.held),
        "push": push,
        "velocity_damping": VelocityDamping(body.masses, rate_1_s),
    }
    integrator = goal_position.make(System(body, effects))
    x, v, history = body.nodes, np.zeros_like(body.nodes), []
    for _ in range(MOST_STEPS):
        x, v = integrator.step(x, v, STEP_S)
        history.append(STEP_S * float(np.abs(v).max()) / body.size)
        if history[-1] * body.size < still_m:
            return x
    raise NotConverged(f"the column still moves after {MOST_STEPS} steps; lower its load or damp it more", history)


KINDS = ("tetrahedra", "each_tetrahedron")
"""Kinds of clusters: neighbourhoods until every tetrahedron is in one, and one for each tetrahedron."""

QUICK_RATE_1_S, QUICK_STILL_M = 40.0, 1e-8
"""Decay of velocities [1/s] and movement in a step [m] with which the column comes to rest quickly, within 1e-6 m."""

START_M, GROWN, RUN_STEPS, WITHIN = 1e-7, 1e3, 600, 1e-3
"""Of the search for the limit of stable α: the disturbance [m], the factor of growth that is unstable, the steps that
are simulated, and the relative width at which the search ends."""

CLUSTER_GOALS = Table(
    "cluster_goals",
    "The column in clusters as the thesis has them, one a tetrahedron and added, beside fewer and averaged ones.",
    """
    kind goals: clusters that cover tetrahedra, or one for each; and goals averaged or added
    clusters memberships clusters_mean clusters_most: clusters, their particles together, and clusters a particle
    alpha_limit alpha_limit_measured: largest stable α, by the eigenvalue and simulated; inf above 1
    alpha peak_m: of the loaded column, and its largest displacement [m]
    drift: change of momentum in a step over the sum of what particles take up
    """,
)


def cluster_goals(force_n: float, alpha: float, beta: float) -> pd.DataFrame:
    """Measure the rows of cluster_goals.csv: one for each kind of clusters, with their goals averaged or added.

    The column is that of ``clustered_column``, under the same force. Where goals are added, α is ``alpha`` over the
    mean number of clusters of a particle, for the same mean stiffness.
    """
    body, rows = column(), []
    for kind in KINDS:
        for overlap in OVERLAPS:
            matched = _matched(body, kind, overlap, 1.0, beta)
            overlaps = matched.clusters.shared_by
            used_alpha = alpha / float(overlaps.mean()) if overlap == "sum" else alpha
            rest = settle(body, _matched(body, kind, overlap, used_alpha, beta), force_n, QUICK_RATE_1_S, QUICK_STILL_M)
            limit = _predicted_limit(body, matched)
            counts = len(matched.ranks), len(matched.clusters.members), float(overlaps.mean()), int(overlaps.max())
            limits = limit, _measured_limit(body, kind, overlap, beta, limit)
            peak = float(np.linalg.norm(rest - body.nodes, axis=1).max())
            rows.append((kind, overlap, *counts, *limits, used_alpha, peak, _drift(body, matched)))
    return CLUSTER_GOALS.frame(rows)


def _matched(body: Particles, kind: str, overlap: str, alpha: float, beta: float) -> ShapeMatching:
    """Make the shape matching of a column, without the check of α, as unstable ones are tried."""
    clusters = make_clusters(body, settings.Clusters.model_validate({"kind": kind}))
    return ShapeMatching(body, clusters, "quadratic", alpha, beta, overlap == "sum")


def _predicted_limit(body: Particles, matched: ShapeMatching) -> float:
    """Compute the limit of stable α from the linearised scheme; inf if it is above 1.

    It is 4/λ with the largest eigenvalue λ of the ``derivative`` of x − g(x), for goals g, at rest and α = 1.
    """
    free = np.setdiff1d(np.arange(len(body.nodes)), body.held)
    unknowns = (3 * free[:, None] + np.arange(3)).ravel()
    derivative = np.empty((len(unknowns), len(unknowns)))
    for column, unknown in enumerate(unknowns):
        pulls = []
        for sign in (1.0, -1.0):
            x, goal = body.nodes.copy(), np.empty_like(body.nodes)
            x.ravel()[unknown] += sign * START_M
            matched.goals(x, goal)
            pulls.append(matched.alpha * (x - goal).ravel()[unknowns])
        derivative[:, column] = (pulls[0] - pulls[1]) / (2.0 * START_M)
    limit = 4.0 / float(np.linalg.eigvals(derivative).real.max())
    return limit if limit <= 1.0 else np.inf


def _measured_limit(body: Particles, kind: str, overlap: str, beta: float, predicted: float) -> float:
    """Search by bisection, first near ``predicted``, the least α at which a disturbance grows; inf if none up to 1."""

    def grows(alpha: float) -> bool:
        return _grows(body, _matched(body, kind, overlap, alpha, beta))

    if not grows(1.0):
        return np.inf
    stable, unstable = 0.0, 1.0
    if np.isfinite(predicted):  # nearly there, if theory is right; otherwise the search covers everything
        for guess in (0.98 * predicted, 1.02 * predicted):
            stable, unstable = (stable, min(unstable, guess)) if grows(guess) else (max(stable, guess), unstable)
    while unstable - stable > WITHIN * unstable:
        middle = 0.5 * (stable + unstable)
        stable, unstable = (stable, middle) if grows(middle) else (middle, unstable)
    return unstable


def _grows(body: Particles, matched: ShapeMatching) -> bool:
    """Return whether a small disturbance of the held, undamped column becomes GROWN times as large."""
    effects: dict[str, Any] = {"shape_matching": matched, "held": Held(body.held)}
    integrator = goal_position.make(System(body, effects))
    disturbance = np.random.default_rng(0).normal(size=body.nodes.shape)
    disturbance[body.held] = 0.0
    x, v = body.nodes + START_M * disturbance, np.zeros_like(body.nodes)
    for _ in range(RUN_STEPS):
        try:
            x, v = integrator.step(x, v, STEP_S)
        except NotConverged:
            return True
        if np.abs(x - body.nodes).max() > GROWN * START_M:
            return True
    return False


def _drift(body: Particles, matched: ShapeMatching) -> float:
    """Return the relative change of momentum by goals g in a random deformation: |Σ m (g − x)| over Σ m |g − x|."""
    x = body.nodes + 0.1 * body.size * np.random.default_rng(1).normal(size=body.nodes.shape)
    goal = np.empty_like(x)
    matched.goals(x, goal)
    pull = body.masses[:, None] * (goal - x)
    return float(np.linalg.norm(pull.sum(axis=0)) / np.linalg.norm(pull, axis=1).sum())


def measure_experiments(
    integrator_stability: dict, clusters: dict, body_springs: dict, shape_matching_timing: dict, say: Callable
) -> dict[str, pd.DataFrame]:
    """Measure all experiments but creep, for the rule of this name."""
    return {
        "integrator_stability": stability.measure(**integrator_stability),
        "clusters": clustered_column(**clusters),
        "cluster_goals": cluster_goals(**clusters),
        "deformation_modes": deformation_modes(),
        "body_springs": body_springs_poke.measure(**body_springs),
        "shape_matching_timing": time_shape_matching(shape_matching_timing, say),
    }
