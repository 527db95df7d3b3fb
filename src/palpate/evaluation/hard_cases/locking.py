"""Volumetric locking of linear tetrahedra: their deflection against that of quadratic ones."""

from functools import cache

import numpy as np

from palpate.bodies.body import nest
from palpate.bodies.box import box
from palpate.bodies.material import Material
from palpate.bodies.mesh import TetMesh
from palpate.evaluation.hard_cases.stage import end_face
from palpate.solvers.equilibrium import Equilibrium

SIZES_M, YOUNG_PA, POISSON, INSTEAD = [0.2, 0.05, 0.05], 3000.0, 0.4999, 0.45
CASES = {"level_0": (0, POISSON), "level_1": (1, POISSON), "level_2": (2, POISSON), "level_2_softer": (2, INSTEAD)}
"""Level of the mesh and Poisson's ratio of each computation."""


def missing(model: str) -> float:
    """Compute the relative deflection error of one of CASES for a bar under a small load at its end."""
    level, poisson = CASES[model]
    mesh = box(SIZES_M, [8, 2, 2])
    body = nest("bar", mesh, level, np.flatnonzero(mesh.nodes[:, 0] == 0.0), Material(YOUNG_PA, poisson, 1000.0))
    shares = end_face(body.levels[level])
    response = Equilibrium(body, level).linear_solver(1e-8)(np.outer(shares, [0.0, 0.0, 1.0]))
    return abs(1.0 - float(shares @ response[:, 2]) / _quadratic())


@cache
def _quadratic() -> float:
    """Compute the mean deflection [m] of the loaded face under 1 N with quadratic elements, which hardly lock."""
    from skfem import Basis, ElementTetP2, ElementVector, FacetBasis, LinearForm, MeshTet, asm, condense, solve
    from skfem.models.elasticity import lame_parameters, linear_elasticity

    body: TetMesh = box(SIZES_M, [8, 2, 2])
    mesh = MeshTet(np.ascontiguousarray(body.nodes.T), np.ascontiguousarray(body.tetrahedra.T))
    basis = Basis(mesh, ElementVector(ElementTetP2()), intorder=4)
    stiffness = asm(linear_elasticity(*lame_parameters(YOUNG_PA, POISSON)), basis)
    face = FacetBasis(mesh, basis.elem, facets=mesh.facets_satisfying(lambda x: np.isclose(x[0], SIZES_M[0])))
    traction = 1.0 / (SIZES_M[1] * SIZES_M[2])
    load = asm(LinearForm(lambda v, w: traction * v[2]), face)
    held = basis.get_dofs(lambda x: np.isclose(x[0], 0.0)).all()
    return float(load @ solve(*condense(stiffness, load, D=held)))
