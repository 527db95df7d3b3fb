"""Measure scenes: their energy balance, the cost of each effect, and the error without it."""

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
"""Largest gain of energy in a step, over a scene's work, that the solver's tolerance explains."""
GUARANTEED = "backward_euler"
"""The integrator that cannot gain energy where the energy is convex; nothing is proved of the others."""
UNPROVEN, MUCH = ("bdf2", "touching", *RELAXED), 1e-3
"""Implicit integrators that may gain energy, and the gain over the work from which on a run warns of it."""
DOUBTED = 0.01
"""Estimated error of a motion in modes, over its peak, from which on a run warns of it."""
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

    energies : energy.csv; integrators : by scene
    work_j is the largest work of loads, weight and instruments together, or the range of the energy where nothing does
    work; gain_j the most that the total energy rose in a step beyond the work of that step. The verdict is UNKNOWN
    without an elastic energy, which shape matching does not have.
    """
    rows = []
    for scene, integrator in integrators.items():
        of_scene = energies[energies["scene"] == scene].dropna(axis="columns", how="all")
        works = of_scene["outer_work_j"]
        if "gravity_j" in of_scene:
            works = works + of_scene["gravity_j"].iloc[0] - of_scene["gravity_j"]
        work = float(works.abs().max() or np.ptp(of_scene["total_j"]))
        gain, verdict = np.nan, UNKNOWN
        if whole(of_scene):
            gain = float(of_scene["gain_j"].max())
            verdict = HOLDS if gain <= ALLOWED * work else FAILS
        ratio = gain / work if work else 0.0 * gain
        row = {"scene": scene, "integrator": integrator, "work_j": work, "gain_j": gain, "gain_of_work": ratio}
        rows.append(row | {"verdict": verdict, "guaranteed": integrator == GUARANTEED})
    return pd.DataFrame(rows)


def warn_of_gain(scene: Scene, energies: pd.DataFrame) -> None:
    """Warn if a step of one of UNPROVEN gained more energy than MUCH of the work; energies : of the scene's motion."""
    if scene.integrator not in UNPROVEN:
        return
    ratio = energy_balance(energies.assign(scene=scene.name), {scene.name: scene.integrator})["gain_of_work"].iloc[0]
    if ratio > MUCH:
        warnings.warn(
            f"{scene.place}: nothing proves that steps of {scene.integrator} make no energy, and one made "
            f"{ratio:.1%} of the work; take shorter ones, or choose backward_euler.",
            stacklevel=2,
        )


def warn_of_doubt(scene: Scene, moved: Motion) -> None:
    """Warn if the estimated error of a motion in modes exceeds DOUBTED of its peak."""
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
    """Return whether the energies of one scene include that of an elastic effect."""
    return any(f"{name}_j" in rows for name in ELASTIC)


ENOUGH_S = 5.0
"""Total time [s] after which runs are not repeated: a long run is a mean over many steps."""

REST = "integrator"
"""Name in the table of what a step takes outside all effects: linear solves and the loop itself."""

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
    """Measure the cost of each effect and of the integrator, one row each, in columns of EFFECTS.

    It is that of the run with the median time among ``repeats`` runs, the ``first`` included, or as many as take
    ENOUGH_S.
    """
    runs = [first]
    while len(runs) < repeats and sum(timed.seconds for timed in runs) < ENOUGH_S:
        runs.append(run(scene, particles))
    runs.sort(key=lambda timed: timed.seconds)
    median = runs[len(runs) // 2]
    seconds = dict(median.effect_seconds)
    seconds[REST] = median.seconds - sum(seconds.values())
    return pd.DataFrame(
        {
            "scene": scene.name,
            "effect": list(seconds),
            "ms_per_step": [1e3 * effect_s / median.steps for effect_s in seconds.values()],
            "share_of_step": [effect_s / median.seconds for effect_s in seconds.values()],
            "memory_kb": [median.effect_kb.get(name, np.nan) for name in seconds],
        }
    )


def left_out(scene: Scene, particles: Particles, whole: Motion, progress: Callable = iter) -> pd.DataFrame:
    """Compute the error of a scene without each of its effects, one row each: scene, effect, error_if_left_out, note.

    The error is the RMS distance over frames and nodes from the ``whole`` motion, over its largest displacement.
    The elastic effect has no error, since without it there is no body. Where the scene cannot be run without an effect,
    the error is NaN and the note gives the reason.
    """
    effects = effect_names(scene, particles)
    rows = [[scene.name, effects[0], np.nan, "it holds the body together"]]
    peak = float(np.linalg.norm(whole.positions - particles.nodes, axis=-1).max())
    for effect in progress(effects[1:]):
        try:
            without = run(scene, particles, without=effect).motion
            distances = np.linalg.norm(without.positions - whole.positions, axis=-1)
            error = float(np.sqrt((distances**2).mean()))
            rows.append([scene.name, effect, error / peak if peak else np.nan, "" if peak else "the scene is still"])
        except (NotConverged, InputError) as failure:
            rows.append([scene.name, effect, np.nan, str(failure)])
    return pd.DataFrame(rows, columns=["scene", "effect", "error_if_left_out", "note"])


def simulate_scene(input: Any, output: Any, scene: Scene, say: Callable) -> dict[str, pd.DataFrame]:
    """Simulate a scene, write its motion and measure its effects, for the rule of this name."""
    particles = load_particles(scene, input.bodies)
    table = decisions(scene, particles)
    for row in table.itertuples():
        say(f"{scene.name}: {row.effect} {'yes' if row.called else 'no'}; {row.reason}")
    run(scene.but(duration_s=2 * scene.step_s), particles)  # compiles the code, so that the next run is timed
    timed = run(scene, load_particles(scene, input.bodies), steps(say, f"{scene.name}: step"))
    warn_of_gain(scene, timed.motion.energy)
    warn_of_doubt(scene, timed.motion)
    store(timed.motion, output.motion)
    costs = cost(scene, particles, timed, repeats=3)
    progress = steps(say, f"{scene.name}: without effect")
    errors = left_out(scene, load_particles(scene, input.bodies), stored(Motion, output.motion), progress)
    return {"decisions": table, "cost": costs, "left_out": errors}


def tabulate_scenes(input: Any, integrators: dict[str, str]) -> Any:
    """Put the tables of all scenes together, for the rule of this name."""
    costs, errors = (pd.concat(map(pd.read_csv, paths)) for paths in (input.costs, input.errors))
    energies = {motion.scene: motion.energy for motion in (stored(Motion, path) for path in input.motions)}
    energy = pd.concat(energies, names=["scene", "frame"]).reset_index("scene")
    with_contact = [stored(Motion, path) for path in input.touching]
    return (contact_tables(with_contact) if with_contact else {}) | {
        "scene_effects": pd.concat(map(pd.read_csv, input.decisions)),
        "effects": costs.merge(errors, on=["scene", "effect"], how="left"),
        "energy": energy,
        "energy_balance": energy_balance(energy, integrators),
    }
