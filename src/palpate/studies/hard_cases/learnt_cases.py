"""Hard cases of models that reduce a body to modes of samples: larger loads, slivers, no compression, no variety."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from palpate.benchmark.accuracy import errors
from palpate.benchmark.database import database_of
from palpate.benchmark.load import Load, displacement_of, loads_of
from palpate.benchmark.model import Case
from palpate.models import fem, pod_galerkin, pod_of_loads
from palpate.studies.hard_cases.contact_mode_cases import NEWTONS, RADIUS_M, bar
from palpate.studies.hard_cases.hard_case import Answer
from palpate.studies.hard_cases.hard_case import Case as HardCase
from palpate.studies.hard_cases.pressed_samples import SETTINGS

MODELS = ("pod_galerkin", "pod_gaussian", "pod_network")
TOP = [[x, 0.025, 0.05] for x in (0.1, 0.125, 0.15, 0.175)]
"""Places of the samples; the last one is asked."""
WAYS = [[0.0, 0.0, -1.0], [0.5, 0.0, -0.8], [0.0, 0.5, -0.8], [-0.3, -0.3, -0.6], [0.0, 0.0, -0.5]]
"""Forces of the samples of each place, over NEWTONS; the first one is asked, times a factor."""
GRID = {"pod_galerkin": {"nodes": 12000}}


def cases() -> list[HardCase]:
    """Return the declared cases of this family."""
    told = {model: ("stable", "not_converged") for model in MODELS}

    def case(name, scene, times=1.0, models=MODELS, declared=None, **samples):
        words = (f"learnt_{name}", "fem", "palpate", scene, "the answer, or it is told" if declared else "the answer",
                 "RMSE / peak against quadratic elements", 0.03)  # fmt: skip
        return HardCase.of(*words, run=lambda model: _asked(model, times, **samples), models=models, declared=declared)

    return [
        case("as_sampled", "a bar's end is pressed as a sample has pressed it"),
        case("twofold", "the same twice as hard as any sample", 2.0, declared=told),
        case("threefold", "the same three times as hard", 3.0, declared=told),
        case("slivers", "a layer of elements with dihedral angles of 0.1°", degrees=0.1),
        case("at_0.49", "ν = 0.49, where quadratic elements resist volume on average", declared=told, poisson=0.49),
        case("one_answer", "all samples are the same press", models=MODELS[:1], alike=True),
    ]


def _asked(model: str, times: float, **samples: Any) -> Answer:
    """Ask for a press that is ``times`` as hard as a sample, and compare with quadratic elements."""
    case, elements = _learnable(**samples)
    load = Load.at(int(case.database.contact[-1]), times * NEWTONS * np.array(WAYS[0]))
    expected, found = displacement_of(elements.respond(load)), _answer(model, case, load)
    return Answer(found, np.zeros_like(found), lambda answer: errors(answer, expected).rmse_of_peak)


@cache
def _learnable(poisson: float = 0.3, degrees: float = 0.0, alike: bool = False) -> tuple[Case, fem.Fem]:
    """Return a bar with its samples, all of which are the same if ``alike``, and the elements that simulate them."""
    body = bar(poisson, degrees)
    at = [int(np.argmin(np.linalg.norm(body.coarse.nodes - place, axis=1))) for place in TOP]
    contacts, forces = np.repeat(at, len(WAYS)), NEWTONS * np.tile(WAYS, (len(TOP), 1))
    if alike:
        contacts, forces = contacts[-2:], np.tile(NEWTONS * np.array(WAYS[0]), (2, 1))
    none = np.zeros((len(contacts), *body.coarse.nodes.shape))
    case = Case(body, "hard", RADIUS_M, database_of(body, contacts, forces, none, none), None, SETTINGS, 1e-8, GRID)
    elements = fem.Fem(case, {"level": 0, "start": "rest", "tolerance": 1e-8}, 2)
    fine = np.array([displacement_of(elements.respond(load)) for load in loads_of(contacts, forces)])
    return replace(case, database=replace(case.database, fine=fine)), elements


def _answer(model: str, case: Case, load: Load) -> np.ndarray:
    if model == "pod_galerkin":
        return displacement_of(pod_galerkin.offline(case).online({"modes": 20, "thinned": 0.01}).respond(load))
    learner = model.removeprefix("pod_")
    setting = {"modes": 12} | ({"hidden": 8} if learner == "network" else {})
    return displacement_of(pod_of_loads.Learnt(case, setting, learner).respond(load))
