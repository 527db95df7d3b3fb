"""Bring answers of elements to the limit of ever finer levels, by linear responses that are extrapolated there.

Errors of nested levels fall by one ratio with each (Richardson 1911). The difference of the limit's linear response and
that of the elements is stored for each prepared contact, and is added to an answer, turned with the rotations of the
response. The nonlinear part keeps the error of the elements.
"""

from dataclasses import replace

import numpy as np

from palpate.benchmark.load import Answer, Doubted, Load, Refused, displacement_of
from palpate.benchmark.model import LIMIT, Case, Solver, held_mb
from palpate.models.contact_modes.offline import Offline, target_columns
from palpate.models.warped_response import WarpedResponse


def limit_columns(case: Case) -> np.ndarray:
    """Return the limit of the linear responses, (n_contacts, 3, n_surface, 3) [m/N], for ``Compliance.fine``.

    They are computed once for a case, and charged to all that use them. Refused for a body of one level.
    """
    next_to_finest = len(case.body.levels) - 2
    if next_to_finest < 0:
        raise Refused(f"{case.body.name} has one level, and a limit is extrapolated from two at least")

    def make() -> np.ndarray:
        what = case.body, case.radius_m, next_to_finest
        offline = case.share(("offline", *what), lambda: Offline(*what))
        responses = [target_columns(offline, case, LIMIT, int(contact)) for contact in case.prepared_contacts]
        return np.ascontiguousarray(np.moveaxis(np.array(responses), 3, 1))

    case.use_compliance()
    return case.share(("limit columns", case.response), make, "limit columns")


def at_limit(case: Case) -> Case:
    """Return ``case`` with the limit's linear responses in the place of those stored."""
    return replace(case, response=replace(case.use_compliance(), fine=limit_columns(case), means=None))


class ToLimit(Solver):
    """The answers of ``solver`` to forces at prepared contacts, plus what the limit's linear responses add to them.

    own : (n_contacts, 3, n_surface, 3) [m/N], the linear responses of the elements of ``solver``
    """

    def __init__(self, case: Case, solver: Solver, own: np.ndarray):
        stored = case.use_compliance()
        self._solver = solver
        self._beyond = WarpedResponse(case.meshes, replace(stored, fine=limit_columns(case) - own))

    @property
    def memory_mb(self) -> float:
        return self._solver.memory_mb + held_mb(self._beyond)

    def precede(self, load: Load) -> None:
        self._solver.precede(load)

    def respond(self, load: Load) -> np.ndarray | Answer:
        """Answer as ``Solver`` does, but to no depth; an answer that the solver doubts is brought to the limit, too."""
        correction = self._beyond.superpose(load.forces())
        try:
            return _moved(self._solver.respond(load), correction)
        except Doubted as doubted:
            answer = doubted.answer._replace(displacement=doubted.answer.displacement + correction)
            raise Doubted(str(doubted), doubted.history, answer) from doubted


def _moved(answer: np.ndarray | Answer, beyond: np.ndarray) -> np.ndarray | Answer:
    moved = displacement_of(answer) + beyond
    return answer._replace(displacement=moved) if isinstance(answer, Answer) else moved
