"""Score answers row by row, whatever the kind of questions is: what a kind itself knows is behind ``Judging``."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import pandas as pd

from palpate.benchmark.measuring import spent
from palpate.exchange.answers import Setting, Wanted, read_answers
from palpate.exchange.folder import Arrays, Questions
from palpate.exchange.own_mesh import OwnMesh
from palpate.exchange.score import (
    MESH,
    NO_ANSWER,
    OWN_LAW,
    Scored,
    looked_through,
    mean_errors,
    own_law_truth,
    where_of,
)


class Judging(Protocol):
    """What judges answers to those questions (rows,) whose truth is believed.

    known : the true displacements (k, …, p, 3) [m]; labels : of every row; columns : of rows of samples
    """

    rows: np.ndarray
    known: np.ndarray
    labels: Mapping[str, Any]
    columns: Sequence[str]

    def sample(self, row: int) -> dict[str, Any]:
        """Return what names a question in the table of samples."""

    def errors(self, row: int, moved: np.ndarray, setting: Setting | None) -> dict[str, float]:
        """Return the errors of displacements (…, p, 3) [m] and, with a ``setting``, of what else it tells."""

    def slip(self, moved: np.ndarray, setting: Setting, there: np.ndarray) -> str:
        """Return which array of the questions ``there`` (m,) has a slip of the adapter, and which; or ""."""

    def means(self, found: list[dict[str, Any]]) -> dict[str, Any]:
        """Return the row of a setting from its rows of samples."""


def score_judged(
    path: Path,
    questions: Questions,
    truth: Arrays,
    own_law: Callable[[str], Arrays | None] | None,
    judge_of: Callable[[Questions, Arrays], Judging],
    numbers: Mapping[str, Wanted],
) -> Scored:
    """Score answers with what ``judge_of`` returns for a truth; other arguments and errors as of ``score_presses``."""
    answers, warned = read_answers(path, questions, numbers), list[str]()
    judge = judge_of(questions, truth)
    elsewhere = own_law_truth(path, answers, questions, own_law, warned)
    other = None if elsewhere is None else judge_of(questions, elsewhere)
    samples: list[dict[str, Any]] = []
    settings: list[dict[str, Any]] = []
    for setting, moved, mesh in looked_through(path, answers, questions, judge.rows, judge.known, judge.slip, warned):
        labels = dict(judge.labels) | {"model": answers.engine, "setting": setting.name}
        found = [_row(judge, row, moved[row], setting) for row in judge.rows]
        samples += [labels | row for row in found]
        more = {"law": answers.law, "offline_s": setting.preparation_s, "memory_mb": setting.memory_mb}
        costs = dict(zip(MESH, _mesh_costs(judge, mesh), strict=True))
        costs |= dict(zip(OWN_LAW, _own_law_errors(other, moved, setting), strict=True))
        settings.append(labels | more | judge.means(found) | where_of(answers, setting) | costs)
    return Scored(answers, pd.DataFrame(samples, columns=list(judge.columns)), pd.DataFrame(settings), tuple(warned))


def _row(judge: Judging, row: int, moved: np.ndarray, setting: Setting) -> dict[str, Any]:
    found = judge.sample(row) | {"failure": ""}
    if setting.failed[row]:
        return found | {"failure": NO_ANSWER}
    seconds = setting.seconds[row]
    calls = seconds[np.isfinite(seconds)].tolist()
    return found | judge.errors(row, moved, setting) | spent(calls)


def _mesh_costs(judge: Judging, mesh: OwnMesh | None) -> tuple[float, float]:
    if mesh is None:
        return np.nan, np.nan
    return mean_errors([judge.errors(row, mesh.through(judge.known[row]), None) for row in judge.rows])


def _own_law_errors(other: Judging | None, moved: np.ndarray, setting: Setting) -> tuple[float, float]:
    if other is None:
        return np.nan, np.nan
    return mean_errors([other.errors(row, moved[row], None) for row in other.rows if not setting.failed[row]])
