"""Score the answers of engines to questions of any kind; what differs between kinds is in a ``Judge`` of each."""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import ClassVar

import numpy as np
import pandas as pd
from scipy import sparse

from palpate.benchmark.accuracy import truth_errors
from palpate.benchmark.measuring import Kind, Row, spent
from palpate.bodies.material import NAMED
from palpate.bodies.mesh import Sheet
from palpate.effects.patch_load import nearest_on_surface
from palpate.errors import InputError
from palpate.exchange.answers import Answers, Setting, read_answers
from palpate.exchange.asked_body import FURTHER, law_named
from palpate.exchange.folder import Arrays, Questions
from palpate.exchange.suspects import oddities, out_of_order, slip

NO_ANSWER = "the engine gave no answer"
KINDS = {"press": "presses", "touch": "touches", "motion": "motions"}
"""The module of each kind of questions, with its ``Judge`` and the function that finds the truth."""


class OwnMesh:
    """Interpolation between the surface of an engine's own mesh and the asked points.

    nodes, triangles : of the engine's mesh; points, between : the asked points, and the triangles between them
    Attributes: far_m, largest distance of asked points from the mesh; used, its nodes in triangles; triangles of these.
    """

    def __init__(self, nodes: np.ndarray, triangles: np.ndarray, points: np.ndarray, between: np.ndarray):
        self._down, distances = _onto(nodes, triangles, points)
        self.used, corners = np.unique(triangles, return_inverse=True)
        self.triangles, used = corners.reshape(triangles.shape), self.used
        self._up, _ = _onto(points, between, nodes[used])
        to_all = sparse.csr_array((np.ones(len(used)), (used, np.arange(len(used)))), shape=(len(nodes), len(used)))
        self._there_and_back = (self._down @ (to_all @ self._up)).tocsr()
        self.far_m = float(distances.max())

    def at_points(self, displacement: np.ndarray) -> np.ndarray:
        """Return displacements (…, p, 3) [m] at the asked points of those (…, n, 3) [m] of the mesh's nodes."""
        return _each(self._down, displacement)

    def at_nodes(self, displacement: np.ndarray) -> np.ndarray:
        """Return displacements (…, u, 3) [m] at the used nodes of those (…, p, 3) [m] at the asked points."""
        return _each(self._up, displacement)

    def through(self, displacement: np.ndarray) -> np.ndarray:
        """Interpolate displacements (…, p, 3) [m] of the asked points to the mesh's nodes, and back."""
        return _each(self._there_and_back, displacement)


def _each(matrix: sparse.csr_array, displacement: np.ndarray) -> np.ndarray:
    return np.array([matrix @ each for each in displacement.reshape(-1, *displacement.shape[-2:])]).reshape(
        *displacement.shape[:-2], -1, 3
    )


def _onto(nodes: np.ndarray, triangles: np.ndarray, points: np.ndarray) -> tuple[sparse.csr_array, np.ndarray]:
    """Return the interpolation (p, n) to the nearest points of a surface from ``points``, and distances (p,) [m]."""
    corners, weights, away = nearest_on_surface(Sheet(nodes, triangles, 0.0), points)
    rows = np.repeat(np.arange(len(points)), 3)
    return sparse.csr_array((weights.ravel(), (rows, corners.ravel())), shape=(len(points), len(nodes))), away


@dataclass(frozen=True, eq=False)
class Scored:
    """The scores of a file of answers.

    settings : a row for each setting, as ``benchmark.measuring`` has it, with scene, engine and machine, and the errors
        by the engine's own mesh and against the truth of its own law
    warnings : a sentence each
    """

    answers: Answers
    settings: pd.DataFrame
    warnings: tuple[str, ...]


class Judge:
    """Judges answers to the questions whose truth is believed, ``rows`` (q,).

    kind : computes the means of a setting; named : further columns that it needs of each question
    known : the true displacements (k, …, p, 3) [m]
    place : name of the array of where each question acts, "" where questions have no order to mistake
    answer_suffices : whether, if no truth is believed, all questions with a finest answer are judged by that
    InputError where there is nothing to judge by.
    """

    kind: ClassVar[type[Kind]]
    named: ClassVar[Row] = {}
    place: ClassVar[str] = ""
    answer_suffices: ClassVar[bool] = False

    def __init__(self, questions: Questions, truth: Arrays):
        self.loads, self.asked = questions.arrays["loads"], questions.arrays["asked"]
        self.known = truth["displacement_m"]
        judged: np.ndarray = believed(truth)
        if self.answer_suffices and not judged.any():
            judged = np.all(np.isfinite(self.known), axis=(1, 2))
        if not judged.any():
            raise InputError(f"{questions.info['scene']}: no {questions.kind} has a truth that is believed; ask anew.")
        self.rows = np.flatnonzero(judged)

    def errors(self, row: int, moved: np.ndarray) -> Row:
        """Return the errors of displacements (…, p, 3) [m] of question ``row``, over the surface and in the dent."""
        answered, true = moved.reshape(-1, 3), self.known[row].reshape(-1, 3)
        dent = self.loads["in_dent"][row]
        return truth_errors(answered, true, np.tile(dent, len(answered) // len(dent)))._asdict()

    def further_errors(self, row: int, moved: np.ndarray, setting: Setting) -> Row:
        """Return errors of forces, and of what else a setting answers to question ``row``."""
        return {}

    def slip(self, moved: np.ndarray, setting: Setting, there: np.ndarray) -> str:
        """Return a phrase on a slip of the adapter, such as another unit, in questions number ``there`` (m,); or ""."""
        places, asked = self.loads[self.place][there] if self.place else None, self.asked
        mistake = slip(moved[there], self.known[there], asked["points_m"], asked["triangles"], places)
        return f"displacement_m {mistake}" if mistake else ""


def believed(truth: Arrays) -> np.ndarray:
    """Return for each question whether its truth is believed, (k,) bool."""
    own_errors = [truth[name] for name in truth if name.startswith("own_") and name != "own_force_rms_of_peak"]
    return np.all(np.isfinite(own_errors), axis=0)


def own_arrays(names: tuple[str, ...], own: np.ndarray) -> dict[str, np.ndarray]:
    """Return the arrays of truth.npz for a truth's own errors ``own`` (k, names), NaN where it is not believed."""
    return {f"own_{name}": np.ascontiguousarray(column) for name, column in zip(names, own.T, strict=True)}


def module_of(questions: Questions) -> ModuleType:
    """Return the module of a kind of questions; InputError for one that is not known."""
    if questions.kind not in KINDS:
        raise InputError(f"questions of kind {questions.kind} are not known to this palpate; ask anew.")
    return import_module(f"palpate.exchange.{KINDS[questions.kind]}")


def score_answers(
    path: Path, questions: Questions, truth: Arrays, own_law: Callable[[str], Arrays] | None = None
) -> Scored:
    """Score a file of answers to ``questions`` against their ``truth``.

    own_law : returns the truth of another law than the body's by its name; None where that is not asked for
    InputError for answers that cannot be used.
    """
    module = module_of(questions)
    answers, judge = read_answers(path, questions, module.wanted(questions)), module.Judge(questions, truth)
    warned = list(answers.warnings)
    own_truth, remark = _own_law_truth(path, answers.law, questions.info["law"], own_law)
    warned += [remark] if remark else []
    by_law = None if own_truth is None else module.Judge(questions, own_truth)  # judges by the engine's own law
    if lost := questions.count - len(judge.rows):
        warned.append(f"{lost} of {questions.count} questions have no truth that is believed; they are left out.")
    settings: list[Row] = []
    about = {"scene": questions.info["scene"], "model": answers.engine, "law": answers.law}
    about |= {"engine": answers.engine, "version": answers.version, "hardware": answers.hardware}
    for i, setting in enumerate(answers.settings):
        moved, mesh = at_points(setting, questions)
        valid = judge.rows[~setting.failed[judge.rows]]
        if mistake := judge.slip(moved, setting, valid):
            raise InputError(f"{path}: setting_{i}/{mistake}.")
        warned += _odd(f"{path}: setting_{i}/displacement_m", setting, moved[valid], judge.known[valid], mesh, valid)
        rows = [_row(judge, row, moved[row], setting) for row in judge.rows]
        facts = {"setting": setting.name, "converged": setting.converged}
        facts |= {"offline_s": setting.preparation_s, "memory_mb": setting.memory_mb}
        by_mesh = [] if mesh is None else [judge.errors(row, mesh.through(judge.known[row])) for row in judge.rows]
        of_law = [] if by_law is None else [by_law.errors(r, moved[r]) for r in by_law.rows if not setting.failed[r]]
        costs = _means("mesh", by_mesh) | _means("own_law", of_law)
        settings.append(about | facts | judge.kind.means(rows) | costs)
    return Scored(answers, pd.DataFrame(settings), tuple(warned))


def _row(judge: Judge, row: int, moved: np.ndarray, setting: Setting) -> Row:
    """Return the errors and times of one question, or its failure."""
    columns = judge.named | {"failure": ""}
    if setting.failed[row]:
        return columns | {"failure": NO_ANSWER}
    seconds = setting.seconds[row]
    calls = seconds[np.isfinite(seconds)].tolist()
    return columns | judge.errors(row, moved) | judge.further_errors(row, moved, setting) | spent(calls)


def _means(where: str, errors: list[Row]) -> Row:
    """Return the means of errors over the surface and in the dent; NaN where there are none."""
    names = ("rmse_of_peak", "patch_rms_of_peak")
    return {f"{where}_{name}": float(np.mean([each[name] for each in errors])) if errors else np.nan for name in names}


def at_points(setting: Setting, questions: Questions) -> tuple[np.ndarray, OwnMesh | None]:
    """Return a setting's displacements (k, …, p, 3) [m] at the asked points, and the engine's own mesh, or None."""
    if setting.nodes is None or setting.triangles is None:
        return setting.displacement, None
    mesh = OwnMesh(setting.nodes, setting.triangles, questions.points, questions.arrays["asked"]["triangles"])
    return mesh.at_points(setting.displacement), mesh


def _odd(
    place: str, setting: Setting, moved: np.ndarray, known: np.ndarray, mesh: OwnMesh | None, rows: np.ndarray
) -> list[str]:
    """Return a sentence for each oddity of the answers to questions number ``rows`` (m,).

    moved, known : (m, …, p, 3) [m], answers and truth at the asked points
    InputError for nodes of the engine's own ``mesh`` that are in another order.
    """
    true = known.reshape(-1, *known.shape[-2:])
    if mesh is not None and len(true):
        own_moved = setting.displacement[rows][..., mesh.used, :]
        own_moved = own_moved.reshape(-1, *own_moved.shape[-2:])
        if mistake := out_of_order(own_moved, mesh.at_nodes(true), mesh.triangles):
            raise InputError(f"{place} {mistake}.")
    return [f"{place} {each}." for each in oddities(moved.reshape(true.shape), true)]


def _own_law_truth(
    path: Path, law: str, of_body: str, own_law: Callable[[str], Arrays] | None
) -> tuple[Arrays | None, str]:
    """Return the truth of an engine's ``law``, and a warning where errors include the difference of laws.

    The truth is None where the law is that ``of_body``, or where ``own_law``, which finds it, is None.
    InputError for a law that palpate does not have, where its truth is asked for.
    """
    if law == of_body:
        return None, ""
    is_known, laws = bool(law_named(law)), ", ".join((*NAMED, *FURTHER))
    if own_law is not None:
        if not is_known:
            raise InputError(f"{path}: law is {law}, which palpate does not have; name {laws}, or leave --own-law out.")
        return own_law(law), ""
    remedy = "ask for it with --own-law" if is_known else f"palpate has no law of that name, but {laws}"
    return None, f"the law is {law} and that of the body {of_body}: errors have both in them ({remedy})."
