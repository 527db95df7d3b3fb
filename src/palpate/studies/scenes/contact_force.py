"""Tabulate the force on moving instruments of a scene, with their depth in the body, on hooks and of threads."""

from collections.abc import Sequence

import numba
import numpy as np
import pandas as pd

from palpate.collision.contact.obstacles import winding_number
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
    """Tabulate the force on every moving instrument and hook and of every thread, one row for each of these and step.

    The instrument is a ball, the axis of a rod or the corners of a mesh, each with its radius. The depth is nan for a
    floor, and where the surface is open, as a sheet's, so that it has no inside.
    """
    tables = [_rows_of(motion, thing) for thing in motion.obstacles if np.ptp(_middles(motion, thing), axis=0).any()]
    told = (thing.name for thing in motion.drawn if f"{thing.name}_force_x_n" in motion.observed)
    tables += [_forces(motion, name) for name in told]
    return pd.concat(tables, ignore_index=True)[CONTACT_FORCE.columns] if tables else CONTACT_FORCE.frame([])


def _middles(motion: Motion, thing: Moved) -> np.ndarray:
    """Return the mean of an instrument's points, (steps + 1, 3) [m]: at the start and after each step."""
    seen = motion.observed[[f"{thing.name}_{axis}_m" for axis in "xyz"]].to_numpy()
    return np.vstack([thing.positions[0].mean(axis=0), seen])


def _rows_of(motion: Motion, thing: Moved) -> pd.DataFrame:
    """Tabulate an instrument's force and depth: its radius less the least signed distance of its moved points."""
    middles, corners = _middles(motion, thing), motion.rest[motion.triangles]
    shifts = middles[1:] - middles[0]  # the first is the start
    table = _forces(motion, thing.name)
    if thing.kind != "floor" and closed(motion.triangles):
        ends = thing.positions[0]  # a rod is evaluated at 9 points of its axis, anything else at its corners
        points = np.linspace(ends[0], ends[1], 9) if len(ends) == 2 else np.unique(ends, axis=0)
        table["depth_m"] = thing.radius_m - least_signed_distance(points, shifts, corners)
    return table


def _forces(motion: Motion, name: str) -> pd.DataFrame:
    """Tabulate what was observed of the force on an instrument, or whatever has this name; no depth."""
    forces = motion.observed[[f"{name}_force_{axis}_n" for axis in "xyz"]].to_numpy()
    columns = {f"force_{axis}_n": forces[:, i] for i, axis in enumerate("xyz")}
    return pd.DataFrame({"time_s": motion.observed["time_s"], **columns}).assign(
        scene=motion.scene, instrument=name, force_n=np.linalg.norm(forces, axis=1), depth_m=np.nan
    )


def closed(triangles: np.ndarray) -> bool:
    """Return whether triangles (m, 3) enclose a volume: every edge occurs equally often in both directions."""
    edges = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    ways, counts = np.unique(edges, axis=0, return_counts=True)
    back, others = np.unique(edges[:, ::-1], axis=0, return_counts=True)
    return np.array_equal(ways, back) and np.array_equal(counts, others)


def least_signed_distance(points: np.ndarray, shifts: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Compute the least signed distance (s,) [m] of ``points`` (n, 3) + ``shifts[i]``, (s, 3), to a closed surface.

    corners : (m, 3, 3) [m] of its triangles, oriented outward; the distance is negative inside

    A point that moved by less than its distance is still on the same side, so that few winding numbers are computed.
    """
    x = np.vstack([np.zeros((1, 3)), corners.reshape(-1, 3)])
    nodes = np.column_stack([np.zeros(len(corners), np.int64), 1 + np.arange(3 * len(corners)).reshape(-1, 3)])
    low, high = corners.min(axis=1), corners.max(axis=1)
    room, inside, before = np.zeros(len(points)), np.zeros(len(points), dtype=bool), np.zeros(3)
    found = np.empty(len(shifts))
    for i, shift in enumerate(shifts):
        moved = points + shift
        unsure = np.flatnonzero(room <= np.linalg.norm(shift - before))
        inside[unsure] = [winding_number(point, corners) > 0.5 for point in moved[unsure]]
        room, before = _distances(moved, x, nodes, low, high), shift
        found[i] = np.where(inside, -room, room).min()
    return found


@numba.njit(cache=True)
def _distances(points, x, nodes, low, high):
    """Compute the distances (n,) [m] of ``points`` to triangles in boxes ``low`` to ``high``; overwrites ``x[0]``."""
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
    """Return the contacts and the forces of scenes in which something touches, by name of the table."""
    contacts = pd.concat([m.contacts.assign(scene=m.scene) for m in motions])
    return {"contacts": contacts, "contact_force": pd.concat([contact_force(m) for m in motions])}
