"""Answer with quadratic finite elements by L-BFGS: no matrix of the deformed body, one multigrid cycle an iteration."""

from functools import partial

from palpate.benchmark.model import Case, Setting, distinct
from palpate.models.fem import Fem
from palpate.models.limit import TO_LIMIT, with_limit
from palpate.solvers.equilibrium import FastEquilibrium

LAW, REDUCES = "the body's", "p2"


def settings(case: Case) -> list[Setting]:
    """List for each of the finest levels, coarse first, each start with its caps on iterations, and tolerances.

    The setting with most iterations, from rest and from the frame before, is also extrapolated to the limit of the
    levels.
    """
    grid, last = case.grid["fast_fem"], len(case.body.levels) - 1
    found: list[Setting] = []
    for level in range(max(0, last + 1 - grid["levels"]), last + 1):
        caps = {
            "linear": grid["linear_iterations"] if len(case.prepared_contacts) else [],
            "frame": grid["finest_frame_iterations" if level == last else "frame_iterations"],
            "rest": grid["iterations"],
        }
        for start, counts in caps.items():
            each: list[Setting] = [{"level": level, "start": start, "iterations": n} for n in counts]
            to_limit = start != "linear" and len(case.prepared_contacts)
            found += [*each, each[-1] | TO_LIMIT] if each and to_limit else each
        found += [{"level": level, "start": "rest", "tolerance": tolerance} for tolerance in grid["tolerances"]]
    return distinct(found)


offline = partial(with_limit(Fem, Fem.surface_columns), order=2, solver=FastEquilibrium)
