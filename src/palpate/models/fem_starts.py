"""Choose where Newton's method begins: at rest, at the stored linear response, or at the frame before."""

from collections.abc import Callable
from time import perf_counter
from typing import Protocol
from weakref import WeakKeyDictionary, ref

import numpy as np

from palpate.benchmark.load import Load
from palpate.benchmark.model import Case
from palpate.bodies.contacts import row_of
from palpate.errors import NotConverged
from palpate.models.fem_statics import Simulation

BEFORE = 0.97
"""Share of the load under which the frame before stood: a finger that presses within half a second at 60 frames a
second adds so much a frame."""

_kept: WeakKeyDictionary = WeakKeyDictionary()
"""Linear columns with what they took [s], and frames, by training samples and elements: one setting's serve all."""


class Start(Protocol):
    """The displacements that Newton's method begins at."""

    def at(self, load: Load) -> np.ndarray | None:
        """Return displacements (n_nodes, 3) [m] of all nodes, None for rest; InputError for a bad contact."""

    def precede(self, load: Load) -> None:
        """Do what happened before this query was asked; not timed."""


class Settles(Protocol):
    """A simulation that can find the frame before."""

    def settled(self, load: Load) -> np.ndarray:
        """Return converged displacements (n_nodes, 3) [m]."""


class Rest:
    """Begin at rest."""

    def __init__(self, case: Case, simulation: Settles, elements: tuple[float, ...]):
        """Take what all starts take: the case, the simulation, and the numbers that name its mesh and elements."""

    def at(self, load: Load) -> None:
        """Return None."""

    def precede(self, load: Load) -> None:
        """Do nothing."""


class LinearStart:
    """Begin at the linear response of the same elements, whose columns were stored for each prepared contact."""

    def __init__(self, case: Case, simulation: Simulation, elements: tuple[int, int]):
        kept = _kept.setdefault(case.database, {})
        if elements in kept:
            self._columns, seconds = kept[elements]
            case.charge("columns", seconds)  # spent before, for another setting
        else:
            begin = perf_counter()
            self._columns = simulation.linear_columns(case.prepared_contacts)
            kept[elements] = self._columns, perf_counter() - begin
        self._contacts = case.prepared_contacts

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

    def precede(self, load: Load) -> None:
        """Do nothing."""


class FrameBefore:
    """Begin at the converged answer to BEFORE times the same force; where there is none, at rest.

    Frames that a setting has found serve the later ones. A solver holds the last one only.
    """

    def __init__(self, case: Case, simulation: Settles, elements: tuple[float, ...]):
        self._simulation, self._database, self._elements = simulation, ref(case.database), elements
        self._asked: tuple[bytes | int, ...] | None = None
        self._frame: np.ndarray | None = None

    def precede(self, load: Load) -> None:
        """Find the frame before; not timed."""
        self._asked = load.key
        database = self._database()
        kept = {} if database is None else _kept.setdefault(database, {})
        frames = kept.setdefault(("frames", *self._elements), {})
        if self._asked not in frames:
            try:
                frames[self._asked] = self._simulation.settled(load.times(BEFORE))
            except NotConverged:
                frames[self._asked] = None
        self._frame = frames[self._asked]

    def at(self, load: Load) -> np.ndarray | None:
        """Return the frame that ``precede`` has found for this load, or None for rest."""
        return self._frame if self._asked == load.key else None


STARTS: dict[str, Callable[[Case, Simulation, tuple[int, int]], Start]] = {
    "rest": Rest,
    "linear": LinearStart,
    "frame": FrameBefore,
}
"""The starts by the names that settings have."""
