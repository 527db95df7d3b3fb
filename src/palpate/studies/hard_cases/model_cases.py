"""Hard cases of contact modes, and of models learnt from samples."""

from dataclasses import replace
from functools import cache, partial
from typing import Any

import numpy as np

from palpate.benchmark.accuracy import errors
from palpate.benchmark.database import database_of
from palpate.benchmark.load import Load, displacement_of, loads_of
from palpate.benchmark.model import Case as ModelCase
from palpate.benchmark.model import Solver
from palpate.bodies.body import Body
from palpate.models import kinds
from palpate.studies.hard_cases.enrichment_cases import SETTINGS as FIT
from palpate.studies.hard_cases.stage import SOFT, Answer, Case, bar_body

RADIUS_M = 0.02
MEASURE = "RMSE / peak against quadratic elements"
NEWTONS = 0.018
"""A press that moves the bar's end by a tenth of its length."""


def reduced_contacts() -> list[Case]:
    may_fail = ("stable", "not_converged")
    outcomes = {"the answer": may_fail[:1], "the answer, or it is told": may_fail, "it is told": may_fail[1:]}

    def case(name, scene, direction, expected="the answer, or it is told", **body):
        run = partial(_pressed, direction, body)
        return Case(f"press_{name}", scene, expected, MEASURE, 0.02, run, ["contact_modes"], outcomes[expected])

    return [
        case("twofold", "a bar's end is pressed twice as hard as it is made for", [0.0, 0.0, -2.0]),
        case("threefold", "the same three times as hard", [0.0, 0.0, -3.0]),
        case("sideways", "the same along the surface", [0.0, 1.0, 0.0]),
        case("outwards", "the same as a pull", [0.0, 0.0, 1.0]),
        case("on_slivers", "a layer of elements with dihedral angles of 0.1°", [0.0, 0.0, -1.0], "the answer",
             degrees=0.1),
        case("at_0.49", "ν = 0.49, where quadratic elements resist volume on average", [0.0, 0.0, -1.0], "it is told",
             poisson=0.49),
    ]  # fmt: skip


def bar(poisson: float = 0.3, degrees: float = 0.0) -> Body:
    """Make a bar of one level, held at one end."""
    return bar_body(0, replace(SOFT, poisson=poisson), degrees)


def _pressed(direction: list[float], bar_options: dict[str, float], model: str) -> Answer:
    """Press a bar's top near its free end by ``direction`` (3,) times NEWTONS, and judge contact modes."""
    body = bar(**bar_options)
    case = ModelCase.untrained(body, "hard", RADIUS_M, FIT.seed, 1e-8)
    node = int(np.argmin(np.linalg.norm(body.coarse.nodes - TOP[-1], axis=1)))
    load = Load.at(node, NEWTONS * np.array(direction))
    answer = displacement_of(kinds.ContactModes().prepare(case).respond(load))
    return _compared(answer, displacement_of(_elements(case).respond(load)))


def _compared(answer: np.ndarray, expected: np.ndarray) -> Answer:
    """Return a displacement (n, 3) [m] as an answer; its error is the RMSE from ``expected`` over the peak of that."""
    return Answer(answer, np.zeros_like(answer), lambda a: errors(a, expected).rmse_of_peak)


def _elements(case: ModelCase) -> Solver:
    """Prepare quadratic elements, solved by Newton's method, whose answers are the reference."""
    return kinds.FEM(order=2, level=0, tolerance=1e-8).prepare(case)


MODELS = ("pod_galerkin", "pod_gaussian", "pod_network")
TOP = [[x, 0.025, 0.05] for x in (0.1, 0.125, 0.15, 0.175)]
"""Places [m] on the bar's top that are pressed; those of cases are the last one, those of samples all."""
FORCES = [[0.0, 0.0, -1.0], [0.5, 0.0, -0.8], [0.0, 0.5, -0.8], [-0.3, -0.3, -0.6], [0.0, 0.0, -0.5]]
"""Forces of the samples at each place, over NEWTONS; models are asked for a multiple of the first."""
LEARNING = {
    "pod_galerkin": kinds.PODGalerkin(modes=20, thinned=0.01),
    "pod_gaussian": kinds.PODOfLoads(modes=12),
    "pod_network": kinds.PODOfLoads(modes=12, learner="network"),
}


def learnt() -> list[Case]:
    def case(name, scene, times=1.0, models=MODELS, may_fail=False, **samples):
        expected = "the answer, or it is told" if may_fail else "the answer"
        declared, run = ("stable", "not_converged") if may_fail else ("stable",), partial(_asked, times, samples)
        return Case(f"learnt_{name}", scene, expected, MEASURE, 0.015, run, models, declared)

    return [
        case("as_sampled", "a bar's end is pressed as a sample has pressed it"),
        case("twofold", "the same twice as hard as any sample", 2.0, may_fail=True),
        case("threefold", "the same three times as hard", 3.0, may_fail=True),
        case("slivers", "a layer of elements with dihedral angles of 0.1°", degrees=0.1),
        case("at_0.49", "ν = 0.49, where quadratic elements resist volume on average", may_fail=True, poisson=0.49),
        case("one_answer", "all samples are the same press", models=MODELS[:1], alike=True),
    ]


def _asked(times: float, samples: dict[str, Any], model: str) -> Answer:
    """Ask a learnt model for a press ``times`` as hard as a sample, and compare with quadratic elements."""
    case, elements = _learnable(**samples)
    load = Load.at(int(case.database.contact[-1]), times * NEWTONS * np.array(FORCES[0]))
    expected = displacement_of(elements.respond(load))
    return _compared(displacement_of(LEARNING[model].prepare(case).respond(load)), expected)


@cache
def _learnable(poisson: float = 0.3, degrees: float = 0.0, alike: bool = False) -> tuple[ModelCase, Solver]:
    """Return a bar with its samples, two equal ones if ``alike``, and the quadratic elements that simulated them."""
    body = bar(poisson, degrees)
    nodes = [int(np.argmin(np.linalg.norm(body.coarse.nodes - place, axis=1))) for place in TOP]
    contacts, forces = np.repeat(nodes, len(FORCES)), NEWTONS * np.tile(FORCES, (len(TOP), 1))
    if alike:
        contacts, forces = contacts[-2:], np.tile(NEWTONS * np.array(FORCES[0]), (2, 1))
    zeros = np.zeros((len(contacts), *body.coarse.nodes.shape))
    case = ModelCase(body, "hard", RADIUS_M, database_of(body, contacts, forces, zeros, zeros), None, FIT, 1e-8)
    elements = _elements(case)
    fine = np.array([displacement_of(elements.respond(load)) for load in loads_of(contacts, forces)])
    return replace(case, database=replace(case.database, fine=fine)), elements
