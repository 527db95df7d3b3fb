"""Creep and recovery of springs with Maxwell dampers beside the closed solution of a standard linear solid (paper 3).

Springs k with Maxwell elements of stiffness r k and relaxation time τ beside each of them make, under a load that is
applied at once and stays, the displacement u = u₀ [1 − r/(1 + r) exp(−t/(τ (1 + r)))], where u₀ is that of the springs
alone (Zener 1948). That holds for each node of a network, as all its springs have the same r and τ, where displacements
are small and inertia is negligible. Loads that change are sums of such ones.
"""

from typing import Any

import numpy as np
import pandas as pd
from scipy.signal import StateSpace, lsim

from palpate.bodies.particles import Particles
from palpate.linalg.multigrid import Factor
from palpate.scenes.motion import Motion
from palpate.scenes.moved_particles import load_particles
from palpate.scenes.run_scene import compose
from palpate.scenes.settings import Scene
from palpate.solvers.system import System
from palpate.stores import stored
from palpate.table_declaration import Table

INSTANTS = 4001
"""Number of times at which the load is sampled; between them it is taken as linear."""

MAXWELL_CREEP = Table(
    "maxwell_creep",
    "The displacement of springs with Maxwell dampers over time, and its closed solution.",
    """
    scene time_s load: a scene, a time [s], and the load / its largest
    creep_m closed_m springs_m: of the node that moves farthest, by closed solution, and without dampers [m]
    """,
    always=False,
)


def measure(scene: Scene, particles: Particles, motion: Motion) -> pd.DataFrame:
    """Tabulate maxwell_creep.csv: a row for each frame of the motion of a scene with springs, maxwell and push.

    Displacements are those of the node that moves farthest in the closed solution, along its displacement.
    """
    times = np.linspace(0.0, scene.duration_s, INSTANTS)
    system = compose(scene, particles)
    loads = np.array([_load(system, time) for time in times])
    largest_load = loads[np.argmax(np.linalg.norm(loads, axis=(1, 2)))]
    shares = np.tensordot(loads, largest_load, 2) / np.vdot(largest_load, largest_load)
    static = _static(compose(scene, particles, without="maxwell"), largest_load)
    node = int(np.argmax(np.linalg.norm(static, axis=1)))
    static_m = float(np.linalg.norm(static[node]))
    direction = static[node] / static_m
    assert scene.maxwell is not None
    crept = creep(times, shares, scene.maxwell.stiffness_ratio, scene.maxwell.relaxation_s)
    return pd.DataFrame(
        {
            "scene": scene.name,
            "time_s": motion.times,
            "load": np.interp(motion.times, times, shares),
            "creep_m": (motion.positions[:, node] - motion.rest[node]) @ direction,
            "closed_m": static_m * np.interp(motion.times, times, crept),
            "springs_m": static_m * np.interp(motion.times, times, shares),
        }
    )


def creep(times: np.ndarray, loads: np.ndarray, ratio: float, relaxation_s: float) -> np.ndarray:
    """Compute the displacement (t,) of the standard linear solid at evenly spaced ``times`` (t,) [s], exactly.

    It is over the displacement of the springs alone under the load 1.
    loads : (t,), linear between the times; ratio : r of the module's text; relaxation_s : τ [s]
    """
    time_constant, delayed_share = relaxation_s * (1.0 + ratio), ratio / (1.0 + ratio)
    solid = StateSpace([[-1.0 / time_constant]], [[delayed_share / time_constant]], [[1.0]], [[1.0 - delayed_share]])
    return lsim(solid, loads, times)[1]


def closeness(table: pd.DataFrame) -> float:
    """Return the RMS difference of creep_m from closed_m in maxwell_creep.csv, over the largest closed_m."""
    error = table["creep_m"] - table["closed_m"]
    return float(np.sqrt((error**2).mean()) / table["closed_m"].abs().max())


def _load(system: System, time: float) -> np.ndarray:
    """Return the loads (n, 3) [N] at a time, zero on held nodes."""
    system.at(time)
    rest = system.particles.nodes
    return system.outer_force(rest, np.zeros_like(rest))


def _static(system: System, load: np.ndarray) -> np.ndarray:
    """Compute the linear displacements (n, 3) [m] under ``load`` (n, 3) [N]."""
    stiffness = system.stiffness(system.particles.nodes, definite=True)
    assert stiffness is not None  # springs have one
    system.hold(stiffness)
    return Factor(stiffness).solve(load)


def tabulate_shape_matching(input: Any, scene: Scene | None) -> dict[str, pd.DataFrame]:
    """Compare a scene with its closed solution, if one is named, for the rule of this name."""
    if scene is None:
        return {}
    return {"creep": measure(scene, load_particles(scene, input.bodies), stored(Motion, input.motion))}
