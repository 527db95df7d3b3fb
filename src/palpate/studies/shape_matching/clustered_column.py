"""Column of 60 particles in 1, 2 and 5 clusters under one load (paper 3's figure 3.11)."""

import numpy as np
import pandas as pd

from palpate.bodies.box import box
from palpate.bodies.material import Material
from palpate.bodies.particles import Particles
from palpate.effects import held, shape_matching, velocity_damping
from palpate.errors import NotConverged
from palpate.solvers import goal_position
from palpate.solvers.system import System

SPACING_M = 0.02
LAYERS = 15
EDGES_M = {1: 14 * SPACING_M, 2: 28 / 3 * SPACING_M, 5: 14 / 3 * SPACING_M}
"""Sides of the cubes by the number of clusters that they form; neighbouring cubes overlap by half."""

STEP_S, RATE_1_S = 1e-3, 100.0
STILL_M, MOST_STEPS = 1e-12, 100_000


def measure(force_n: float, alpha: float, beta: float) -> pd.DataFrame:
    """Compute the equilibrium of every particle: clusters, force_n, particle, rest_x_m … rest_z_m, x_m, y_m, z_m.

    The column of 2 × 2 × 15 particles stands on its lowest layer. It has no weight; ``force_n`` [N] on the top
    layer bends it along x. ``alpha`` and ``beta`` are its stiffness and deformation.
    Raises NotConverged if a column does not come to rest.
    """
    body = column()
    tables = []
    for count, edge in EDGES_M.items():
        cubes = {"kind": "cubes", "edge_m": edge, "overlap": 0.5}
        settings = {"mode": "quadratic", "alpha": alpha, "beta": beta, "clusters": cubes}
        table = pd.DataFrame({"clusters": count, "force_n": force_n, "particle": np.arange(len(body.nodes))})
        table[["rest_x_m", "rest_y_m", "rest_z_m"]] = body.nodes
        table[["x_m", "y_m", "z_m"]] = settle(body, shape_matching.make(body, settings), force_n)
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
    top = body.nodes[:, 2] == body.nodes[:, 2].max()
    effects = {
        "shape_matching": matched,
        "held": held.make(body, {}, None),
        "push": _Push(np.outer(top, [force_n / top.sum(), 0.0, 0.0])),
        "velocity_damping": velocity_damping.make(body, {"rate_1_s": rate_1_s}, None),
    }
    integrator = goal_position.make(System(body, effects), {})
    x, v, history = body.nodes, np.zeros_like(body.nodes), []
    for _ in range(MOST_STEPS):
        x, v = integrator.step(x, v, STEP_S)
        history.append(STEP_S * float(np.abs(v).max()) / body.size)
        if history[-1] * body.size < still_m:
            return x
    raise NotConverged(f"the column still moves after {MOST_STEPS} steps; lower its load or damp it more", history)


class _Push:
    """A constant load (n, 3) [N]."""

    def __init__(self, force: np.ndarray):
        self._force = force

    def add_force(self, x: np.ndarray, v: np.ndarray, force: np.ndarray) -> None:
        force += self._force
