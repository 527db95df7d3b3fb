"""Compute the coarse answer that a method makes a fine one of: stored, stopped early, loose or converged.

Methods are trained on the same kind of coarse answer that queries will receive.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from palpate.benchmark.accuracy import Method
from palpate.benchmark.load import Load, Refused, loads_of
from palpate.benchmark.model import Case, Solver
from palpate.models.enrichment.training_samples import Training, gather
from palpate.models.fem_statics import LinearCoarse, Simulation

LINEAR, LOOSE, CONVERGED = "linear", "loose", "converged"
LOOSE_TOLERANCE = 1e-3
"""Relative residual at which the coarse simulation stops that is called loose."""


def coarse_solver(case: Case, kind: str) -> Simulation | LinearCoarse:
    """Return what computes coarse answers of a ``kind`` of ``kinds.CoarseAnswer``; iterations are from rest."""
    if kind == LINEAR:
        return LinearCoarse(case)
    if kind in (LOOSE, CONVERGED):
        return Simulation(case, 0, LOOSE_TOLERANCE if kind == LOOSE else case.tolerance)
    return Simulation(case, 0, case.tolerance, int(kind.split()[0]))


def seen_with(case: Case, kind: str, coarse: Simulation | LinearCoarse) -> Case:
    """Return the case with coarse answers to its training samples by ``coarse``, as queries will get them.

    Converged ones are those of the database. NotConverged if a sample has none.
    """
    if kind == CONVERGED:
        return case
    db = case.database

    def answer() -> np.ndarray:
        return np.array([coarse.displacement(load) for load in loads_of(db.contact, db.force)])

    answers = case.share(("coarse answers", db, kind), answer, "coarse answers")
    return replace(case, database=replace(case.database, coarse_live=answers))


def training_of(case: Case) -> Training:
    """Return all training samples of ``case``, of the live protocol; InputError where no folds can be made of them."""
    return gather(case.use_training(), "live", case.options)


def enriched(case: Case, kind: str, samples: int | None, fit: Callable[[Training], Method]) -> "Enriched":
    """Return a method that ``fit`` trains on ``samples`` samples, None all, with coarse answers of a ``kind``."""
    coarse = coarse_solver(case, kind)
    return Enriched(fit(training_of(seen_with(case, kind, coarse).first(samples))), coarse)


class Enriched(Solver):
    """``method`` on top of the ``coarse`` answer to one force at a coarse node; both are part of what a query costs."""

    def __init__(self, method: Method, coarse: Simulation | LinearCoarse):
        self._method, self._coarse = method, coarse

    def respond(self, load: Load) -> np.ndarray:
        contact, force = load.single()
        moved = self._coarse.displacement(load)
        if contact >= len(moved):
            raise Refused("presses at nodes of the coarse mesh are answered, which samples press, and not at others")
        return self._method.predict(moved, contact, force)
