"""Judge answers: the samples that are asked for in a split, their truth, and the errors of an answer to one of them."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd

from palpate.benchmark.accuracy import TruthErrors, patch_nodes, truth_errors
from palpate.benchmark.database import Database, read
from palpate.benchmark.model import Case
from palpate.benchmark.settings import FitOptions
from palpate.benchmark.split import fold_sides, read_folds, training_presses
from palpate.benchmark.truth import Truth, truth_levels
from palpate.bodies.body import Body
from palpate.bodies.body_file import load
from palpate.errors import InputError
from palpate.solvers.compliance import Compliance
from palpate.stores import stored

SIDES = ("validation", "test")
"""The names of the sides: settings are chosen on the first, and their errors reported on the second."""
TRAINING = "training"
"""The name of the side of the samples that models may learn from; those that do not are asked for some of them."""


@dataclass(frozen=True, eq=False)
class Judge:
    """The k samples of one split that a model is asked for, and their truth at the n fine surface nodes.

    split : its number, from 1 on
    numbers : (k,) sample numbers; side : (k,) of SIDES, or TRAINING
    samples : their database, whose ``fine`` has converged answers of the fine operator
    truth : (k, n, 3) [m]; own : (k, ·) errors of the truth itself, as ``TruthErrors``, NaN where no truth is believed
        and the answer of the finest elements stands for it; own_seconds : (k,) time of finding it [s]
    patch : (k, n) bool, the nodes that are pressed
    coarser : (k, n, 3) [m], converged answers of quadratic elements one level coarser than the finest, from which the
        error of any answer can be estimated; or None
    training : presses at training contacts, for bounds of models that learn nothing; or None
    rejected : the presses of the two sides whose truth was rejected, but those among the k; or None
    """

    split: int
    numbers: np.ndarray
    side: np.ndarray
    samples: Database
    truth: np.ndarray
    own: np.ndarray
    own_seconds: np.ndarray
    patch: np.ndarray
    training: "Judge | None" = None
    coarser: np.ndarray | None = None
    rejected: Database | None = None

    @property
    def believed(self) -> np.ndarray:
        """Of each of the samples whether its truth is believed, (k,) bool."""
        return np.isfinite(self.own).all(axis=1)

    def errors(self, i: int, answer: np.ndarray) -> TruthErrors:
        """Measure an answer (n, 3) [m] to the i-th sample against the truth."""
        return truth_errors(answer, self.truth[i], self.patch[i])

    def operator_error(self, i: int, answer: np.ndarray) -> float:
        """Return the RMS distance of an answer from the fine operator's converged one, as a share of the true peak."""
        distance = np.linalg.norm(answer - self.samples.fine[i], axis=1)
        return float(np.sqrt(np.mean(distance**2)) / np.linalg.norm(self.truth[i], axis=1).max())

    def from_coarser(self, i: int, answer: np.ndarray) -> tuple[float, float]:
        """Return the RMS distance of an answer (n, 3) [m] from that of the coarser elements, over surface and patch.

        As shares of the largest displacement of these elements, as who estimates an error does not know the true one;
        NaN without an answer of theirs.
        """
        if self.coarser is None:
            return np.nan, np.nan
        found = truth_errors(answer, self.coarser[i], self.patch[i])
        return found.rmse_of_peak, found.patch_rms_of_peak


def judge(body: Body, db: Database, table: pd.DataFrame, truth: Truth, split: int, radius_m: float) -> Judge:
    """Collect the validation and test samples of ``split`` whose truth is believed, as ``Truth.rows`` says.

    The presses of the others are kept as ``rejected``.
    db : of all samples; table : as ``split.read_folds`` returns it; radius_m : of the patch [m]
    Raises InputError if a side has no sample left.
    """
    side: list[str] = []
    rows: list[int] = []
    rejected: list[int] = []
    for name, asked in zip(SIDES, fold_sides(table, split)[1:], strict=True):
        found = truth.rows(asked)
        if not len(found):
            raise InputError(
                f"{body.name}: no {name} sample of split {split} has an answer on all levels; press less "
                "(regimes.*.peak_of_size), or refine the body."
            )
        rows += list(found)
        side += [name] * len(found)
        rejected += list(np.setdiff1d(asked, truth.sample[found]))
    judged = _judge(body, db, truth, split, radius_m, np.array(rows), np.array(side))
    return replace(judged, rejected=db.take(np.array(rejected)) if rejected else None)


def judge_at_training(
    body: Body, db: Database, table: pd.DataFrame, truth: Truth, split: int, radius_m: float
) -> Judge | None:
    """Collect a press of each training contact of ``split`` whose truth is believed; None where there is none."""
    rows = truth.rows(training_presses(table, split))
    return _judge(body, db, truth, split, radius_m, rows, np.full(len(rows), TRAINING)) if len(rows) else None


def _judge(
    body: Body, db: Database, truth: Truth, split: int, radius_m: float, rows: np.ndarray, side: np.ndarray
) -> Judge:
    numbers = truth.sample[rows]
    patch = np.array([patch_nodes(body.fine, int(contact), radius_m) for contact in db.contact[numbers]])
    own = np.where(truth.believed[rows, None], truth.own[rows], np.nan)
    place = truth_levels(body).index(level) if (level := len(body.levels) - 2) in truth_levels(body) else None
    coarser = None if place is None else truth.levels[rows, place]
    known = truth.displacement[rows], own, truth.seconds[rows]
    return Judge(split, numbers, side, db.take(numbers), *known, patch, coarser=coarser)


def read_judged(
    files: Mapping[str, Any], regime: str, split: int, *rest: Any, more: bool = False
) -> tuple[Case, Judge]:
    """Read a case with the training samples of ``split``, and the judge of the others; as ``read_case``.

    files : truth, too; rest : radius_m, options, tolerance
    more : whether presses at training contacts are judged too
    """
    case, db, table = _read(files, regime, split, *rest)
    judged = case.body, db, table, stored(Truth, files["truth"]), split, case.radius_m
    return case, replace(judge(*judged), training=judge_at_training(*judged) if more else None)


def read_case(files: Mapping[str, Any], regime: str, split: int, *rest: Any) -> Case:
    """Read a case with the training samples of ``split``.

    files : body, database, samples (folds), and perhaps compliance; rest : radius_m, options, tolerance of a Case
    """
    return _read(files, regime, split, *rest)[0]


def _read(
    files: Mapping[str, Any], regime: str, split: int, radius_m: float, options: FitOptions, tolerance: float
) -> tuple[Case, Database, pd.DataFrame]:
    body, db, table = load(files["body"]), read(files["database"]), read_folds(files["samples"])
    linear = stored(Compliance, files["compliance"]) if files.get("compliance") else None
    training = db.take(fold_sides(table, split)[0])
    return Case(body, regime, radius_m, training, linear, options, tolerance), db, table
