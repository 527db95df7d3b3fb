"""Answer with finite elements on a level of the body, stopped early or converged, from rest, linear or warm."""

from collections.abc import Callable
from typing import Protocol

import numpy as np

from palpate.benchmark.load import Answer, Load
from palpate.benchmark.model import Case, Kept, Setting, Solver, distinct, one_stage
from palpate.bodies.contacts import row_of
from palpate.effects.patch_load import Patch
from palpate.errors import NotConverged
from palpate.models.fem_statics import Simulation, to_surface
from palpate.solvers.equilibrium import Equilibrium

LAW = "the body's"
BEFORE = 0.97
"""Share of the load under which the frame before stood: a finger that presses within half a second at 60 frames a
second adds so much a frame."""


class Settles(Protocol):
    """A simulation that can find the frame before."""

    def settled(self, load: Load) -> np.ndarray:
        """Return converged displacements (n_nodes, 3) [m]."""


class Rest:
    """Begin Newton's method at rest; other starts are kinds of this one."""

    def __init__(self, case: Case, simulation: Settles, elements: tuple[float, ...]):
        """Take what all starts take: the case, the simulation, and the numbers that name its mesh and elements."""

    def at(self, load: Load) -> np.ndarray | None:
        """Return displacements (n_nodes, 3) [m] of all nodes, None for rest; InputError for a bad contact."""
        return None

    def precede(self, load: Load) -> None:
        """Do what happened before this query was asked; not timed."""


class LinearStart(Rest):
    """Begin at the linear response of the same elements, whose columns were stored for each prepared contact."""

    def __init__(self, case: Case, simulation: Simulation, elements: tuple[int, int]):
        self._contacts = case.prepared_contacts
        name = "columns", case.database, *elements
        self._columns = case.share(name, lambda: simulation.linear_columns(self._contacts), "columns")

    def at(self, load: Load) -> np.ndarray | None:
        """Return the linear response; InputError for a contact that is not prepared.

        To a depth, whose force is not known, a search begins at its own linear response.
        """
        given, pushed = load.parted()
        rows = [row_of(self._contacts, contact) for contact, _ in given + pushed]
        if pushed:
            return None
        parts = [np.tensordot(f, self._columns[row], 1) for row, (_, f) in zip(rows, given, strict=True)]
        return np.sum(parts, axis=0)


class FrameBefore(Rest):
    """Begin at the converged answer to BEFORE times the same force; where there is none, at rest.

    Frames that a setting has found serve the later ones. A solver holds the last one only.
    """

    def __init__(self, case: Case, simulation: Settles, elements: tuple[float, ...]):
        self._simulation = simulation
        self._frames = case.share(("frames", case.database, *elements), Kept)
        self._asked: tuple[bytes | int, ...] | None = None
        self._frame: np.ndarray | None = None

    def precede(self, load: Load) -> None:
        """Find the frame before; not timed."""
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


def settings(case: Case, order: int) -> list[Setting]:
    """List for each level, from coarse to fine, the starts, and for each of them how far the mesh is solved.

    From rest there are caps on Newton's iterations, and tolerances; from the linear response and from the frame before
    fewer caps, and no more than the loose tolerances. Quadratic elements on the finest level, which have many more
    nodes than all others and take seconds, are solved from rest to the loosest tolerance, which is far below their own
    error; ``finest_warm_iterations`` adds caps from the frame before.
    """
    grid, last = case.grid["fem"], len(case.body.levels) - 1
    tolerances = [{"tolerance": tolerance} for tolerance in grid["tolerances"]]
    cold, warm = ([{"iterations": n} for n in grid[name]] for name in ("iterations", "warm_iterations"))
    found: list[Setting] = []
    for level in range(last + 1):
        end = {"tolerance": case.tolerance}
        if order == 2 and level == last:
            parts = [("frame", [{"iterations": n} for n in grid["finest_warm_iterations"]])]
            end = (tolerances or [end])[0]
        else:
            linear = [("linear", warm + tolerances)] if len(case.prepared_contacts) else []
            parts = [*linear, ("frame", warm + tolerances), ("rest", cold + tolerances)]
        parts.append(("rest", [end]))
        found += [{"level": level, "start": start} | far for start, fars in parts for far in fars]
    return distinct(found)


class Fem(Solver):
    """Finite elements of ``order``, brought to the fine surface with their own shape functions.

    Offline are matrix patterns, the preconditioner of the rest state, and with the start "linear" its columns.

    solver : how their equilibrium is found
    """

    presses_anywhere = True

    def __init__(self, case: Case, setting: Setting, order: int, solver: type[Equilibrium] = Equilibrium):
        level, tolerance = setting["level"], setting.get("tolerance", case.tolerance)
        self._simulation = Simulation(case, level, tolerance, setting.get("iterations"), order, solver)
        self._start = STARTS[setting["start"]](case, self._simulation, (level, order))
        self._up = to_surface(case.body, level, order)

    def precede(self, load: Load) -> None:
        """Find the frame before, for a setting that starts from it; not timed."""
        self._start.precede(load)

    def place(self, number: int, patch: Patch) -> int:
        """Return what loads name as a node to press a disc anywhere on the surface, until ``number`` is placed anew."""
        return self._simulation.shares.place(number, patch)

    def respond(self, load: Load) -> np.ndarray | Answer:
        """Return the displacement (n_surface, 3) [m] under ``load``, with the forces of discs pushed to a depth.

        Errors as ``Solver``.
        """
        moved, forces = self._simulation.answer(load, self._start.at(load))
        return self._up @ moved if forces is None else Answer(self._up @ moved, forces)


offline = one_stage(Fem)
