"""Score answers to touches: displacements, and the force that a hand feels, as of palpate's own models."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from palpate.benchmark.touch import TouchCase, Touched
from palpate.benchmark.touch_measure import Touches, penetration
from palpate.benchmark.touch_truth import touch_errors
from palpate.effects.instrument import Instrument
from palpate.errors import InputError
from palpate.exchange import touches
from palpate.exchange.answers import Setting
from palpate.exchange.asked_body import body_of
from palpate.exchange.folder import Arrays, Questions
from palpate.exchange.judging import Judging, score_judged
from palpate.exchange.score import Scored
from palpate.exchange.suspects import slip
from palpate.report.words import two_digits


class _Judge(Judging):
    """What judges answers to touches, as ``Judging`` says; InputError where no truth is believed."""

    def __init__(self, questions: Questions, truth: Arrays):
        own = np.stack([truth[f"own_{name}"] for name in touches.OWN], axis=1)
        self.rows = np.flatnonzero(np.isfinite(own).all(axis=1))
        if not len(self.rows):
            raise InputError(f"{questions.info['scene']}: no touch has a truth that is believed; ask anew, less deep.")
        self._asked, self._loads, self._truth = questions.arrays["asked"], questions.arrays["loads"], truth
        self.known, body, tool = truth["displacement_m"], body_of(questions), questions.info["instrument"]
        self._case = TouchCase(body, Instrument(**tool), 0.0, 0)
        self._touches = touches.touches_in(questions, body)
        names = {"scene": questions.info["scene"], "body": questions.info["body"]}
        self.labels = names | {"instrument": tool["kind"], "radius_m": tool["radius_m"]}
        self.columns = Touches.columns_of_questions(self.labels)

    def sample(self, row: int) -> dict[str, Any]:
        return {"sample": int(self._loads["sample"][row]), "node": int(self._loads["node"][row])}

    def errors(self, row: int, moved: np.ndarray, setting: Setting | None) -> dict[str, float]:
        truth, patch = self._truth, self._loads["in_dent"][row]
        true = Touched(self.known[row], truth["force_n"][row, 1], truth["area_m2"][row])
        if setting is None:
            return touch_errors(Touched(moved, np.nan), true, patch)._asdict()
        force, before, area = (setting.numbers[name][row] for name in touches.NUMBERS)
        slope = (force - before) / (true.force_n - truth["force_n"][row, 0]) - 1.0
        answer = Touched(moved, float(force), float(area))
        found = touch_errors(answer, true, patch, float(slope))._asdict()
        deep = penetration(self._case, self._touches[row], answer)
        return found | {"penetration_of_depth": deep, "reaction_error": np.nan}

    def slip(self, moved: np.ndarray, setting: Setting, there: np.ndarray) -> str:
        places = self._loads["tip_m"][there]
        told = slip(moved[there], self.known[there], self._asked["points_m"], self._asked["triangles"], places)
        if told:
            return f"displacement_m {told}"
        told = _force_slip(setting.numbers["force_n"][there], self._truth["force_n"][there, 1])
        return f"force_n {told}" if told else ""

    def means(self, found: list[dict[str, Any]]) -> dict[str, Any]:
        return Touches.means(found)


def score_touches(
    path: Path, questions: Questions, truth: Arrays, own_law: Callable[[str], Arrays | None] | None = None
) -> Scored:
    """Score answers to touches; arguments and errors as of ``score_presses``."""
    return score_judged(path, questions, truth, own_law, _Judge, touches.NUMBERS)


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
