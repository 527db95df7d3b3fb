"""Answer with corotational finite elements on a level of the body, stopped early or converged, from cold or warm."""

import numpy as np

from palpate.benchmark.load import Answer, Load
from palpate.benchmark.model import Case, Setting, distinct
from palpate.effects.patch_load import Patch
from palpate.models.fem_starts import STARTS
from palpate.models.fem_statics import Simulation, to_surface
from palpate.models.memory import held_mb
from palpate.solvers.equilibrium import Equilibrium

LAW = "the body's"


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


def prepare(case: Case, setting: Setting, order: int) -> "Fem":
    """Make matrix patterns and the preconditioner of the rest state, and with ``start`` linear store its columns."""
    return Fem(case, setting, order)


class Fem:
    """Finite elements of ``order``, brought to the fine surface with their own shape functions.

    solver : how their equilibrium is found
    """

    def __init__(self, case: Case, setting: Setting, order: int, solver: type[Equilibrium] = Equilibrium):
        level, tolerance = setting["level"], setting.get("tolerance", case.tolerance)
        self._simulation = Simulation(case, level, tolerance, setting.get("iterations"), order, solver)
        self._start = STARTS[setting["start"]](case, self._simulation, (level, order))
        self._up = to_surface(case.body, level, order)

    @property
    def memory_mb(self) -> float:
        """The memory that is held between queries [MB]."""
        return held_mb(self)

    def precede(self, load: Load) -> None:
        """Find the frame before, for a setting that starts from it; not timed."""
        self._start.precede(load)

    def place(self, number: int, patch: Patch) -> int:
        """Return what loads name as a node to press a disc anywhere on the surface, until ``number`` is placed anew."""
        return self._simulation.place(number, patch)

    def respond(self, load: Load) -> np.ndarray | Answer:
        """Return the displacement (n_surface, 3) [m] under ``load``, with the forces of discs pushed to a depth.

        Errors as ``Solver``.
        """
        moved, forces = self._simulation.answer(load, self._start.at(load))
        return self._up @ moved if forces is None else Answer(self._up @ moved, forces)
