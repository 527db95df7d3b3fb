"""Report on the scenes: how each moves, which effects act in it and why, and what they cost."""

from typing import Any

import numpy as np
import pandas as pd

from palpate.benchmark.advice import QUADRATIC
from palpate.report import declared, tables
from palpate.report.report import Report
from palpate.report.words import percent, seconds, spaced
from palpate.studies.scenes.measurements import FAILS, HOLDS, UNKNOWN
from palpate.table_declaration import Table

TITLE = "Scenes in motion"

SCENE_EFFECTS = Table(
    "scene_effects",
    "The effects that act in each scene or not, with the reason.",
    """
    scene effect called reason: a scene, an effect, whether it acts, and why
    """,
)

ENERGY = Table(
    "energy",
    "The kinetic energy, the energy of each effect and the work of loads and instruments over time; of motions in "
    "modes doubt_m, too, which grows with their error [m] and is infinite where they know that they are wrong.",
    """
    scene time_s: a scene, and a time [s]
    kinetic_j outer_work_j total_j: kinetic energy, work of loads and instruments, and sum of all energies [J]
    gain_j: the most that a step has gained beyond its work [J]
    """,
)


def numbers(report: Report) -> dict[str, Any]:
    """Return what the template names."""
    report.check([name for name, table in declared.tables("scenes").items() if table.always], "scene", report.scenes)
    found = report.tables
    balance = found["energy_balance"]
    return {
        "scenes": [
            _of_scene(scene, found["effects"], found["scene_effects"], scene in report.driven)
            | {"true_n": _true_force(found.get("dynamic_force"), scene)}
            for scene in report.scenes
        ],
        "verdicts": [
            (verdict, [(spaced(row.scene), row.gain_of_work) for row in rows.itertuples()])
            for verdict in (HOLDS, FAILS, UNKNOWN)
            if len(rows := balance[balance["scene"].isin(report.scenes) & (balance["verdict"] == verdict)])
        ],
    }


def _true_force(forces: pd.DataFrame | None, scene: str) -> float:
    """Return the largest force [N] of the truth of a scene in motion, 0 without one; forces : dynamic_force.csv."""
    if forces is None:
        return 0.0
    limit = tables.where(forces, scene=scene, model=QUADRATIC, setting="limit")
    return float(np.linalg.norm(limit[["force_x_n", "force_y_n", "force_z_n"]], axis=1).max(initial=0.0))


def _of_scene(scene: str, effects: pd.DataFrame, decisions: pd.DataFrame, driven: bool) -> dict[str, Any]:
    """Return the costs of a scene's effects, which of them cost and matter most and least, and why each acts."""
    rows, decided = tables.where(effects, scene=scene), tables.where(decisions, scene=scene)
    errors = rows.loc[np.isfinite(rows["error_if_left_out"])].set_index("effect")["error_if_left_out"]
    acts = decided["called"].map({True: "yes", False: "no"})
    extremes = (errors.idxmax(), errors.idxmin()) if len(errors) else ()
    return {
        "key": scene,
        "name": spaced(scene),
        "driven": driven,
        "step_s": 1e-3 * rows["ms_per_step"].sum(),
        "costliest": spaced(rows.loc[rows["ms_per_step"].idxmax(), "effect"]),
        "share": rows["share_of_step"].max(),
        "missed": [(spaced(str(name)), errors[name]) for name in extremes],
        "costs": _costs(rows),
        "decisions": pd.DataFrame({"effect": decided["effect"].map(spaced), "acts": acts, "reason": decided["reason"]}),
        "idle": [i for i, called in enumerate(decided["called"]) if not called],
    }


def _costs(rows: pd.DataFrame) -> pd.DataFrame:
    """Tabulate what a step pays for, the most expensive first."""
    frame = rows.sort_values("ms_per_step", ascending=False, kind="stable")
    shown = pd.DataFrame(
        {
            "effect": frame["effect"].map(spaced),
            "time a step": [seconds(1e-3 * ms) for ms in frame["ms_per_step"]],
            "share of step": [percent(share) for share in frame["share_of_step"]],
            "memory [kB]": frame["memory_kb"],
            "error if left out": [percent(e) if e == e else None for e in frame["error_if_left_out"]],
        }
    )
    if "note" in frame and frame["note"].notna().any():
        shown["note"] = frame["note"].fillna("")
    return shown
