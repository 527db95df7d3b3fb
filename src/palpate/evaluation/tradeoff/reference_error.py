"""Estimate the reference's own error: what one more refinement changes, and what refining for ever would.

All other errors of the trade-off are against the fine mesh, so they leave this one out. A model that is closer to the
reference than the reference is to the truth cannot be told from it by experiment.
"""

from collections.abc import Callable
from dataclasses import replace
from time import perf_counter

import numpy as np
import pandas as pd

from palpate.bodies.body import Body
from palpate.bodies.refinement import refine
from palpate.effects.patch_load import nodal_load
from palpate.evaluation.accuracy import Errors, errors
from palpate.evaluation.tradeoff.measure_model import Asked, Finding, found_rows, labels_of
from palpate.models.memory import held_mb
from palpate.models.model import Case
from palpate.samples.database import Database
from palpate.solvers.equilibrium import Equilibrium

NEAR = 3.0
"""Fine edge lengths around the contact within which a force on one node has no limit to converge to."""
RATIOS = (2.0, 4.0)
"""How much each refinement may divide the error by: the orders 1 and 2 of linear elements."""
SETTINGS = ("one level finer", "extrapolated")


def reference_error(
    case: Case, test: Database, numbers: np.ndarray, count: int, tolerance: float, progress: Callable = iter
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Tabulate the model "reference", as ``measure_model.measure`` does, on ``count`` of the samples ``test``.

    "one level finer" compares with the body refined once more, under the same force, on all fine surface nodes.
    "extrapolated" compares with Richardson's limit of the last two levels on the nodes farther than NEAR edges from
    the contact: at the contact itself a force on one node presses the deeper the finer the mesh is.
    """
    chosen = np.unique(np.argsort(test.peaks)[np.linspace(0, len(numbers) - 1, count).round().astype(int)])
    finer = refined(case.body)
    last = range(len(finer.levels))[-3:]
    solvers = [Equilibrium(finer, level) for level in last]
    found: dict[str, list[Errors | None]] = {setting: [] for setting in SETTINGS}
    seconds: list[list[float]] = []
    for i in progress(list(chosen)):
        contact, force = int(test.contact[i]), test.force[i]
        loads = [nodal_load(finer, level, contact, force, case.radius_m) for level in last]
        start = perf_counter()
        responses = [s.solve(load, tolerance).x - s.mesh.nodes for s, load in zip(solvers, loads, strict=True)]
        seconds.append([perf_counter() - start])
        middle, fine, truth = _on_surface(case.body, responses)
        edges = np.linalg.norm(np.diff(case.body.fine.nodes[case.body.fine.edges], axis=1), axis=2)
        away = np.linalg.norm(test.nodes_fine_surface - case.body.fine.nodes[contact], axis=1) > NEAR * edges.mean()
        found[SETTINGS[0]].append(errors(fine, truth))
        found[SETTINGS[1]].append(errors(fine[away], limit(middle, fine, truth, away)[away]))
    return _rows(case, found, seconds, numbers[chosen], held_mb(solvers))


def refined(body: Body) -> Body:
    """Refine ``body`` by one more level; every fine flat face stays flat."""
    mesh, prolongation = refine(body.fine)
    held = np.zeros(len(body.fine.nodes))
    held[body.anchors[-1]] = 1.0
    return replace(
        body,
        levels=[*body.levels, mesh],
        prolongations=[*body.prolongations, prolongation],
        anchors=[*body.anchors, np.flatnonzero(prolongation @ held == 1.0)],
    )


def limit(middle: np.ndarray, fine: np.ndarray, finer: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """Extrapolate three levels' displacements (n, 3) [m] to Richardson's limit (n, 3) [m].

    The rate is found on the nodes ``seen``. Trap: it is kept within RATIOS, as three levels may be too few to show one.
    """
    before, last = np.linalg.norm((fine - middle)[seen]), np.linalg.norm((finer - fine)[seen])
    ratio = float(np.clip(before / last if last > 0.0 else np.inf, *RATIOS))
    return finer + (finer - fine) / (ratio - 1.0)


def _on_surface(body: Body, responses: list[np.ndarray]) -> list[np.ndarray]:
    """Take the displacements of the middle, the fine and one more level at the fine surface nodes."""
    middle, fine, finer = responses
    surface = body.fine.surface
    return [(body.prolongations[-1] @ middle)[surface], fine[surface], finer[surface]]


def _rows(
    case: Case, found: dict[str, list[Errors | None]], seconds: list[list[float]], numbers: np.ndarray, memory: float
) -> tuple[pd.DataFrame, pd.DataFrame]:
    findings = []
    for setting, wrong in found.items():
        asked = Asked(wrong, [""] * len(numbers), seconds)
        findings.append(Finding(labels_of(case, "reference", setting), asked, 0.0, memory))
    return found_rows(findings, numbers, case.options.split)
