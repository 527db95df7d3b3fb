"""Tables of contact: position, direction, gap, relative velocity and force."""

import numpy as np
import pandas as pd

from palpate.collision.contact.friction import lagged_friction
from palpate.collision.contact.obstacles import Obstacle
from palpate.collision.contact.proximity import NearStencils


def contact_table(
    near: NearStencils, points: np.ndarray, velocities: np.ndarray, names: list[str], radii: np.ndarray
) -> pd.DataFrame:
    """Tabulate each pair in contact at ``points`` (n, 3) [m], of surfaces with ``radii`` (p,) [m] around them.

    velocities : (n, 3) [m/s] of the points
    first, second : names of the surfaces, in the order of ``names``; x_m, y_m, z_m : midway between them;
    normal_x … : from the second to the first; gap_m : their clearance, never negative (a depth, less than zero);
    velocity_x_m_s … : of the first relative to the second there; force_n : along the normal
    """
    active = lagged_friction(*near.barrier, points, 1.0, 1.0, points)
    sides, normals = near.pieces[active.rows], active.normals
    ends = np.einsum("ki,kij->kj", np.maximum(active.weights, 0.0), points[active.nodes])
    others = -np.einsum("ki,kij->kj", np.minimum(active.weights, 0.0), points[active.nodes])
    distance = np.linalg.norm(ends - others, axis=1)
    middle = 0.5 * (ends + others) + 0.5 * (radii[sides[:, 1]] - radii[sides[:, 0]])[:, None] * normals
    order = np.where(sides[:, 0] <= sides[:, 1], 1.0, -1.0)[:, None]
    normals = order * normals
    moving = order * np.einsum("ki,kij->kj", active.weights, velocities[active.nodes])
    sides = np.sort(sides, axis=1).T
    columns = {side: [names[i] for i in pieces] for side, pieces in zip(("first", "second"), sides, strict=True)}
    columns |= {f"{letter}_m": middle[:, axis] for axis, letter in enumerate("xyz")}
    columns |= {f"normal_{letter}": normals[:, axis] for axis, letter in enumerate("xyz")}
    columns |= {f"velocity_{letter}_m_s": moving[:, axis] for axis, letter in enumerate("xyz")}
    return pd.DataFrame(columns | {"gap_m": distance - near.offsets[active.rows], "force_n": active.forces})


def observe_obstacles(
    obstacles: list[Obstacle], points: list[np.ndarray], forces: list[np.ndarray]
) -> dict[str, float]:
    """Record each obstacle's mean point, ``<name>_x_m`` …, and the force on it, ``<name>_force_x_n`` …"""
    row = {}
    for obstacle, positions, force in zip(obstacles, points, forces, strict=True):
        for axis, letter in enumerate("xyz"):
            row[f"{obstacle.name}_{letter}_m"] = float(positions[:, axis].mean())
            row[f"{obstacle.name}_force_{letter}_n"] = float(force[axis])
    return row
