"""Hard cases of laws: forces that invert elements, a start that is inverted, and bodies that keep their volume."""

import numpy as np

from palpate.bodies.body import Body, nest
from palpate.bodies.box import box
from palpate.bodies.material import LAWS, Material
from palpate.effects.linear_elements import LinearElements
from palpate.solvers.equilibrium import Equilibrium
from palpate.studies.hard_cases import locking
from palpate.studies.hard_cases.hard_case import Answer, Case
from palpate.studies.hard_cases.stage import end_face

RESIDUAL = "residual force at free nodes / the load"


def cases() -> list[Case]:
    """Return the declared cases of this family."""

    def case(name, scene, expected, measure, bound, run):
        return Case.of(name, "fem", "palpate", scene, expected, measure, bound, run=run, models=LAWS)

    return [
        case("each_law_crushed", "a bar under a press along its axis of half its Young's modulus, for each law",
             "equilibrium", RESIDUAL, 1e-6, lambda law: _residual(law, 0.3, [-0.5, 0.0, 0.0])),
        case("each_law_inverting_force", "a sideways pull of twice Young's modulus, for each law",
             "equilibrium", RESIDUAL, 1e-6, lambda law: _residual(law, 0.3, [0.0, 0.0, -2.0])),
        case("each_law_from_inside_out", "a bar is released at rest mirrored through its held end, for each law",
             "equilibrium", RESIDUAL, 1e-6, _mirrored),
        case("each_law_incompressible", "ν = 0.4999, quadratic elements, a bar bent by its end, for each law",
             "the deflection that scikit-fem computes", "relative error of the deflection", 0.05, _bent),
    ]  # fmt: skip


def _bar(law: str, poisson: float) -> Body:
    mesh = box([0.2, 0.05, 0.05], [8, 2, 2])
    return nest("bar", mesh, 1, np.flatnonzero(mesh.nodes[:, 0] == 0.0), Material(3000.0, poisson, 1000.0, law))


def _load(body: Body, level: int, moduli: list[float]) -> np.ndarray:
    """Return a traction on the end, given in Young's moduli, as nodal forces (n, 3) [N]."""
    return np.outer(end_face(body.levels[level]), np.array(moduli) * body.material.young_pa * 0.05**2)


def _residual(law: str, poisson: float, moduli: list[float], start: np.ndarray | None = None) -> Answer:
    """Compute an equilibrium, judged by its relative residual, apart from the solver."""
    body = _bar(law, poisson)
    load = _load(body, 1, moduli)
    elements, rest = LinearElements(body.fine, body.tissue(1)), body.fine.nodes

    def error(x: np.ndarray) -> float:
        force = elements.force(x) + load
        force[body.anchors[1]] = 0.0
        return float(np.linalg.norm(force) / np.linalg.norm(load))

    return Answer(Equilibrium(body, 1).solve(load, 1e-8, start).x, rest if start is None else start, error, zero=rest)


def _mirrored(law: str) -> Answer:
    nodes = _bar(law, 0.3).fine.nodes
    return _residual(law, 0.3, [0.0, 0.0, -1e-3], nodes * [-1.0, 1.0, 1.0])


def _bent(law: str) -> Answer:
    """Compare the deflection of quadratic elements under a small load with that of another library."""
    body = _bar(law, locking.POISSON)
    problem, load = Equilibrium(body, 0, 2), _load(body, 1, [0.0, 0.0, -1e-4])
    way = load / np.abs(load).sum()
    expected = float(np.abs(load).sum()) * locking.reference()

    def error(moved: np.ndarray) -> float:
        return abs(float(np.vdot(way, moved)) / expected - 1.0)

    found = problem.solve(load, 1e-6).x - problem.mesh.nodes
    return Answer(found, np.zeros_like(found), error)
