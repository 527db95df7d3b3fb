"""Combine stored linear responses with a residual that is learnt, for models that simulate nothing."""

import numpy as np

from palpate.benchmark.load import Answer, Load
from palpate.benchmark.model import Case, Setting, training_counts
from palpate.models.depths import Discs
from palpate.models.enrichment.load_residual import Base, LoadResidual
from palpate.models.enrichment.training_samples import gather
from palpate.models.memory import held_mb


class Stored:
    """The answer of ``base``, and what was learnt beyond it if ``samples`` are learnt from."""

    def __init__(self, case: Case, base: Base, samples: int):
        self._base, self._residual, self._discs = base, None, Discs(case)
        if samples:
            db = case.first(samples).use_training()
            residual = LoadResidual(case.meshes, case.use_compliance(), base)
            self._residual = residual.learn(gather(db, np.arange(samples), "live", case.options), case.options)

    @property
    def memory_mb(self) -> float:
        """The memory that is held between queries [MB]."""
        return held_mb([self._base, self._residual])

    def respond(self, load: Load) -> np.ndarray | Answer:
        """Return the displacement (n_surface, 3) [m] under ``load``; InputError for a bad contact.

        Without a residual, which samples of one press each have taught, responses to several presses add up, and
        discs may be pushed to a depth.
        """
        if self._residual is not None:
            return self._residual.respond(*load.single())
        given, pushed = load.parted()
        return self._discs.answer(load, self._base.superpose) if pushed else self._base.superpose(given)


def shares(case: Case, family: str) -> list[Setting]:
    """List how many training samples are learnt from."""
    return [{"samples": count} for count in training_counts(case, case.grid[family]["training_shares"])]
