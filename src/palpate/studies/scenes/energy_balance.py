"""Judge the energy balance of scenes: no step may gain more than the work that is done on the bodies."""

import warnings
from collections.abc import Mapping

import numpy as np
import pandas as pd

from palpate.scenes.effect_registry import ELASTIC
from palpate.scenes.scene import Scene

ALLOWED = 1e-6
"""Share of a scene's work that a step may gain beyond its own: what the solver's tolerance leaves."""
GUARANTEED = ("backward_euler",)
"""Integrators that cannot gain energy where it is convex; of the others only the run is known."""
UNPROVEN, MUCH = ("bdf2", "reduced"), 1e-3
"""Integrators of second order, which may make energy; and the share of the work from which a run warns of it."""
HOLDS, FAILS, UNKNOWN = "holds", "does not hold", "not known"


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
