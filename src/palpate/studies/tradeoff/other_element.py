"""Check the truth by another element: the limit of linear elements on levels with the same nodes."""

from collections.abc import Callable, Sequence

import numpy as np
import pandas as pd

from palpate.benchmark.accuracy import TruthErrors, patch_nodes, truth_errors
from palpate.benchmark.presses import force_of
from palpate.benchmark.truth import NEXT, Truth, limit, ratio, truth_levels
from palpate.bodies.body import Body
from palpate.bodies.refinement import finer
from palpate.effects.patch_load import patch_at, spread
from palpate.solvers.equilibrium import Equilibrium

COLUMNS = ["sample", *TruthErrors._fields, "ratio", "finest_rmse_of_peak"]


def other_element(
    body: Body, loads: pd.DataFrame, truth: Truth, samples: Sequence[int], progress: Callable = iter
) -> pd.DataFrame:
    """Tabulate how far the limit of linear elements is from ``truth``, a row for each of ``samples`` that is believed.

    The levels are the last three that have the truth's nodes: linear elements on a level have those of quadratic ones
    on the level before. ratio : by how much their last halving reduced the change, as it is; finest_rmse_of_peak : the
    error of the finest linear answer itself. ``progress`` wraps the sequence of all solutions, as ``tqdm`` does.
    """
    last = truth_levels(body)[-1] + 1
    levels = range(last - 2, last + 1)
    whole = finer(body, last + 1 - len(body.levels))
    rows = truth.rows(np.asarray(samples))
    table = loads.set_index("sample", drop=False)
    asked = [table.loc[truth.sample[row]] for row in rows]
    found: list[list[np.ndarray]] = [[] for _ in asked]
    starts: list[np.ndarray | None] = [None] * len(asked)
    solver: Equilibrium | None = None
    for level, i in progress([(level, i) for level in levels for i in range(len(asked))]):
        if i == 0 or solver is None:
            solver = None  # before the next one is made, which is eight times as large
            solver = Equilibrium(whole, level)
        moved = _solve(solver, body, whole, level, asked[i], starts[i])
        starts[i] = whole.prolongations[level] @ moved if level < last else None
        found[i].append(_on_surface(body, whole, level, moved))
    return pd.DataFrame(
        [
            _row(body, load, np.array(u), truth.displacement[row])
            for load, u, row in zip(asked, found, rows, strict=True)
        ],
        columns=COLUMNS,
    )


def _solve(
    solver: Equilibrium, body: Body, whole: Body, level: int, load: pd.Series, start: np.ndarray | None
) -> np.ndarray:
    rest = solver.mesh.nodes
    patch = patch_at(body, int(load["contact"]), float(load["radius_m"]))
    forces = spread(whole.levels[level], patch, force_of(load))
    return solver.solve(forces, NEXT, None if start is None else rest + start).x - rest


def _on_surface(body: Body, whole: Body, level: int, moved: np.ndarray) -> np.ndarray:
    for prolongation in whole.prolongations[level : len(body.levels) - 1]:
        moved = prolongation @ moved
    return moved[body.fine.surface]


def _row(body: Body, load: pd.Series, levels: np.ndarray, truth: np.ndarray) -> dict:
    patch = patch_nodes(body.fine, int(load["contact"]), float(load["radius_m"]))
    row = {"sample": int(load["sample"])} | truth_errors(limit(levels), truth, patch)._asdict()
    return row | {"ratio": ratio(levels), "finest_rmse_of_peak": truth_errors(levels[-1], truth, patch).rmse_of_peak}
