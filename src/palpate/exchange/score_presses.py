"""Score answers to presses: displacements, as of palpate's own models."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from palpate.benchmark.measure import Presses
from palpate.exchange import presses
from palpate.exchange.answers import Setting
from palpate.exchange.folder import Arrays, Questions
from palpate.exchange.judging import Judging, score_judged
from palpate.exchange.score import Scored
from palpate.exchange.suspects import slip


class _Judge(Judging):
    """What judges answers to presses, as ``Judging`` says; InputError where none has a truth."""

    def __init__(self, questions: Questions, truth: Arrays):
        judge, self.rows = presses.judge_of(questions, truth)
        self._kind = Presses({name: questions.info[name] for name in ("scene", "body", "regime")}, judge)
        self._number = {int(row): i for i, row in enumerate(self.rows)}
        self._asked, self._places = questions.arrays["asked"], questions.arrays["loads"]["place_m"]
        self.known, self.labels = truth["displacement_m"], self._kind.labels
        self.columns = self._kind.columns_of_questions(self.labels)

    def sample(self, row: int) -> dict[str, Any]:
        return self._kind.named[self._number[row]]

    def errors(self, row: int, moved: np.ndarray, setting: Setting | None) -> dict[str, float]:
        return self._kind.judge.errors(self._number[row], moved)._asdict()

    def slip(self, moved: np.ndarray, setting: Setting, there: np.ndarray) -> str:
        told = slip(
            moved[there], self.known[there], self._asked["points_m"], self._asked["triangles"], self._places[there]
        )
        return f"displacement_m {told}" if told else ""

    def means(self, found: list[dict[str, Any]]) -> dict[str, Any]:
        return self._kind.means(found)


def score_presses(
    path: Path, questions: Questions, truth: Arrays, own_law: Callable[[str], Arrays | None] | None = None
) -> Scored:
    """Score answers to presses.

    own_law : gives the truth of a law that is not the body's, or None where it has none
    InputError for answers that cannot be used.
    """
    return score_judged(path, questions, truth, own_law, _Judge, {})
