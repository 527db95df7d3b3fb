"""Hard cases of static solvers: loads beyond what a body was pressed with, and a start that is inside out."""

import numpy as np

from palpate.bodies.body import Body, nest
from palpate.bodies.box import box
from palpate.effects.patch_load import nodal_load
from palpate.effects.quadratic_elements import QuadraticElements
from palpate.solvers.equilibrium import Equilibrium, FastEquilibrium
from palpate.studies.hard_cases.hard_case import Answer, Case
from palpate.studies.hard_cases.stage import SOFT

SOLVERS = {"fem_quadratic": Equilibrium, "fem_fast": FastEquilibrium}
RESIDUAL = "residual force at free nodes / the load"
PRESSED_N = 0.05
"""Moves the bar by a tenth of its length."""


def cases() -> list[Case]:
    """Return the declared cases of this family."""

    def case(name, scene, times, mirrored=False):
        words = (name, "fem", "palpate", scene, "equilibrium", RESIDUAL, 1e-6)
        return Case.of(*words, run=lambda model: _pressed(model, times, mirrored), models=tuple(SOLVERS))

    return [
        case("twice_the_load", "a bar is pressed by a disc, twice as hard as moves it by a tenth of its length", 2.0),
        case("thrice_the_load", "the same, three times as hard", 3.0),
        case("inverted_start", "the same press, once, and the search starts from a bar that is mirrored", 1.0, True),
    ]  # fmt: skip


def _bar() -> Body:
    mesh = box([0.2, 0.05, 0.05], [8, 2, 2])
    return nest("bar", mesh, 1, np.flatnonzero(mesh.nodes[:, 0] == 0.0), SOFT)


def _pressed(model: str, times: float, mirrored: bool) -> Answer:
    """Press the bar near its end; the residual is computed apart from the solver."""
    body = _bar()
    solver, rest = SOLVERS[model](body, 0, 2), body.fine.nodes
    contact = int(np.argmax(body.coarse.nodes @ [1.0, 0.1, 1.0]))
    load = nodal_load(body, 0, contact, np.array([0.0, 0.0, -times * PRESSED_N]), 0.03, order=2)
    start = None
    if mirrored:
        start = rest * [1.0, -1.0, 1.0]
        start[body.anchors[1]] = rest[body.anchors[1]]
    elements = QuadraticElements(body.coarse, body.material)

    def error(a: np.ndarray) -> float:
        force = elements.force(a) + load
        force[body.anchors[1]] = 0.0
        return float(np.linalg.norm(force) / np.linalg.norm(load))

    return Answer(solver.solve(load, 1e-8, start).x, rest, error)
