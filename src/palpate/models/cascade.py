"""Answer with the cheapest model whose bound meets the error that is asked for, and with the next one otherwise.

Each stage is a model that learns nothing from samples, so that the training samples say how wrong it is at contacts
that it has not seen: a factor times an estimate bounds the error of nine answers in ten (``conformal``). The estimate
is the share by which turning the linear response with its own rotations changes it, or the model's own. These errors
are those against the fine quadratic elements of the training samples; a bound of what those lack themselves is added,
found from how far the elements of the level below are from them.
"""

from time import perf_counter
from weakref import WeakKeyDictionary

import numpy as np

from palpate.errors import NotConverged
from palpate.models.cascade_stages import Stage, Turning, mesh_bound, own_estimate, prepared_stage
from palpate.models.load import Answer, Load, displacement_of
from palpate.models.memory import held_mb
from palpate.models.model import Case, Setting

PREPARED, REDUCES, LAW = True, "p2", "the body's"
_kept: WeakKeyDictionary = WeakKeyDictionary()
"""Stages with what their preparation took [s], by training samples: they serve all settings."""


def settings(case: Case) -> list[Setting]:
    """List the errors that are asked for, the largest first."""
    return [{"asked": error} for error in sorted(case.grid["cascade"]["asked_errors"], reverse=True)]


def prepare(case: Case, setting: Setting) -> "Cascade":
    """Prepare every stage, and find its factor on the training samples."""
    known, entries = _kept.setdefault(case.database, {}), case.grid["cascade"]["stages"]
    if (key := str(entries)) not in known:
        begin = perf_counter()
        turning = Turning(case)
        stages = [prepared_stage(case, turning, entry) for entry in entries]
        mesh = mesh_bound(case)
        known[key] = turning, mesh, stages, dict(case.used) | {"stages": perf_counter() - begin}
    else:  # spent before, for another setting
        turning, mesh, stages, used = known[key]
        for what, seconds in used.items():
            case.charge(what, seconds)
    return Cascade(turning, mesh, stages, setting["asked"])


class Cascade:
    """Try one stage after another; the last one answers whatever its bound is, and says it."""

    def __init__(self, turning: Turning, mesh: float, stages: list[Stage], asked: float):
        """Take the estimate, the bound of what fine elements lack, the stages, and the error that is asked for."""
        self._turning, self._mesh, self._stages, self._asked = turning, mesh, stages, asked

    @property
    def memory_mb(self) -> float:
        """The memory that is held between queries [MB]."""
        return held_mb(self)

    def respond(self, load: Load) -> Answer:
        """Return the displacement (n_surface, 3) [m] with the bound of its error; errors as the last stage's."""
        turned = self._turning.of(load)
        *cheap, last = self._stages
        for stage in cheap:
            if stage.own or stage.factor * turned + self._mesh <= self._asked:
                try:
                    found = self._bounded(stage, stage.solver.respond(load), turned)
                except NotConverged:
                    continue
                if found.error is not None and found.error <= self._asked:
                    return found
        return self._bounded(last, last.solver.respond(load), turned)

    def _bounded(self, stage: Stage, answer: np.ndarray | Answer, turned: float) -> Answer:
        """Return an answer with the bound of its error, if the training contacts are enough for one."""
        bound = self._mesh + stage.factor * (own_estimate(answer) if stage.own else turned)
        return Answer(displacement_of(answer), error=bound if np.isfinite(bound) else None)
