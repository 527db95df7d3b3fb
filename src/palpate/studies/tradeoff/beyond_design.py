"""Press harder than models were made for, aslant and outward: is an answer right, doubted by its model, or wrong?"""

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from palpate.benchmark.accuracy import patch_nodes, truth_errors
from palpate.benchmark.judge import Judge
from palpate.benchmark.load import Answer, Load
from palpate.benchmark.measure import LABELS, labels_of, prepared_settings
from palpate.benchmark.model import Case, Model, Solver, answered
from palpate.bodies.refinement import quadratic_prolongation
from palpate.errors import NotConverged
from palpate.models.contact_modes.workshop import Workshop

TIMES = {"as designed": 1.0, "1.5 times": 1.5, "2 times": 2.0, "3 times": 3.0}
TANGENTIAL, PULLING = "tangential", "pulling"
RIGHT, RIGHT_AT_PATCH = 0.01, 0.05
"""What an answer that is right is wrong by at most, as a share of the peak: RMSE, and at the worst node of the disc."""
STEPS, LEFT = 60, 1e-3
"""Most steps of L-BFGS on the finest level, 15 are usual, and the residual over the load that ends them."""
COLUMNS = [
    *LABELS,
    "kind",
    "samples",
    "unsound",
    "right",
    "doubted",
    "needless",
    "wrong",
    "rmse_most",
    "patch_max_most",
]


class Pressed(NamedTuple):
    """One press, the nodes that are pressed (n_surface,), and the fine operator's answer (n_surface, 3) [m] or None."""

    kind: str
    load: Load
    patch: np.ndarray
    truth: np.ndarray | None

    def right(self, answer: Answer) -> tuple[bool, float, float]:
        """Return whether an answer is right, its RMSE, and its error at the worst node of the disc, over the peak."""
        if self.truth is None:
            return False, np.nan, np.nan
        error = truth_errors(answer.displacement, self.truth, self.patch)
        found = error.rmse_of_peak, error.patch_max_of_peak
        return found[0] <= RIGHT and found[1] <= RIGHT_AT_PATCH, *found


def presses_beyond(case: Case, judge: Judge, count: int, progress: Callable = iter) -> list[Pressed]:
    """Press ``count`` contacts of test samples by the hardest force there, times TIMES, across it, and outward.

    A press is unsound, and has no truth, where quadratic elements on the finest level find no answer in STEPS or an
    element of it is inverted.
    """
    body, samples = case.body, judge.samples
    tests = np.flatnonzero(judge.side == "test")
    size = np.linalg.norm(samples.force, axis=1)
    contacts = [tests[samples.contact[tests] == node] for node in np.unique(samples.contact[tests])]
    hardest = [each[np.argmax(size[each])] for each in contacts]
    chosen = np.unique(np.linspace(0, len(hardest) - 1, count).round().astype(int))
    operator, found = _Operator(case), []
    for i in progress([hardest[k] for k in chosen]):
        node = int(samples.contact[i])
        patch = patch_nodes(body.fine, node, case.radius_m)
        for kind, force in _forces(samples.force[i], body.coarse.normals[node]):
            found.append(Pressed(kind, Load.at(node, force), patch, operator.answer(node, force)))
    return found


def measure_beyond(case: Case, name: str, model: Model, pattern: str, asked: Sequence[Pressed]) -> pd.DataFrame:
    """Ask those settings of ``model`` whose text ``pattern`` is found in: a row each kind of press, COLUMNS.

    Of the ``samples`` presses ``right`` are answered so, ``doubted`` are not answered, ``needless`` of them would have
    been right, and ``wrong`` are answered wrongly without a word; ``unsound`` ones have no answer that would be right.
    """
    rows = []
    for one in prepared_settings(case, model, pattern):
        if isinstance(one.solver, NotConverged):
            raise one.solver
        told = labels_of(case, name, one.text)
        for kind in dict.fromkeys(press.kind for press in asked):
            judged = [_judged(one.solver, press) for press in asked if press.kind == kind]
            counts = {what: sum(verdict == what for verdict, *_ in judged) for what in ("right", "needless", "wrong")}
            doubted = sum(verdict in ("doubted", "needless") for verdict, *_ in judged)
            unsound = sum(press.truth is None for press in asked if press.kind == kind)
            most = [max((e[k] for e in judged if np.isfinite(e[k])), default=np.nan) for k in (1, 2)]
            rows.append(told | {"kind": kind, "samples": len(judged), "unsound": unsound, "doubted": doubted} | counts)
            rows[-1] |= {"rmse_most": most[0], "patch_max_most": most[1]}
    return pd.DataFrame(rows, columns=COLUMNS)


def _judged(solver: Solver, press: Pressed) -> tuple[str, float, float]:
    """Return what an answer is, and its errors if it was given."""
    try:
        solver.precede(press.load)
        answer, doubt = answered(solver, press.load, len(press.patch))
    except NotConverged:
        return "doubted", np.nan, np.nan
    right, rmse, patch = press.right(answer)
    if doubt:
        return "needless" if right else "doubted", np.nan, np.nan
    return "right" if right else "wrong", rmse, patch


def _forces(force: np.ndarray, normal: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    """Yield a kind and a force (3,) [N] each, of the size of ``force``; across is a fixed way along the surface."""
    for kind, times in TIMES.items():
        yield kind, times * force
    across = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    size = np.linalg.norm(force)
    yield TANGENTIAL, size * across / np.linalg.norm(across)
    yield PULLING, size * normal


class _Operator:
    """Quadratic elements on the finest level, from the answer of the level before; no search beyond STEPS."""

    def __init__(self, case: Case):
        self._shop = Workshop(case.body, case.radius_m, 0)
        self._body, self._last = case.body, len(case.body.levels) - 1
        self._up = quadratic_prolongation(*case.body.levels[-2:])

    def answer(self, node: int, force: np.ndarray) -> np.ndarray | None:
        """Return the displacement (n_surface, 3) [m] under ``force`` (3,) [N], or None where there is no sound one."""
        before, last = self._shop.elements(self._last - 1), self._shop.elements(self._last)
        load = before.nodal(*self._shop.disc(node, self._last - 1), force)
        start = before.settle(load, np.zeros_like(before.rest), STEPS, LEFT)
        load = last.nodal(*self._shop.disc(node, self._last), force)
        moved = last.settle(load, self._up @ start, STEPS, LEFT)
        left = np.linalg.norm(last.force(moved) + load)
        if not (left <= LEFT * np.linalg.norm(load) and last.least_det(moved) > 0.0):
            return None
        return moved[self._body.fine.surface]
