"""Volumetric locking: the deflection of a bar that keeps its volume, by linear and quadratic elements."""

from functools import cache

import numpy as np

from palpate.bodies.body import nest
from palpate.bodies.box import box
from palpate.bodies.material import Material
from palpate.solvers.equilibrium import Equilibrium
from palpate.studies.hard_cases.hard_case import Answer
from palpate.studies.hard_cases.stage import end_face

SIZES_M, YOUNG_PA, POISSON, INSTEAD = [0.2, 0.05, 0.05], 3000.0, 0.4999, 0.45
CASES = {
    "level_0": (0, POISSON, 1),
    "level_1": (1, POISSON, 1),
    "level_2": (2, POISSON, 1),
    "level_2_softer": (2, INSTEAD, 1),
    "quadratic_level_0": (0, POISSON, 2),
    "quadratic_level_1": (1, POISSON, 2),
}
"""Level of the mesh, Poisson's ratio and order of the elements of each computation."""
LOCKED = ("level_0", "level_1", "level_2", "level_2_softer")
"""Those that are known to lock, the last one less."""


def deflection(model: str) -> Answer:
    """Compute the deflection of one of CASES for a bar under a small load at its end, against ``reference``."""
    level, poisson, order = CASES[model]
    mesh, finest = box(SIZES_M, [8, 2, 2]), level + order - 1
    body = nest("bar", mesh, finest, np.flatnonzero(mesh.nodes[:, 0] == 0.0), Material(YOUNG_PA, poisson, 1000.0))
    shares = end_face(body.levels[finest])
    found = Equilibrium(body, level, order).linear_solver(1e-8)(np.outer(shares, [0.0, 0.0, 1.0]))
    expected = reference()

    def error(moved: np.ndarray) -> float:
        return abs(1.0 - float(shares @ moved[:, 2]) / expected)

    return Answer(found, np.zeros_like(found), error)


@cache
def reference(refined: int = 1) -> float:
    """Compute the mean deflection [m] of the loaded face under 1 N by scikit-fem, with the pressure as an unknown.

    These elements (Taylor and Hood 1973), quadratic in the displacement and linear in the pressure, do not lock;
    ``refined`` : how often each edge of the mesh is halved.
    """
    from skfem import (
        Basis,
        BilinearForm,
        ElementTetP1,
        ElementTetP2,
        ElementVector,
        FacetBasis,
        LinearForm,
        MeshTet,
        bmat,
        condense,
        solve,
    )
    from skfem.helpers import ddot, div, sym_grad

    tissue = Material(YOUNG_PA, POISSON, 1000.0)
    body = nest("bar", box(SIZES_M, [8, 2, 2]), refined, np.array([0]), tissue).fine
    mesh = MeshTet(np.ascontiguousarray(body.nodes.T), np.ascontiguousarray(body.tetrahedra.T))
    basis = Basis(mesh, ElementVector(ElementTetP2()), intorder=4)
    pressure = basis.with_element(ElementTetP1())
    stiffness = BilinearForm(lambda u, v, w: 2.0 * tissue.shear_pa * ddot(sym_grad(u), sym_grad(v))).assemble(basis)
    coupling = BilinearForm(lambda u, q, w: -div(u) * q).assemble(basis, pressure)
    bulk = BilinearForm(lambda p, q, w: -p * q / tissue.lame_pa).assemble(pressure)
    face = FacetBasis(mesh, basis.elem, facets=mesh.facets_satisfying(lambda x: np.isclose(x[0], SIZES_M[0])))
    load = LinearForm(lambda v, w: v[2] / (SIZES_M[1] * SIZES_M[2])).assemble(face)
    held = basis.get_dofs(lambda x: np.isclose(x[0], 0.0)).all()
    load = np.concatenate([load, np.zeros(pressure.N)])
    return float(load @ solve(*condense(bmat([[stiffness, coupling.T], [coupling, bulk]], "csc"), load, D=held)))
