"""Tabulate the force on moving instruments and hooks and of threads in a scene, and the depth of instruments."""

from collections.abc import Sequence

import numba
import numpy as np
import pandas as pd

from palpate.bodies.mesh import winding_number
from palpate.collision.triangles.closest_points import POINT_TRIANGLE, closest
from palpate.scenes.motion import Motion, Moved
from palpate.table_declaration import Table

CONTACT_FORCE = Table(
    "contact_force",
    "The force on each moved instrument and hook and of each thread over time; how deep instruments are.",
    """
    scene instrument time_s: a scene, an instrument, hook or thread, and a time [s]
    force_x_n force_y_n force_z_n force_n: force of the body on it, of a thread on its first end, and magnitude [N]
    depth_m: largest depth of an instrument below the surface at rest, negative above it [m]
    """,
    always=False,
)


def contact_force(motion: Motion) -> pd.DataFrame:
    """Tabulate CONTACT_FORCE of a motion: a row for each time step and moving instrument, hook or thread.

    Instruments are points with a radius: of a ball, the axis of a rod, or the corners of a mesh. The depth is NaN for a
    floor, and in an open surface such as a sheet's, which has no inside.
    """
    tables = [_rows_of(motion, thing) for thing in motion.obstacles if np.ptp(_middles(motion, thing), axis=0).any()]
    observed = (thing.name for thing in motion.drawn if f"{thing.name}_force_x_n" in motion.observed)
    tables += [_forces(motion, name) for name in observed]
    return pd.concat(tables, ignore_index=True)[CONTACT_FORCE.columns] if tables else CONTACT_FORCE.frame([])


def _middles(motion: Motion, thing: Moved) -> np.ndarray:
    """Return the mean of an instrument's points (steps + 1, 3) [m], at the start and after each step."""
    seen = motion.observed[[f"{thing.name}_{axis}_m" for axis in "xyz"]].to_numpy()
    return np.vstack([thing.positions[0].mean(axis=0), seen])


def _rows_of(motion: Motion, thing: Moved) -> pd.DataFrame:
    """Tabulate an instrument's force and depth: its radius less the least signed distance of its points."""
    middles, corners = _middles(motion, thing), motion.rest[motion.triangles]
    shifts = middles[1:] - middles[0]  # the first is the start
    table = _forces(motion, thing.name)
    if thing.kind != "floor" and closed(motion.triangles):
        ends = thing.positions[0]  # a rod is evaluated at 9 points of its axis, anything else at its corners
        points = np.linspace(ends[0], ends[1], 9) if len(ends) == 2 else np.unique(ends, axis=0)
        table["depth_m"] = thing.radius_m - least_signed_distance(points, shifts, corners)
    return table


def _forces(motion: Motion, name: str) -> pd.DataFrame:
    """Tabulate the observed force on the instrument, hook or thread of a ``name``, without a depth."""
    forces = motion.observed[[f"{name}_force_{axis}_n" for axis in "xyz"]].to_numpy()
    columns = {f"force_{axis}_n": forces[:, i] for i, axis in enumerate("xyz")}
    return pd.DataFrame({"time_s": motion.observed["time_s"], **columns}).assign(
        scene=motion.scene, instrument=name, force_n=np.linalg.norm(forces, axis=1), depth_m=np.nan
    )


def closed(triangles: np.ndarray) -> bool:
    """Return whether triangles (m, 3) enclose a volume: every edge occurs equally often in both directions."""
    edges = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    forward, counts = np.unique(edges, axis=0, return_counts=True)
    backward, others = np.unique(edges[:, ::-1], axis=0, return_counts=True)
    return np.array_equal(forward, backward) and np.array_equal(counts, others)


def least_signed_distance(points: np.ndarray, shifts: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Compute the least signed distance (s,) [m] of ``points`` (n, 3), moved by each of ``shifts`` (s, 3), to a body.

    corners : (m, 3, 3) [m] of the triangles of the closed surface, oriented outward; distances are negative inside
    A point that moves by less than its distance stays on its side, so that few winding numbers are computed.
    """
    x = np.vstack([np.zeros((1, 3)), corners.reshape(-1, 3)])
    nodes = np.column_stack([np.zeros(len(corners), np.int64), 1 + np.arange(3 * len(corners)).reshape(-1, 3)])
    low, high = corners.min(axis=1), corners.max(axis=1)
    distances, inside, before = np.zeros(len(points)), np.zeros(len(points), dtype=bool), np.zeros(3)
    least = np.empty(len(shifts))
    for i, shift in enumerate(shifts):
        moved = points + shift
        may_cross = np.flatnonzero(distances <= np.linalg.norm(shift - before))
        inside[may_cross] = [winding_number(point, corners) > 0.5 for point in moved[may_cross]]
        distances, before = _distances(moved, x, nodes, low, high), shift
        least[i] = np.where(inside, -distances, distances).min()
    return least


@numba.njit(cache=True)
def _distances(points, x, nodes, low, high):
    """Compute the distances (n,) [m] of ``points`` (n, 3) to the nearest of the triangles ``nodes`` of ``x``.

    x : (1 + k, 3) [m], of which the first row is overwritten; low, high : (m, 3) [m] bounding boxes of the triangles
    """
    found, weights = np.empty(len(points)), np.empty(4)
    for i in range(len(points)):
        x[0] = points[i]
        best = np.inf
        for k in range(len(nodes)):
            apart = 0.0
            for axis in range(3):
                gap = max(low[k, axis] - points[i, axis], points[i, axis] - high[k, axis], 0.0)
                apart += gap * gap
            if apart < best * best:
                best = min(best, closest(POINT_TRIANGLE, x, nodes[k], weights)[0])
        found[i] = best
    return found


def contact_tables(motions: Sequence[Motion]) -> dict[str, pd.DataFrame]:
    """Return the tables contacts and contact_force of scenes with contact, by name."""
    contacts = pd.concat([m.contacts.assign(scene=m.scene) for m in motions])
    return {"contacts": contacts, "contact_force": pd.concat([contact_force(m) for m in motions])}
