"""Hard cases of contact modes, and of models learnt from samples."""

from dataclasses import replace
from functools import cache, partial
from typing import Any, Literal

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
    told = ("stable", "not_converged")
    outcomes = {"the answer": told[:1], "the answer, or it is told": told, "it is told": told[1:]}

    def case(name, scene, direction, expected="the answer, or it is told", **body):
        declared, run = {"contact_modes": outcomes[expected]}, partial(_pressed, direction, body)
        return Case(f"press_{name}", scene, expected, MEASURE, 0.02, run, ["contact_modes"], declared)

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


def _pressed(direction: list[float], changed: dict[str, float], model: str) -> Answer:
    body = bar(**changed)
    load, case = pressing(body, direction), case_of(body)
    found = displacement_of(kinds.ContactModes().prepare(case).respond(load))
    return _beside(found, displacement_of(_elements(case, 2).respond(load)))


def _beside(found: np.ndarray, expected: np.ndarray) -> Answer:
    return Answer(found, np.zeros_like(found), lambda answer: errors(answer, expected).rmse_of_peak)


def pressing(body: Body, direction: list[float]) -> Load:
    """Return a press of the middle of the top near the free end, by a multiple of NEWTONS."""
    far = np.linalg.norm(body.coarse.nodes - [0.175, 0.025, 0.05], axis=1)
    return Load.at(int(np.argmin(far)), NEWTONS * np.array(direction))


def case_of(body: Body) -> ModelCase:
    """Return what models of ``body`` see: no samples."""
    return ModelCase.untrained(body, "hard", RADIUS_M, FIT.seed, 1e-8)


def _elements(case: ModelCase, order: Literal[1, 2]) -> Solver:
    """Return the elements, solved by Newton's method, that answers are compared with."""
    return kinds.FEM(order=order, level=0, tolerance=1e-8).prepare(case)


MODELS = ("pod_galerkin", "pod_gaussian", "pod_network")
TOP = [[x, 0.025, 0.05] for x in (0.1, 0.125, 0.15, 0.175)]
"""Places of the samples; the last one is asked."""
WAYS = [[0.0, 0.0, -1.0], [0.5, 0.0, -0.8], [0.0, 0.5, -0.8], [-0.3, -0.3, -0.6], [0.0, 0.0, -0.5]]
"""Forces of the samples of each place, over NEWTONS; the first one is asked, times a factor."""
LEARNING = {
    "pod_galerkin": kinds.PODGalerkin(modes=20, thinned=0.01),
    "pod_gaussian": kinds.PODOfLoads(modes=12),
    "pod_network": kinds.PODOfLoads(modes=12, learner="network"),
}


def learnt() -> list[Case]:
    told = {model: ("stable", "not_converged") for model in MODELS}

    def case(name, scene, times=1.0, models=MODELS, declared=None, **samples):
        expected, run = "the answer, or it is told" if declared else "the answer", partial(_asked, times, samples)
        return Case(f"learnt_{name}", scene, expected, MEASURE, 0.015, run, models, declared or {})

    return [
        case("as_sampled", "a bar's end is pressed as a sample has pressed it"),
        case("twofold", "the same twice as hard as any sample", 2.0, declared=told),
        case("threefold", "the same three times as hard", 3.0, declared=told),
        case("slivers", "a layer of elements with dihedral angles of 0.1°", degrees=0.1),
        case("at_0.49", "ν = 0.49, where quadratic elements resist volume on average", declared=told, poisson=0.49),
        case("one_answer", "all samples are the same press", models=MODELS[:1], alike=True),
    ]


def _asked(times: float, samples: dict[str, Any], model: str) -> Answer:
    """Ask for a press that is ``times`` as hard as a sample, and compare with quadratic elements."""
    case, elements = _learnable(**samples)
    load = Load.at(int(case.database.contact[-1]), times * NEWTONS * np.array(WAYS[0]))
    expected = displacement_of(elements.respond(load))
    return _beside(displacement_of(LEARNING[model].prepare(case).respond(load)), expected)


@cache
def _learnable(poisson: float = 0.3, degrees: float = 0.0, alike: bool = False) -> tuple[ModelCase, Solver]:
    """Return a bar with its samples, all of which are the same if ``alike``, and the elements that simulate them."""
    body = bar(poisson, degrees)
    at = [int(np.argmin(np.linalg.norm(body.coarse.nodes - place, axis=1))) for place in TOP]
    contacts, forces = np.repeat(at, len(WAYS)), NEWTONS * np.tile(WAYS, (len(TOP), 1))
    if alike:
        contacts, forces = contacts[-2:], np.tile(NEWTONS * np.array(WAYS[0]), (2, 1))
    none = np.zeros((len(contacts), *body.coarse.nodes.shape))
    case = ModelCase(body, "hard", RADIUS_M, database_of(body, contacts, forces, none, none), None, FIT, 1e-8)
    elements = _elements(case, 2)
    fine = np.array([displacement_of(elements.respond(load)) for load in loads_of(contacts, forces)])
    return replace(case, database=replace(case.database, fine=fine)), elements
