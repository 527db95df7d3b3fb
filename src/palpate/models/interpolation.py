"""Answer with the coarse answer, interpolated linearly: the rival that any user has before learning anything."""

import numpy as np

from palpate.benchmark.accuracy import Method
from palpate.benchmark.database import Database
from palpate.benchmark.load import Answer, Load
from palpate.benchmark.model import Case, Solver
from palpate.models import kinds
from palpate.models.coarse_answers import coarse_solver


class Interpolation(Method):
    """Fine displacements by the prolongation alone: one sparse product."""

    def __init__(self, db: Database):
        self._prolongation = db.prolongation

    def predict(self, coarse: np.ndarray, contact: int, force: np.ndarray) -> np.ndarray:
        """Return the fine surface displacement (n, 3) [m] from that of all coarse nodes, (N, 3) [m]."""
        return self._prolongation @ coarse


class Interpolated(Solver):
    """A coarse answer, brought to the fine surface by one sparse product."""

    def __init__(self, case: Case, model: kinds.Interpolation):
        self._coarse, self._prolongation = coarse_solver(case, model.coarse), case.meshes.prolongation

    def respond(self, load: Load) -> np.ndarray | Answer:
        moved, forces = self._coarse.answer(load)
        displacement = self._prolongation @ moved
        return displacement if forces is None else Answer(displacement, forces)


prepare = Interpolated
