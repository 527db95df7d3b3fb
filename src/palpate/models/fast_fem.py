"""Answer with quadratic finite elements by L-BFGS: no matrix of the deformed body, one multigrid cycle an iteration."""

from palpate.benchmark.model import Case, Solver
from palpate.models import kinds
from palpate.models.fem import Fem
from palpate.models.limit import ToLimit
from palpate.solvers.equilibrium import FastEquilibrium


def prepare(case: Case, model: kinds.FastFEM) -> Solver:
    solver = Fem(case, model, 2, FastEquilibrium)
    return ToLimit(case, solver, solver.surface_columns(case)) if model.target else solver
