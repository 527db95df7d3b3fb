"""Poke and release of a surface model, with and without virtual body springs (paper 3's figures 3.5 and 3.6)."""

from typing import Any

import numpy as np
import pandas as pd

from palpate.bodies.body import nest
from palpate.bodies.material import Material
from palpate.bodies.particles import Particles, particles_of
from palpate.bodies.simple_shapes import cylinder
from palpate.effects.settings import Kelvin, Load, Push, Springs
from palpate.scenes.run_scene import run
from palpate.scenes.settings import Scene
from palpate.table_declaration import Table

LENGTH_M, RADIUS_M, RING_M = 0.2, 0.03, 0.015
PRESS_S, HOLD_S, RELEASE_S, DURATION_S = 0.1, 0.9, 0.05, 2.0
MOVED = 0.1
STIFFNESS = Springs(structural_n_m=60.0, shear_n_m=30.0, bending_n_m=15.0)
DAMPING_RATIO = 0.5
DAMPED_LIKE = 10.0
"""Stiffness [N/m] of the body springs whose damping is also tested without them."""

BODY_SPRINGS = Table(
    "body_springs",
    "The displacement of the nodes around a poke over time, with and without virtual body springs.",
    """
    case body_springs_n_m: without, with their dampers only, or with body springs of this stiffness a node [N/m]
    time_s phase: time [s], and press, hold, release or after
    distance_m: mean distance of a ring's nodes from the poked one at rest [m]
    mean_displacement_m max_displacement_m nodes moved: of a ring [m], its nodes, and those above a tenth of the peak
    """,
)


def measure(force_n: float, stiffnesses_n_m: list[float]) -> pd.DataFrame:
    """Measure the rows of body_springs.csv: one for each case, time and ring of nodes around the poke."""
    particles = tube()
    frequency = np.sqrt(DAMPED_LIKE / particles.masses.mean())
    damped = {"velocity_damping": {"rate_1_s": 2.0 * DAMPING_RATIO * float(frequency)}}
    cases: list[tuple[str, float, dict[str, Any]]] = [("none", 0.0, {}), ("dampers_only", 0.0, damped)]
    for stiffness in stiffnesses_n_m:
        tied = {"body_springs": {"stiffness_n_m": stiffness, "damping_ratio": DAMPING_RATIO}}
        cases.append(("body_springs", stiffness, tied))
    return pd.concat([poke(particles, force_n, *case) for case in cases], ignore_index=True)


def tube() -> Particles:
    """Make the surface of paper 1's cylinder, 182 nodes and 360 triangles, held at both ends."""
    mesh = cylinder(LENGTH_M, RADIUS_M)
    end_nodes = np.flatnonzero(np.isin(mesh.nodes[:, 2], [0.0, LENGTH_M]))
    return particles_of(nest("tube", mesh, 0, end_nodes, Material(3000.0, 0.3, 1000.0)), 0, surface=True)


def poke(particles: Particles, force_n: float, case: str, stiffness_n_m: float, extra: dict[str, Any]) -> pd.DataFrame:
    """Simulate a poke with ``extra`` effects; return a row of BODY_SPRINGS for each time and ring around the poke."""
    at_m = np.array([RADIUS_M, 0.0, LENGTH_M / 2])
    load = Load(at_m=at_m.tolist(), force_n=[-force_n, 0.0, 0.0], press_s=PRESS_S, hold_s=HOLD_S, release_s=RELEASE_S)
    scene = Scene(
        name="body_springs",
        body=particles.name,
        integrator="symplectic_euler",
        step_s=0.002,
        duration_s=DURATION_S,
        frames=100,
        surface=True,
        springs=STIFFNESS,
        push=Push(loads=[load]),
        kelvin=Kelvin(ratio=0.1),
        **extra,
    )
    motion = run(scene, particles).motion
    distance = np.linalg.norm(particles.nodes - at_m, axis=1)
    distance = np.linalg.norm(particles.nodes - particles.nodes[np.argmin(distance)], axis=1)
    ring = (distance / RING_M + 0.5).astype(int)
    displacements = np.linalg.norm(motion.positions - particles.nodes, axis=2)
    rows = []
    for t, u in zip(motion.times, displacements, strict=True):
        phase = np.searchsorted(np.cumsum([PRESS_S, HOLD_S, RELEASE_S]), t - 1e-9)
        named = ("press", "hold", "release", "after")[phase]
        for r in np.unique(ring):
            local = u[ring == r]
            counts = len(local), int(np.sum(local > MOVED * u.max()))
            rows.append((case, stiffness_n_m, t, named, distance[ring == r].mean(), local.mean(), local.max(), *counts))
    return BODY_SPRINGS.frame(rows)
