"""Score answers to motions: displacements and forces over time, as of palpate's own models in motion."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from palpate.benchmark.accuracy import TruthErrors, truth_errors
from palpate.benchmark.measuring import Kind
from palpate.benchmark.motion_truth import ForceErrors, force_errors
from palpate.errors import InputError
from palpate.exchange import motions
from palpate.exchange.answers import Setting
from palpate.exchange.folder import Arrays, Questions
from palpate.exchange.judging import Judging, score_judged
from palpate.exchange.score import Scored
from palpate.exchange.suspects import over_time, slip

ERRORS = (*TruthErrors._fields, *ForceErrors._fields)


class _Judge(Judging):
    """What judges answers to motions, as ``Judging`` says; InputError where no truth is believed."""

    def __init__(self, questions: Questions, truth: Arrays):
        own = np.stack([truth[f"own_{name}"] for name in motions.OWN], axis=1)
        self.rows = np.flatnonzero(np.isfinite(own).all(axis=1))
        if not len(self.rows):
            raise InputError(f"{questions.info['scene']}: no motion has a truth that is believed; ask for another.")
        self._asked, self._patch = questions.arrays["asked"], questions.arrays["loads"]["in_dent"]
        self.known, self._force = truth["displacement_m"], truth[motions.FORCE]
        self._duration_s, self._frames = questions.info["duration_s"], questions.frames[0]
        self.labels = {"scene": questions.info["scene"], "body": questions.info["body"]}
        self.columns = _Motions.columns_of_questions(self.labels)

    def sample(self, row: int) -> dict[str, Any]:
        return {"sample": row}

    def errors(self, row: int, moved: np.ndarray, setting: Setting | None) -> dict[str, float]:
        patch = np.tile(self._patch[row], self._frames)
        found = truth_errors(moved.reshape(-1, 3), self.known[row].reshape(-1, 3), patch)._asdict()
        if patch.all():  # nothing is pressed, and there is no dent
            found |= dict.fromkeys(("patch_rms_of_peak", "patch_max_of_peak"), np.nan)
        if setting is None:
            return found
        if motions.FORCE in setting.numbers:
            found |= force_errors(setting.numbers[motions.FORCE][row], self._force[row])._asdict()
        return found | {"real_time_factor": float(np.nanmedian(setting.seconds[row])) / self._duration_s}

    def slip(self, moved: np.ndarray, setting: Setting, there: np.ndarray) -> str:
        for row in there:
            told = slip(moved[row], self.known[row], self._asked["points_m"], self._asked["triangles"], None)
            if told := told or over_time(moved[row], self.known[row], self._duration_s / self._frames):
                return f"displacement_m {told}"
        return ""

    def means(self, found: list[dict[str, Any]]) -> dict[str, Any]:
        return _Motions.means(found)


class _Motions(Kind):
    errors = (*ERRORS, "real_time_factor")
    spread = ("rmse_of_peak",)


def score_motions(
    path: Path, questions: Questions, truth: Arrays, own_law: Callable[[str], Arrays | None] | None = None
) -> Scored:
    """Score answers to motions; arguments and errors as of ``score_presses``."""
    return score_judged(path, questions, truth, own_law, _Judge, motions.wanted(questions))
