"""Answer with linear responses of fine finite elements, computed in advance: three columns for each contact.

Linear responses superpose; for prescribed disc displacements the forces follow from a 3k × 3k system.
"""

import numpy as np

from palpate.benchmark.load import Answer, Load
from palpate.benchmark.model import Case, Solver, held_mb
from palpate.bodies.contacts import row_of
from palpate.models import kinds
from palpate.models.depths import Discs
from palpate.models.enrichment.training_samples import Fitting
from palpate.models.limit import at_limit
from palpate.models.near_buckling import NearBuckling
from palpate.solvers.compliance import Compliance


class LinearFem:
    """The linear response of fine elements to a force; the coarse simulation is not used."""

    sigma_m = np.nan

    def __init__(self, compliance: Compliance):
        self._contacts, self._columns = compliance.contacts, compliance.fine.reshape(len(compliance.fine), 3, -1)

    def predict(self, coarse: np.ndarray | None, contact: int, force: np.ndarray) -> np.ndarray:
        """Return the fine surface displacement (n, 3) [m] under ``force`` (3,) [N] at coarse node ``contact``."""
        return (force @ self._columns[row_of(self._contacts, contact)]).reshape(-1, 3)

    def answer(self, contact: int, force: np.ndarray) -> tuple[np.ndarray, None]:
        """Return the displacement as ``predict`` does, and None for rotations; InputError for an unprepared contact."""
        return self.predict(None, contact, force), None

    def superpose(self, presses: list[tuple[int, np.ndarray]]) -> np.ndarray:
        """Return the sum (n, 3) [m] of the responses to forces (3,) [N], each at its contact."""
        first, *others = [self.predict(None, *press) for press in presses]
        return np.sum([first, *others], axis=0) if others else first


def fit(fitting: Fitting) -> LinearFem:
    """Take the linear responses; nothing is learnt."""
    return LinearFem(fitting.linear())


class Linear(Solver):
    """Three stored columns for each contact."""

    def __init__(self, case: Case, model: kinds.LinearFEM):
        case = at_limit(case) if model.target else case
        self._linear, self._discs, self._buckling = LinearFem(case.use_compliance()), Discs(case), NearBuckling(case)

    @property
    def memory_mb(self) -> float:
        return held_mb((self._linear, self._buckling))

    def respond(self, load: Load) -> np.ndarray | Answer:
        """Answer as ``Solver`` does; Refused where depths do not tell the forces, Doubted where the body may buckle."""
        by_force, to_depth = load.parted()
        if not to_depth:
            return self._buckling.checked(load, self._linear.superpose(by_force))
        forces = self._discs.linear_forces(load)
        presses = [(press.node, force) for press, force in zip(load.presses, forces, strict=True)]
        return self._buckling.checked(load, Answer(self._linear.superpose(presses), forces))


prepare = Linear
