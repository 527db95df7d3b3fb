"""Answer with finite elements on a level of the body, converged or stopped early, from one of several starts."""

from collections.abc import Callable
from typing import Protocol

import numpy as np

from palpate.benchmark.load import Answer, Load
from palpate.benchmark.model import Case, Kept, Solver
from palpate.bodies.contacts import row_of
from palpate.effects.patch_load import Patch
from palpate.errors import NotConverged
from palpate.models import kinds
from palpate.models.fem_statics import Simulation, to_surface
from palpate.models.limit import ToLimit
from palpate.models.near_buckling import NearBuckling
from palpate.solvers.equilibrium import Equilibrium

BEFORE = 0.97
"""Share of the load under which the frame before stood: a finger that presses within half a second at 60 frames a
second adds so much a frame."""


class Settles(Protocol):
    """A simulation that can compute the answer to the load of the frame before."""

    def settled(self, load: Load) -> np.ndarray:
        """Return converged displacements (n_nodes, 3) [m]."""


class Rest:
    """Newton's method begins at rest; the other starts derive from this class."""

    def __init__(self, case: Case, simulation: Settles, elements: tuple[float, ...]):
        """Take what all starts take: the case, the simulation, and the numbers that name its mesh and elements."""

    def at(self, load: Load) -> np.ndarray | None:
        """Return displacements (n_nodes, 3) [m] of all nodes, None for rest; InputError for a bad contact."""
        return None

    def precede(self, load: Load) -> None:
        """Compute what was known before this query was asked; not timed."""


def stored_columns(case: Case, simulation: Simulation, elements: tuple[int, int]) -> np.ndarray:
    """Return linear responses (n_contacts, 3, n_nodes, 3) [m/N] of ``elements``, a level and an order, of a case."""
    name = "columns", case.database, *elements
    return case.share(name, lambda: simulation.linear_columns(case.prepared_contacts), "columns")


class LinearStart(Rest):
    """Begin at the linear response of the same elements, which is stored for each prepared contact."""

    def __init__(self, case: Case, simulation: Simulation, elements: tuple[int, int]):
        self._contacts, self._columns = case.prepared_contacts, stored_columns(case, simulation, elements)

    def at(self, load: Load) -> np.ndarray | None:
        """Return the linear response; InputError for a contact that is not prepared.

        None where a depth is asked for, as its force is not known: the search begins at a linear response of its own.
        """
        by_force, to_depth = load.parted()
        rows = [row_of(self._contacts, contact) for contact, _ in by_force + to_depth]
        if to_depth:
            return None
        responses = [np.tensordot(f, self._columns[row], 1) for row, (_, f) in zip(rows, by_force, strict=True)]
        return np.sum(responses, axis=0)


class FrameBefore(Rest):
    """Begin at the converged answer to BEFORE times the same load, or at rest where it has no answer.

    All settings of a case share these answers. A solver holds the last one only.
    """

    def __init__(self, case: Case, simulation: Settles, elements: tuple[float, ...]):
        self._simulation = simulation
        self._frames = case.share(("frames", case.database, *elements), Kept)
        self._asked: tuple[bytes | int, ...] | None = None
        self._frame: np.ndarray | None = None

    def precede(self, load: Load) -> None:
        self._asked = load.key
        if self._asked not in self._frames:
            try:
                frame: np.ndarray | None = self._simulation.settled(load.times(BEFORE))
            except NotConverged:
                frame = None
            self._frames[self._asked] = frame, 0.0
        self._frame = self._frames[self._asked][0]

    def at(self, load: Load) -> np.ndarray | None:
        """Return the frame that ``precede`` has found for this load, or None for rest."""
        return self._frame if self._asked == load.key else None


STARTS: dict[str, Callable[[Case, Simulation, tuple[int, int]], Rest]] = {
    "rest": Rest,
    "linear": LinearStart,
    "frame": FrameBefore,
}
"""The starts by the names that settings have."""


class Fem(Solver):
    """Finite elements of ``order``, brought to the fine surface with their own shape functions.

    Offline are matrix patterns, the preconditioner of the rest state, and with the start "linear" its columns.

    solver : how their equilibrium is found
    """

    presses_anywhere = True

    def __init__(self, case: Case, model: kinds.Elements, order: int, solver: type[Equilibrium] = Equilibrium):
        level, tolerance = model.level_of(case), model.tolerance or case.tolerance
        self._simulation = Simulation(case, level, tolerance, model.iterations, order, solver)
        self._elements = level, order
        self._start = STARTS[model.start](case, self._simulation, self._elements)
        self._up = to_surface(case.body, level, order)
        # stopped early it is no equilibrium whose stability could be looked at
        self._buckling = NearBuckling(case) if model.iterations else None

    def precede(self, load: Load) -> None:
        self._start.precede(load)

    def place(self, number: int, patch: Patch) -> int:
        return self._simulation.shares.place(number, patch)

    def respond(self, load: Load) -> np.ndarray | Answer:
        """Answer as ``Solver`` does; Doubted where it is stopped early near the load under which the body buckles."""
        displacement, forces = self._simulation.answer(load, self._start.at(load))
        answer = self._up @ displacement if forces is None else Answer(self._up @ displacement, forces)
        if self._buckling is None or any(press.node < 0 for press in load.presses):
            return answer
        return self._buckling.checked(load, answer)

    def surface_columns(self, case: Case) -> np.ndarray:
        """Return the linear responses (n_contacts, 3, n_surface, 3) [m/N] of these elements to unit forces."""
        if self._elements == (len(case.body.levels) - 1, 2):
            return case.use_compliance().fine
        columns = stored_columns(case, self._simulation, self._elements)
        return np.array([[self._up @ column for column in contact] for contact in columns])


def prepare(case: Case, model: kinds.FEM) -> Solver:
    solver = Fem(case, model, model.order)
    return ToLimit(case, solver, solver.surface_columns(case)) if model.target else solver
