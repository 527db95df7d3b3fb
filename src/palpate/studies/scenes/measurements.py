"""What scenes are measured by: energy balance, cost of each effect, and the error without it."""

import warnings
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pandas as pd

from palpate.bodies.particles import Particles
from palpate.errors import InputError, NotConverged
from palpate.run.job import steps
from palpate.scenes.effect_registry import ELASTIC
from palpate.scenes.motion import Motion
from palpate.scenes.moved_particles import load_particles
from palpate.scenes.run_scene import Run, decisions, effect_names, run
from palpate.scenes.scene_check import RELAXED
from palpate.scenes.settings import Scene
from palpate.stores import store, stored
from palpate.studies.scenes.contact_force import contact_tables
from palpate.table_declaration import Table

ALLOWED = 1e-6
"""Share of a scene's work that a step may gain beyond its own: what the solver's tolerance leaves."""
GUARANTEED = "backward_euler"
"""The integrator that cannot gain energy where it is convex; of the others only the run is known."""
UNPROVEN, MUCH = ("bdf2", "touching", *RELAXED), 1e-3
"""Implicit integrators that may make energy, and the share of the work from which a run warns of it."""
DOUBTED = 0.01
"""Share of its peak by which a motion in modes may doubt itself without a warning."""
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
    """Tabulate energy_balance.csv, a row a scene.

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
        rows.append(row | {"verdict": verdict, "guaranteed": integrator == GUARANTEED})
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


def warn_of_doubt(scene: Scene, moved: Motion) -> None:
    """Warn if a motion in modes doubts itself by more than DOUBTED of its peak."""
    if "doubt_m" not in moved.energy:
        return
    doubts, peak = moved.energy["doubt_m"], np.linalg.norm(moved.positions - moved.rest, axis=2).max()
    if peak and doubts.max() > DOUBTED * peak:
        worst = moved.energy["time_s"][doubts.idxmax()]
        size = f"a doubt of {doubts.max() / peak:.1%} of the peak" if np.isfinite(doubts.max()) else "without a limit"
        warnings.warn(
            f"{scene.place}: at {worst:.3g} s its modes lack what moves there, {size} by what all elements say "
            f"(doubt_m in energy.csv; up to {DOUBTED:.0%} is usual); choose backward_euler, or a path that is pressed "
            "less.",
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


def cost(scene: Scene, particles: Particles, first: Run, repeats: int) -> pd.DataFrame:
    """Measure the cost of each effect and of the integrator, one row each, as EFFECTS has it.

    It is that of the run with the median time of the ``first`` run and others, ``repeats`` in all, or as many as take
    ENOUGH_S.
    """
    runs = [first]
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


def simulate_scene(input: Any, output: Any, scene: Scene, say: Callable) -> dict[str, pd.DataFrame]:
    """Simulate a scene, write its motion and measure its effects, for the rule of that name."""
    particles = load_particles(scene, input.bodies)
    table = decisions(scene, particles)
    for row in table.itertuples():
        say(f"{scene.name}: {row.effect} {'yes' if row.called else 'no'}; {row.reason}")
    run(scene.but(duration_s=2 * scene.step_s), particles)  # compiles the code, so that the next run is timed
    first = run(scene, load_particles(scene, input.bodies), steps(say, f"{scene.name}: step"))
    warn_of_gain(scene, first.motion.energy)
    warn_of_doubt(scene, first.motion)
    store(first.motion, output.motion)
    costs = cost(scene, particles, first, repeats=3)
    progress = steps(say, f"{scene.name}: without effect")
    errors = left_out(scene, load_particles(scene, input.bodies), stored(Motion, output.motion), progress)
    return {"decisions": table, "cost": costs, "left_out": errors}


def tabulate_scenes(input: Any, integrators: dict[str, str]) -> Any:
    """Put the tables of all scenes together, for the rule of that name."""
    costs, errors = (pd.concat(map(pd.read_csv, paths)) for paths in (input.costs, input.errors))
    energies = {found.scene: found.energy for found in (stored(Motion, path) for path in input.motions)}
    energy = pd.concat(energies, names=["scene", "frame"]).reset_index("scene")
    touching = [stored(Motion, path) for path in input.touching]
    return (contact_tables(touching) if touching else {}) | {
        "scene_effects": pd.concat(map(pd.read_csv, input.decisions)),
        "effects": costs.merge(errors, on=["scene", "effect"], how="left"),
        "energy": energy,
        "energy_balance": energy_balance(energy, integrators),
    }
