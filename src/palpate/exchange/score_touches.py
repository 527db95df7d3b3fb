"""Score answers to touches: displacements, and the force that a hand feels, as of palpate's own models."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from palpate.benchmark.touch import Touch, TouchCase, Touched
from palpate.benchmark.touch_measure import SAMPLE_COLUMNS, means, penetration
from palpate.benchmark.touch_truth import touch_errors
from palpate.effects.instrument import Instrument
from palpate.errors import InputError
from palpate.exchange import touches
from palpate.exchange.answers import Setting, read_answers
from palpate.exchange.asked_body import body_of
from palpate.exchange.folder import Arrays, Questions
from palpate.exchange.own_mesh import OwnMesh
from palpate.exchange.score import MESH, NO_ANSWER, OWN_LAW, WHERE, Scored, at_points, mean_errors, own_law_truth
from palpate.exchange.suspects import slip
from palpate.report.words import two_digits


@dataclass(frozen=True, eq=False)
class _Judge:
    """What judges answers to those touches (rows,) whose truth is believed."""

    case: TouchCase
    touches: list[Touch]
    questions: Questions
    truth: Arrays
    rows: np.ndarray

    def errors(self, row: int, moved: np.ndarray, setting: Setting | None) -> dict[str, float]:
        """Return the errors of displacements (p, 3) [m] and, with a ``setting``, of what else it tells."""
        known, patch = self.truth, self.questions.arrays["loads"]["in_dent"][row]
        true = Touched(known["displacement_m"][row], known["force_n"][row, 1], known["area_m2"][row])
        if setting is None:
            return touch_errors(Touched(moved, np.nan), true, patch)._asdict()
        force, before, area = (setting.numbers[name][row] for name in touches.NUMBERS)
        slope = (force - before) / (true.force_n - known["force_n"][row, 0]) - 1.0
        answer = Touched(moved, float(force), float(area))
        found = touch_errors(answer, true, patch, float(slope))._asdict()
        return found | {"penetration_of_depth": penetration(self.case, self.touches[row], answer)}


def _judge(questions: Questions, truth: Arrays) -> _Judge:
    own = np.stack([truth[f"own_{name}"] for name in touches.OWN], axis=1)
    rows = np.flatnonzero(np.isfinite(own).all(axis=1))
    if not len(rows):
        raise InputError(f"{questions.info['scene']}: no touch has a truth that is believed; ask anew, less deep.")
    body = body_of(questions)
    case = TouchCase(body, Instrument(**questions.info["instrument"]), 0.0, 0)
    return _Judge(case, touches.touches_in(questions, body), questions, truth, rows)


def score_touches(
    path: Path, questions: Questions, truth: Arrays, own_law: Callable[[str], Arrays | None] | None = None
) -> Scored:
    """Score answers to touches; arguments and errors as of ``score_presses``."""
    answers = read_answers(path, questions, touches.NUMBERS)
    judge, warned = _judge(questions, truth), list(answers.warnings)
    asked, info, rows = questions.arrays["asked"], questions.info, judge.rows
    if lost := questions.count - len(rows):
        warned.append(f"{lost} of {questions.count} questions have no truth that is believed; they are left out.")
    elsewhere = own_law_truth(answers, questions, own_law, warned)
    other = None if elsewhere is None else _judge(questions, elsewhere)
    samples: list[dict[str, Any]] = []
    settings: list[dict[str, Any]] = []
    for i, setting in enumerate(answers.settings):
        moved, mesh = at_points(setting, questions)
        there = rows[~setting.failed[rows]]
        places = questions.arrays["loads"]["tip_m"][there]
        told = slip(moved[there], truth["displacement_m"][there], asked["points_m"], asked["triangles"], places)
        if told:
            raise InputError(f"{path}: setting_{i}/displacement_m {told}.")
        if told := _force_slip(setting.numbers["force_n"][there], truth["force_n"][there, 1]):
            raise InputError(f"{path}: setting_{i}/force_n {told}.")
        labels = {"scene": info["scene"], "body": info["body"], "instrument": info["instrument"]["kind"]}
        labels |= {"radius_m": info["instrument"]["radius_m"], "model": answers.engine, "setting": setting.name}
        found = [_row(judge, row, moved[row], setting) for row in rows]
        samples += [labels | row for row in found]
        where = dict(zip(WHERE, (answers.engine, answers.version, answers.hardware, setting.converged), strict=True))
        more = {"law": answers.law, "offline_s": setting.preparation_s, "memory_mb": setting.memory_mb}
        costs = dict(zip(MESH, _mesh_costs(judge, mesh), strict=True))
        costs |= dict(zip(OWN_LAW, _own_law_errors(other, moved, setting), strict=True))
        settings.append(labels | more | means(found) | where | costs)
    return Scored(answers, pd.DataFrame(samples, columns=SAMPLE_COLUMNS), pd.DataFrame(settings), tuple(warned))


def _row(judge: _Judge, row: int, moved: np.ndarray, setting: Setting) -> dict[str, Any]:
    loads = judge.questions.arrays["loads"]
    found: dict[str, Any] = {"sample": int(loads["sample"][row]), "node": int(loads["node"][row]), "failure": ""}
    if setting.failed[row]:
        return found | {"failure": NO_ANSWER}
    seconds = setting.seconds[row]
    calls = seconds[np.isfinite(seconds)].tolist()
    times = {"seconds": float(np.median(calls)), "all_seconds": calls, "reaction_error": np.nan}
    return found | judge.errors(row, moved, setting) | times


def _force_slip(forces: np.ndarray, truth: np.ndarray) -> str:
    """Tell forces of the other sign or another unit: all of them, which no stiffness does."""
    if not len(forces):
        return ""
    if (forces < 0.0).all():
        return "is below 0 in every touch; give the force on the body along direction, positive as it pushes"
    ratio = forces / truth
    if (ratio > 300.0).all() and (ratio < 30000.0).all():
        return f"is {two_digits(float(np.median(ratio)))} times the truth, as if in mN; give N"
    return ""


def _mesh_costs(judge: _Judge, mesh: OwnMesh | None) -> tuple[float, float]:
    if mesh is None:
        return np.nan, np.nan
    moved = judge.truth["displacement_m"]
    return mean_errors([judge.errors(row, mesh.through(moved[row]), None) for row in judge.rows])


def _own_law_errors(other: _Judge | None, moved: np.ndarray, setting: Setting) -> tuple[float, float]:
    if other is None:
        return np.nan, np.nan
    return mean_errors([other.errors(row, moved[row], None) for row in other.rows if not setting.failed[row]])
