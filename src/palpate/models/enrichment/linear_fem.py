"""Answer with linear fine FEM, a rival whose compliance is computed in advance: three columns for each contact."""

import numpy as np

from palpate.bodies.contacts import row_of
from palpate.models.enrichment.fit_inputs import Fitting
from palpate.solvers.compliance import Compliance


class LinearFem:
    """The linear fine response to the force; the coarse simulation is not looked at."""

    sigma_m = np.nan

    def __init__(self, compliance: Compliance):
        self._contacts, self._columns = compliance.contacts, compliance.fine

    def predict(self, coarse: np.ndarray | None, contact: int, force: np.ndarray) -> np.ndarray:
        """Return the fine surface displacement (n, 3) [m] under ``force`` (3,) [N] at coarse node ``contact``."""
        return np.tensordot(force, self._columns[row_of(self._contacts, contact)], 1)

    def answer(self, contact: int, force: np.ndarray) -> tuple[np.ndarray, None]:
        """Return the same, and no rotations; InputError for a contact that is not prepared."""
        return self.predict(None, contact, force), None

    def superpose(self, presses: list[tuple[int, np.ndarray]]) -> np.ndarray:
        """Return the sum (n, 3) [m] of the responses to forces (3,) [N], each at its contact."""
        first, *others = [self.predict(None, *press) for press in presses]
        return np.sum([first, *others], axis=0) if others else first


def fit(fitting: Fitting) -> LinearFem:
    """Take the linear responses; nothing is learnt."""
    return LinearFem(fitting.linear())
