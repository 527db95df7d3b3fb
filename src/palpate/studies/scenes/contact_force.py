"""Tabulate the force on moving instruments and hooks and of threads in a scene, and the depth of instruments."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from palpate.bodies.mesh import winding_number
from palpate.bodies.mesh_quality import is_closed
from palpate.bodies.surfaces.triangles import distances
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
    """Tabulate an instrument's force, and its depth [m]: radius less its points' distance to the rest surface."""
    centres, facets = _middles(motion, thing), motion.rest[motion.triangles]
    shifts = centres[1:] - centres[0]  # of the instrument since the start [m], one a step
    rows = _forces(motion, thing.name)
    if thing.kind != "floor" and is_closed(motion.triangles):
        starts = thing.positions[0]  # two are a rod, of whose axis 9 points are taken
        points = np.linspace(starts[0], starts[1], 9) if len(starts) == 2 else np.unique(starts, axis=0)
        rows["depth_m"] = thing.radius_m - least_signed_distance(points, shifts, facets)
    return rows


def _forces(motion: Motion, name: str) -> pd.DataFrame:
    """Tabulate the observed force on the instrument, hook or thread of a ``name``, without a depth."""
    forces = motion.observed[[f"{name}_force_{axis}_n" for axis in "xyz"]].to_numpy()
    columns = {f"force_{axis}_n": forces[:, i] for i, axis in enumerate("xyz")}
    return pd.DataFrame({"time_s": motion.observed["time_s"], **columns}).assign(
        scene=motion.scene, instrument=name, force_n=np.linalg.norm(forces, axis=1), depth_m=np.nan
    )


def least_signed_distance(points: np.ndarray, shifts: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Compute for each of ``shifts`` (s, 3) [m] the least signed distance (s,) [m] of the shifted ``points`` to a body.

    points : (n, 3) [m]; corners : (m, 3, 3) [m] of its surface's triangles, closed and outward; it is negative inside
    A winding number tells inside from outside; it is computed where a point moved by its distance or more.
    """
    moved = points + shifts[:, None]
    facets = np.arange(3 * len(corners)).reshape(-1, 3)
    unsigned = distances(moved.reshape(-1, 3), corners.reshape(-1, 3), facets).reshape(moved.shape[:2])
    inside, may_cross = np.zeros(unsigned.shape, dtype=bool), np.ones(unsigned.shape, dtype=bool)
    may_cross[1:] = unsigned[:-1] <= np.linalg.norm(np.diff(moved, axis=0), axis=2)
    for step, places in enumerate(moved):
        inside[step] = inside[step - 1]
        unsure = may_cross[step]
        inside[step, unsure] = [winding_number(point, corners) > 0.5 for point in places[unsure]]
    return np.where(inside, -unsigned, unsigned).min(axis=1)


def contact_tables(motions: Sequence[Motion]) -> dict[str, pd.DataFrame]:
    """Return the tables contacts and contact_force of scenes with contact, by name."""
    contacts = pd.concat([m.contacts.assign(scene=m.scene) for m in motions])
    return {"contacts": contacts, "contact_force": pd.concat([contact_force(m) for m in motions])}
