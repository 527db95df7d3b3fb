"""Linear, bent, twisted and combined deformations, and what each mode of shape matching makes of them (figure 3.10)."""

from collections.abc import Callable

import numpy as np
import pandas as pd

from palpate.bodies.box import box
from palpate.bodies.material import Material
from palpate.bodies.particles import Particles
from palpate.effects import shape_matching
from palpate.effects.shape_matching import TERMS

SPACING_M, DIVISIONS = 0.02, (2, 2, 8)
STRETCH, SHEAR, BEND_1_M, TWIST_1_M = 1.25, 0.4, 5.0, 8.0
"""Stretch along z and shear of x with z, curvature of the axis, and angle a length, of the deformations."""


def _linear(q: np.ndarray) -> np.ndarray:
    """Displace by a stretch along z that keeps the volume, and a shear."""
    across = STRETCH**-0.5 - 1.0
    return q * [across, across, STRETCH - 1.0] + SHEAR * q[:, [2]] * [1.0, 0.0, 0.0]


def _bent(q: np.ndarray) -> np.ndarray:
    """Displace by a bend of the axis in x, to second order: the terms z² and xz."""
    x, z = q[:, 0], q[:, 2]
    return BEND_1_M * np.stack([0.5 * z**2, np.zeros_like(x), -x * z], axis=1)


def _twisted(q: np.ndarray) -> np.ndarray:
    """Displace by a twist around z, to second order: the terms yz and zx."""
    x, y, z = q.T
    return TWIST_1_M * np.stack([-y * z, x * z, np.zeros_like(x)], axis=1)


DEFORMATIONS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "linear": _linear,
    "bent": _bent,
    "twisted": _twisted,
    "combined": lambda q: _linear(q) + _bent(q) + _twisted(q),
}


def measure() -> pd.DataFrame:
    """Compute the goal of every particle of a block, by deformation and mode, with β = 1.

    The columns are deformation, mode, particle, rest_x_m … rest_z_m, x_m … z_m, goal_x_m … goal_z_m, and left: the root
    mean square distance from goals to particles over that from rest to particles.
    """
    body, tables = block(), []
    q = body.nodes - body.nodes.mean(axis=0)
    for deformation, displace in DEFORMATIONS.items():
        moved = displace(q)
        x = body.nodes + moved
        for mode in TERMS:
            settings = {"mode": mode, "alpha": 1.0, "beta": 1.0, "clusters": {"kind": "one"}}
            goal = np.empty_like(x)
            shape_matching.make(body, settings).goals(x, goal)
            table = pd.DataFrame({"deformation": deformation, "mode": mode, "particle": np.arange(len(x))})
            for name, places in (("rest_", body.nodes), ("", x), ("goal_", goal)):
                table[[f"{name}{axis}_m" for axis in "xyz"]] = places
            tables.append(table.assign(left=np.linalg.norm(goal - x) / np.linalg.norm(moved)))
    return pd.concat(tables, ignore_index=True)


def block() -> Particles:
    """Make the block of 3 × 3 × 9 particles of equal mass."""
    mesh = box([SPACING_M * n for n in DIVISIONS], list(DIVISIONS))
    masses, held = np.full(len(mesh.nodes), 0.01), np.empty(0, dtype=np.int64)
    return Particles("block", mesh.nodes, masses, held, mesh.triangles, mesh.tetrahedra, Material(3000.0, 0.3, 1000.0))
