"""Answer with linear fine finite elements, whose compliance is computed in advance."""

import numpy as np

from palpate.enrichment.linear_fem import LinearFem
from palpate.models.memory import held_mb
from palpate.models.model import Case, Setting

PREPARED, REDUCES, LAW = True, "p2", "linear"


def settings(case: Case) -> list[Setting]:
    """List the one setting there is."""
    return [{}]


def prepare(case: Case, setting: Setting) -> "Linear":
    """Take the compliance, which is all that it costs."""
    return Linear(case)


class Linear:
    """Three stored columns for each contact."""

    def __init__(self, case: Case):
        self._linear = LinearFem(case.use_compliance())

    @property
    def memory_mb(self) -> float:
        """The memory that is held between queries [MB]."""
        return held_mb(self)

    def respond(self, contact: int, force: np.ndarray) -> np.ndarray:
        """Return the displacement (n_surface, 3) [m] under ``force`` (3,) [N]; InputError for a bad contact."""
        return self._linear.predict(None, contact, force)
