"""Answer with quadratic finite elements by L-BFGS: no matrix of the deformed body, one multigrid cycle an iteration."""

from typing import TYPE_CHECKING

from palpate.benchmark.model import Case, Solver
from palpate.models.fem import Fem
from palpate.models.limit import ToLimit
from palpate.solvers.equilibrium import FastEquilibrium

if TYPE_CHECKING:
    from palpate.models import kinds


def prepare(case: Case, model: "kinds.FastFEM") -> Solver:
    solver = Fem(case, model, 2, FastEquilibrium)
    return ToLimit(case, solver, solver.surface_columns(case)) if model.target else solver
