"""Linear fine finite elements with their compliance worked out beforehand."""

from dataclasses import replace

import numpy as np

from palpate.enrichment.linear_fem import LinearFem
from palpate.errors import InputError
from palpate.models.fem_statics import no_contact
from palpate.models.memory import held_mb
from palpate.models.model import Case, Setting, checked


def settings(case: Case) -> list[Setting]:
    """There is nothing to turn."""
    return [{}]


def prepare(case: Case, setting: Setting) -> "Linear":
    """Only what the compliance took before."""
    return Linear(case)


class Linear:
    """Three stored columns a contact."""

    def __init__(self, case: Case):
        none = np.empty(0)
        self._linear = LinearFem(replace(case.compliance, restricted=none, coarse=none))  # the others are not needed
        self._n_surface = case.n_surface

    @property
    def memory_mb(self) -> float:
        """What is held between queries [MB]."""
        return held_mb(self)

    def respond(self, contact: int, force: np.ndarray) -> np.ndarray:
        """Displacement (n_surface, 3) [m] under ``force`` (3,) [N]; InputError for a bad contact."""
        try:
            return checked(self._linear.predict(None, contact, force), self._n_surface)
        except KeyError:
            raise InputError(no_contact(contact)) from None
