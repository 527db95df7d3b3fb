"""Judge answers: the truth of samples, the errors of an answer against it, and which samples are asked in a split."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Protocol

import numpy as np
import pandas as pd

from palpate.benchmark.database import Database, fold_sides, read, read_folds, training_presses
from palpate.benchmark.model import Case
from palpate.benchmark.ranking import SIDES, TRAINING
from palpate.benchmark.settings import FitOptions
from palpate.bodies.body import Body
from palpate.bodies.body_file import load
from palpate.bodies.mesh import Mesh
from palpate.errors import InputError
from palpate.solvers.compliance import Compliance
from palpate.stores import stored


class Errors(NamedTuple):
    """Error of one prediction over the fine surface nodes; "of peak" is relative to the reference's peak.

    rmse_m : root of the mean over nodes of the squared length of the error vector [m]
    p95_of_peak, max_of_peak : 95th percentile and largest over nodes of the length of the error vector
    """

    rmse_m: float
    rmse_of_peak: float
    p95_of_peak: float
    max_of_peak: float


class TruthErrors(NamedTuple):
    """Error of one prediction against the truth, over the fine surface nodes; "of peak" is relative to its peak.

    rmse_m, rmse_of_peak, p95_of_peak, max_of_peak : as in ``Errors``
    relative_l2 : RMS error over RMS displacement, on the same nodes
    patch_rms_of_peak, patch_max_of_peak : RMS and largest length of the error vector over the nodes that are pressed
    """

    rmse_m: float
    rmse_of_peak: float
    relative_l2: float
    p95_of_peak: float
    max_of_peak: float
    patch_rms_of_peak: float
    patch_max_of_peak: float


def peak_of(displacement: np.ndarray) -> float:
    """Return the length of the longest of the vectors ``displacement`` (..., 3) [m]."""
    return float(np.linalg.norm(displacement, axis=-1).max())


def errors(predicted: np.ndarray, reference: np.ndarray) -> Errors:
    """Measure a predicted displacement (n, 3) [m] against the simulated one, (n, 3) [m].

    Raises InputError if the reference moves nowhere: there is no peak to compare with.
    """
    peak = np.linalg.norm(reference, axis=1).max()
    if peak == 0:
        raise InputError("accuracy: the reference moves nowhere; leave samples without a force out.")
    error = np.linalg.norm(predicted - reference, axis=1)
    rmse = np.sqrt(np.mean(error**2))
    return Errors(float(rmse), float(rmse / peak), float(np.percentile(error, 95) / peak), float(error.max() / peak))


def truth_errors(predicted: np.ndarray, truth: np.ndarray, patch: np.ndarray) -> TruthErrors:
    """Measure a predicted displacement (n, 3) [m] of the fine surface against the true one, (n, 3) [m].

    patch : (n,) bool, the nodes that are pressed, as ``patch_nodes`` gives them
    Raises InputError if the truth moves nowhere.
    """
    of_surface, error = errors(predicted, truth), np.linalg.norm(predicted - truth, axis=1)
    peak = np.linalg.norm(truth, axis=1).max()
    return TruthErrors(
        **of_surface._asdict(),
        relative_l2=float(np.linalg.norm(error) / np.linalg.norm(truth)),
        patch_rms_of_peak=float(np.sqrt(np.mean(error[patch] ** 2)) / peak),
        patch_max_of_peak=float(error[patch].max() / peak),
    )


def patch_nodes(mesh: Mesh, contact: int, radius_m: float) -> np.ndarray:
    """Mark the surface nodes of ``mesh`` in the disc of ``radius_m`` [m] around node ``contact``: (n_surface,) bool.

    Those that face away, as on the other side of a thin lobe, are not in it. The contact itself always is.
    """
    surface = mesh.surface
    in_reach = np.linalg.norm(mesh.nodes[surface] - mesh.nodes[contact], axis=1) <= radius_m
    return (in_reach & (mesh.normals[surface] @ mesh.normals[contact] > 0.0)) | (surface == contact)


class Method(Protocol):
    """A fitted method; ``sigma_m`` is its kernel width [m], NaN if it has none."""

    sigma_m: float = np.nan

    def predict(self, coarse: np.ndarray, contact: int, force: np.ndarray) -> np.ndarray:
        """Return the fine surface displacement (n, 3) [m] from that of all coarse nodes (N, 3) [m], force (3,) [N]."""


OWN = TruthErrors._fields
"""The names of the errors that a truth has itself."""


def truth_levels(body: Body) -> range:
    """Return the levels of ``body`` on which its truth is found: three or four, up to one beyond its finest.

    Only levels of the shape of the finest are taken: where a level was moved to the dense surface of a file or a CT,
    those before it have another shape. With a smooth surface by a formula all levels are taken: their facets converge
    to it with the order of 2, which the limit includes.
    """
    finest = len(body.levels) - 1
    coarsest = max(0 if body.smooth is not None else body.shape_level, finest - 2)
    return range(coarsest, max(finest + 1, coarsest + 2) + 1)


@dataclass(frozen=True, eq=False)
class Truth:
    """The truth of k samples on the n fine surface nodes of a body.

    sample : (k,) sample numbers
    displacement : (k, n, 3) [m], the limit, or the finest level where there is none; NaN where a level had no answer
    levels : (k, n_levels, n, 3) [m], the answer of each level, coarse first; NaN where a sample was not solved on it
    ratio : (k,) of the last two changes between levels
    least_det : (k,) the least determinant of the deformation gradient at any point of integration of any level
    volume_change : (k,) of the body on the finest level of each sample, over its volume at rest
    iterations, products : (k,) iterations of L-BFGS and Newton's method, and multigrid cycles, of all levels together
    own : (k, len(OWN)) the error that the limit may have itself, as ``TruthErrors``
    rejected : (k,) why a sample's limit is not believed, or ""
    seconds : (k,) time of its solutions [s]
    radius_m : of the disc that is pressed [m]
    level, elements, nodes : number and size of the finest level
    """

    sample: np.ndarray
    displacement: np.ndarray
    levels: np.ndarray
    ratio: np.ndarray
    least_det: np.ndarray
    volume_change: np.ndarray
    iterations: np.ndarray
    products: np.ndarray
    own: np.ndarray
    rejected: np.ndarray
    seconds: np.ndarray
    radius_m: float
    level: int
    elements: int
    nodes: int

    @property
    def believed(self) -> np.ndarray:
        """Truth values (k,): which samples' limits are believed."""
        return self.rejected == ""

    def spread(self, count: int) -> np.ndarray:
        """Return the numbers of ``count`` samples whose limit is believed, evenly over their order, or of all these."""
        believed = self.sample[self.believed]
        return believed[np.linspace(0, len(believed) - 1, min(count, len(believed))).round().astype(int)]

    def rows(self, numbers: np.ndarray) -> np.ndarray:
        """Return the rows of the samples ``numbers`` whose limit is believed; InputError for a sample that is not here.

        If none is believed, return the rows with an answer on the finest level, by which distances can be measured.
        """
        if missing := sorted(set(numbers) - set(self.sample)):
            raise InputError(f"truth.h5: sample {missing[0]} has no truth; delete the file and type make.")
        rows = np.array([int(np.flatnonzero(self.sample == number)[0]) for number in numbers], dtype=int)
        believed = rows[self.believed[rows]]
        return believed if len(believed) else rows[np.isfinite(self.displacement[rows]).all(axis=(1, 2))]


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

        Both are shares of the largest displacement by the coarser elements, as an estimate cannot use the true one; NaN
        without such an answer.
        """
        if self.coarser is None:
            return np.nan, np.nan
        distance = truth_errors(answer, self.coarser[i], self.patch[i])
        return distance.rmse_of_peak, distance.patch_rms_of_peak


def judge(body: Body, db: Database, table: pd.DataFrame, truth: Truth, split: int, radius_m: float) -> Judge:
    """Collect the validation and test samples of ``split`` whose truth is believed, as ``Truth.rows`` says.

    The presses of the others are kept as ``rejected``.
    db : of all samples; table : as ``split.read_folds`` returns it; radius_m : of the patch [m]
    Raises InputError if a side has no sample left.
    """
    side: list[str] = []
    rows: list[int] = []
    rejected: list[int] = []
    for name, numbers in zip(SIDES, fold_sides(table, split)[1:], strict=True):
        believed = truth.rows(numbers)
        if not len(believed):
            raise InputError(
                f"{body.name}: no {name} sample of split {split} has an answer on all levels; press less "
                "(regimes.*.peak_of_size), or refine the body."
            )
        rows += list(believed)
        side += [name] * len(believed)
        rejected += list(np.setdiff1d(numbers, truth.sample[believed]))
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
    """Collect ``rows`` of the truth, each of a ``side``, with samples, pressed nodes and coarser answers."""
    numbers = truth.sample[rows]
    patch = np.array([patch_nodes(body.fine, int(contact), radius_m) for contact in db.contact[numbers]])
    own_errors = np.where(truth.believed[rows, None], truth.own[rows], np.nan)
    coarser_index = truth_levels(body).index(level) if (level := len(body.levels) - 2) in truth_levels(body) else None
    coarser = None if coarser_index is None else truth.levels[rows, coarser_index]
    of_truth = truth.displacement[rows], own_errors, truth.seconds[rows]
    return Judge(split, numbers, side, db.take(numbers), *of_truth, patch, coarser=coarser)


def read_judged(
    files: Mapping[str, Any], regime: str, split: int, *rest: Any, more: bool = False
) -> tuple[Case, Judge]:
    """Read a case with the training samples of ``split``, and the judge of the others; as ``read_case``.

    files : truth, too; rest : radius_m, options, tolerance
    more : whether presses at training contacts are judged too
    """
    case, db, table = _read(files, regime, split, *rest)
    of_judge = case.body, db, table, stored(Truth, files["truth"]), split, case.radius_m
    return case, replace(judge(*of_judge), training=judge_at_training(*of_judge) if more else None)


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
