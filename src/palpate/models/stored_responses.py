"""Combine stored linear responses with a residual that is learnt, for models that simulate nothing."""

import numpy as np

from palpate.enrichment.load_residual import Base, LoadResidual
from palpate.enrichment.training_samples import gather
from palpate.models.memory import held_mb
from palpate.models.model import Case, Setting, training_counts


class Stored:
    """The answer of ``base``, and what was learnt beyond it if ``samples`` are learnt from."""

    def __init__(self, case: Case, base: Base, samples: int):
        self._base, self._residual = base, None
        if samples:
            db = case.first(samples).use_training()
            residual = LoadResidual(case.meshes, case.use_compliance(), base)
            self._residual = residual.learn(gather(db, np.arange(samples), "live", case.options), case.options)

    @property
    def memory_mb(self) -> float:
        """The memory that is held between queries [MB]."""
        return held_mb(self)

    def respond(self, contact: int, force: np.ndarray) -> np.ndarray:
        """Return the displacement (n_surface, 3) [m] under ``force`` (3,) [N]; InputError for a bad contact."""
        if self._residual is None:
            return self._base.answer(contact, force)[0]
        return self._residual.respond(contact, force)


def shares(case: Case, family: str) -> list[Setting]:
    """List how many training samples are learnt from."""
    return [{"samples": count} for count in training_counts(case, case.grid[family]["training_shares"])]
