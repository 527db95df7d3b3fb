"""Compute what the report says of scenes beside their tables: verdicts on energies, and forces of truths."""

from typing import Any

import numpy as np
import pandas as pd

from palpate.benchmark.advice import QUADRATIC
from palpate.report import declared, tables
from palpate.report.report import Report
from palpate.table_declaration import Table

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
    """Return what the template names beside its tables."""
    report.check([name for name, table in declared.tables("scenes").items() if table.always], "scene", report.scenes)
    forces = report.tables.get("dynamic_force")
    return {
        "scenes": report.scenes,
        "driven": report.driven,
        "true_n": {scene: _true_force(forces, scene) for scene in report.scenes},
    }


def _true_force(forces: pd.DataFrame | None, scene: str) -> float:
    """Return the largest force [N] of the truth of a scene in motion, 0 without one; forces : dynamic_force.csv."""
    if forces is None:
        return 0.0
    limit = tables.where(forces, scene=scene, model=QUADRATIC, setting="limit")
    return float(np.linalg.norm(limit[["force_x_n", "force_y_n", "force_z_n"]], axis=1).max(initial=0.0))
