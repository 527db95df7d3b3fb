"""Answer with the cheapest model whose bound meets the error that is asked for, and with the next one otherwise.

Each stage is a model that learns nothing from samples, so that the training samples say how wrong it is at contacts
that it has not seen: a factor times an estimate bounds the error of nine answers in ten (``conformal``). The estimate
is the share by which turning the linear response with its own rotations changes it, or the model's own. These errors
are those against the limit of nested levels, extrapolated from the fine answers of the training samples; a bound of
what is not known of that limit is added.
"""

from time import perf_counter
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from palpate.benchmark.load import Answer, Load, displacement_of
from palpate.benchmark.model import Case, Setting
from palpate.errors import NotConverged
from palpate.models.cascade_stages import Stage, Turning, own_estimate, prepared_stage
from palpate.models.memory import held_mb
from palpate.models.training_limits import Limits

PREPARED, REDUCES, LAW = True, "p2", "the body's"
_kept: WeakKeyDictionary = WeakKeyDictionary()
"""What was prepared, by training samples: it serves all settings."""


class Prepared(NamedTuple):
    """All that settings share.

    turning : the estimate; unknown : the bound of what is not known of the limit; stages : cheapest first
    case : that they were prepared with, in which what they use is charged
    """

    turning: Turning
    unknown: float
    stages: list[Stage]
    case: Case


def settings(case: Case) -> list[Setting]:
    """List the errors that are asked for, the largest first."""
    return [{"asked": error} for error in sorted(case.grid["cascade"]["asked_errors"], reverse=True)]


def prepare(case: Case, setting: Setting) -> "Cascade":
    """Prepare every stage, and find its factor on the training samples."""
    known, entries = _kept.setdefault(case.database, {}), case.grid["cascade"]["stages"]
    if (key := str(entries)) not in known:
        begin = perf_counter()
        limits = Limits(case)
        turning = Turning(case, limits.beyond)
        stages = [prepared_stage(case, turning, limits, entry) for entry in entries]
        case.charge("stages", perf_counter() - begin)
        known[key] = Prepared(turning, limits.unknown, stages, case)
    return Cascade(case, known[key], setting["asked"])


class Cascade:
    """Try one stage after another; where none is sure enough the surest answers, and says how sure it is."""

    def __init__(self, case: Case, prepared: Prepared, asked: float):
        """Take the case to charge, what was prepared, and the error that is asked for."""
        self._case, self._prepared, self._asked = case, prepared, asked
        self._charge()

    @property
    def memory_mb(self) -> float:
        """The memory that is held between queries [MB]."""
        return held_mb(self._prepared.turning) + sum(stage.solver.memory_mb for stage in self._prepared.stages)

    def precede(self, load: Load) -> None:
        """Do what stages do before a query, such as preparing its contact; not timed, but charged."""
        for stage in self._prepared.stages:
            if before := getattr(stage.solver, "precede", None):
                before(load)
        self._charge()

    def respond(self, load: Load) -> Answer:
        """Return the displacement (n_surface, 3) [m] with the bound of its error; errors as the last that was tried."""
        turned, stages = self._prepared.turning.of(load), self._prepared.stages
        left: list[tuple[float, int, Answer | None]] = []
        for place, stage in enumerate(stages):
            bound, answer = 0.0 if stage.own else self._bound(stage, turned), None
            if bound <= self._asked:
                try:
                    answer = self._answer(stage, load, turned)
                except NotConverged:
                    continue
                bound = np.inf if answer.error is None else answer.error
                if bound <= self._asked:
                    return answer
            left.append((bound, -place, answer))
        return self._surest(sorted(left, key=lambda each: each[:2]), load, turned)

    def _surest(self, left: list[tuple[float, int, Answer | None]], load: Load, turned: float) -> Answer:
        """Return the answer of the least bound, of those given and those that are still to be asked for."""
        failure = NotConverged("no stage of the cascade has an answer", [float("nan")])
        for _, place, answer in left:
            try:
                return answer or self._answer(self._prepared.stages[-place], load, turned)
            except NotConverged as failed:
                failure = failed
        raise failure

    def _answer(self, stage: Stage, load: Load, turned: float) -> Answer:
        """Return a stage's answer with the bound of its error, if the training contacts are enough for one."""
        answer = stage.solver.respond(load)
        bound = self._bound(stage, own_estimate(answer) if stage.own else turned)
        return Answer(displacement_of(answer), error=bound if bound < np.inf else None)

    def _bound(self, stage: Stage, estimate: float) -> float:
        return self._prepared.unknown + stage.factor * estimate

    def _charge(self) -> None:
        """Add what the stages have used so far, in whichever setting's turn."""
        for what, seconds in self._prepared.case.used.items():
            self._case.charge(what, seconds)
