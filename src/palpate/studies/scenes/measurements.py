"""What scenes are measured by: energy balance, cost of each effect and error without it, force on instruments."""

import warnings
from collections.abc import Callable, Mapping
from dataclasses import replace

import numba
import numpy as np
import pandas as pd

from palpate.bodies.particles import Particles
from palpate.collision.contact.obstacles import winding_number
from palpate.collision.triangles.closest_points import POINT_TRIANGLE, closest
from palpate.errors import InputError, NotConverged
from palpate.scenes.build_system import effect_names
from palpate.scenes.effect_registry import ELASTIC
from palpate.scenes.motion import Motion, Moved
from palpate.scenes.run_scene import run
from palpate.scenes.scene import Scene
from palpate.table import Table

ALLOWED = 1e-6
"""Share of a scene's work that a step may gain beyond its own: what the solver's tolerance leaves."""
GUARANTEED = ("backward_euler",)
"""Integrators that cannot gain energy where it is convex; of the others only the run is known."""
UNPROVEN, MUCH = ("bdf2", "reduced"), 1e-3
"""Integrators of second order, which may make energy; and the share of the work from which a run warns of it."""
HOLDS, FAILS, UNKNOWN = "holds", "does not hold", "not known"

ENERGY_BALANCE = Table(
    "energy_balance",
    "The most that the energy of each scene rose in a step beyond the work of that step.",
    """
    scene integrator: a scene, and how it is advanced
    work_j gain_j gain_of_work: most work done together, largest gain in a step [J], and their ratio
    verdict guaranteed: whether no step gains energy, and whether the integrator ensures it
    """,
)


def energy_balance(energies: pd.DataFrame, integrators: Mapping[str, str]) -> pd.DataFrame:
    """Tabulate energy_balance.csv, a row a scene: scene, integrator, work_j, gain_j, gain_of_work, verdict, guaranteed.

    energies : energy.csv; integrators : of each scene. work_j : the most that loads, weight and instruments had done
    together, or the range of the energy where nothing does work; gain_j : the most that the sum of all energies rose
    in a step beyond the work of that step. Unknown without the elastic energy, which shape matching does not have.
    """
    rows = []
    for scene, integrator in integrators.items():
        found = energies[energies["scene"] == scene].dropna(axis="columns", how="all")
        done = found["outer_work_j"]
        if "gravity_j" in found:
            done = done + found["gravity_j"].iloc[0] - found["gravity_j"]
        work = float(done.abs().max() or np.ptp(found["total_j"]))
        gain, verdict = np.nan, UNKNOWN
        if whole(found):
            gain = float(found["gain_j"].max())
            verdict = HOLDS if gain <= ALLOWED * work else FAILS
        share = gain / work if work else 0.0 * gain
        row = {"scene": scene, "integrator": integrator, "work_j": work, "gain_j": gain, "gain_of_work": share}
        rows.append(row | {"verdict": verdict, "guaranteed": integrator in GUARANTEED})
    return pd.DataFrame(rows)


def warn_of_gain(scene: Scene, energies: pd.DataFrame) -> None:
    """Warn if a step of an integrator without a proof gained more than MUCH of the work; energies : the motion's."""
    if scene.integrator not in UNPROVEN:
        return
    gained = energy_balance(energies.assign(scene=scene.name), {scene.name: scene.integrator})["gain_of_work"].iloc[0]
    if gained > MUCH:
        warnings.warn(
            f"{scene.place}: nothing proves that steps of {scene.integrator} make no energy, and one made "
            f"{gained:.1%} of the work; take shorter ones, or choose backward_euler.",
            stacklevel=2,
        )


def whole(rows: pd.DataFrame) -> bool:
    """Return whether the sum of one scene's energies includes that of its elastic effect."""
    return any(f"{name}_j" in rows for name in ELASTIC)


ENOUGH_S = 5.0
"""Total time [s] after which runs are not repeated: a long run is a mean over many steps."""

REST = "integrator"
"""Name in the table of the rest of a step, outside all effects: linear solves and the loop itself."""

EFFECTS = Table(
    "effects",
    "The time and memory that each effect takes, and the error if it is left out.",
    """
    scene effect: a scene, and an effect or "integrator", the rest of a step
    ms_per_step share_of_step memory_kb: time [ms], its share of a step, and memory [kB]
    error_if_left_out: RMS over frames and nodes / largest displacement
    """,
)


def cost(scene: Scene, particles: Particles, repeats: int) -> pd.DataFrame:
    """Measure the cost of each effect and of the integrator, one row each.

    The columns are scene, effect, ms_per_step, share_of_step and memory_kb. They are those of the run with the median
    time of ``repeats`` runs, or of as many as take ENOUGH_S; a short run before them compiles the code.
    """
    run(replace(scene, duration_s=2 * scene.step_s), particles)
    runs = [run(scene, particles)]
    while len(runs) < repeats and sum(r.seconds for r in runs) < ENOUGH_S:
        runs.append(run(scene, particles))
    runs.sort(key=lambda r: r.seconds)
    middle = runs[len(runs) // 2]
    seconds = dict(middle.effect_seconds)
    seconds[REST] = middle.seconds - sum(seconds.values())
    return pd.DataFrame(
        {
            "scene": scene.name,
            "effect": list(seconds),
            "ms_per_step": [1e3 * s / middle.steps for s in seconds.values()],
            "share_of_step": [s / middle.seconds for s in seconds.values()],
            "memory_kb": [middle.effect_kb.get(name, np.nan) for name in seconds],
        }
    )


def left_out(scene: Scene, particles: Particles, whole: Motion, progress: Callable = iter) -> pd.DataFrame:
    """Compute the error of the scene without each effect, one row each: scene, effect, error_if_left_out, note.

    The error is the root mean square over frames and nodes of the distance to the ``whole`` motion, divided by the
    largest displacement in the latter. The elastic effect has no error, since without it there is no body. Where the
    scene cannot be run without an effect, the error is NaN and the note gives the reason.
    """
    effects = effect_names(scene, particles)
    rows = [[scene.name, effects[0], np.nan, "it holds the body together"]]
    peak = float(np.linalg.norm(whole.positions - particles.nodes, axis=-1).max())
    for effect in progress(effects[1:]):
        try:
            other = run(scene, particles, without=effect).motion
            away = np.linalg.norm(other.positions - whole.positions, axis=-1)
            error = float(np.sqrt((away**2).mean()))
            rows.append([scene.name, effect, error / peak if peak else np.nan, "" if peak else "the scene is still"])
        except (NotConverged, InputError) as failure:
            rows.append([scene.name, effect, np.nan, str(failure)])
    return pd.DataFrame(rows, columns=["scene", "effect", "error_if_left_out", "note"])


ALONG = 9
"""Points of a rod's axis at which its depth is evaluated."""
CONTACT_FORCE = Table(
    "contact_force",
    "The force on each moved instrument over time, and its depth below the body's surface at rest.",
    """
    scene instrument time_s: a scene, an instrument, and a time [s]
    force_x_n force_y_n force_z_n force_n: force of the body on it, friction included, and its magnitude [N]
    depth_m: largest depth below the surface at rest, negative above it [m]
    """,
    always=False,
)


def contact_force(motion: Motion) -> pd.DataFrame:
    """Tabulate the force on every moving instrument, one row for each step and instrument.

    The instrument is a ball, the axis of a rod or the corners of a mesh, each with its radius. The depth is nan for a
    floor, and where the surface is open, as a sheet's, so that it has no inside.
    """
    tables = [_felt(motion, thing) for thing in motion.obstacles if np.ptp(_middles(motion, thing), axis=0).any()]
    return pd.concat(tables, ignore_index=True)[CONTACT_FORCE.columns] if tables else CONTACT_FORCE.frame([])


def _middles(motion: Motion, thing: Moved) -> np.ndarray:
    """Return the mean of an instrument's points, (steps + 1, 3) [m]: at the start and after each step."""
    seen = motion.observed[[f"{thing.name}_{axis}_m" for axis in "xyz"]].to_numpy()
    return np.vstack([thing.positions[0].mean(axis=0), seen])


def _felt(motion: Motion, thing: Moved) -> pd.DataFrame:
    middles, corners = _middles(motion, thing), motion.rest[motion.triangles]
    forces = motion.observed[[f"{thing.name}_force_{axis}_n" for axis in "xyz"]].to_numpy()
    depths = np.full(len(forces), np.nan)
    if thing.kind != "floor" and closed(motion.triangles):
        depths = thing.radius_m - nearest(_samples(thing.positions[0]), middles[1:] - middles[0], corners)
    columns = {f"force_{axis}_n": forces[:, i] for i, axis in enumerate("xyz")}
    return pd.DataFrame({"time_s": motion.observed["time_s"], **columns}).assign(
        scene=motion.scene, instrument=thing.name, force_n=np.linalg.norm(forces, axis=1), depth_m=depths
    )


def _samples(points: np.ndarray) -> np.ndarray:
    """Return the points at which an instrument may be deepest: its points, or points along the axis of a rod."""
    return np.linspace(points[0], points[1], ALONG) if len(points) == 2 else np.unique(points, axis=0)


def closed(triangles: np.ndarray) -> bool:
    """Return whether triangles (m, 3) enclose a volume: every edge occurs equally often in both directions."""
    edges = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    ways, counts = np.unique(edges, axis=0, return_counts=True)
    back, others = np.unique(edges[:, ::-1], axis=0, return_counts=True)
    return np.array_equal(ways, back) and np.array_equal(counts, others)


def nearest(points: np.ndarray, shifts: np.ndarray, corners: np.ndarray) -> np.ndarray:
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
