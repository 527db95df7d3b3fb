"""Hard cases of the bounds that come with the answers of a cascade of models."""

from dataclasses import replace
from functools import cache, partial

import numpy as np

from palpate.benchmark.database import database_of
from palpate.benchmark.load import Answer as Told
from palpate.benchmark.load import loads_of
from palpate.benchmark.model import Case as ModelCase
from palpate.bodies.body import nest
from palpate.bodies.contacts import contacts_of
from palpate.bodies.mesh import TetMesh
from palpate.bodies.simple_shapes import box
from palpate.effects.elements import locking_is_measured
from palpate.models import cascade
from palpate.models.fem_statics import Simulation, to_surface
from palpate.solvers.compliance import compute_compliance
from palpate.studies.hard_cases.enrichment_cases import SETTINGS
from palpate.studies.hard_cases.hard_case import Answer, Case, finite
from palpate.studies.hard_cases.stage import SOFT

CONTACTS, RADIUS_M, DEPTH = 14, 0.03, 0.04
"""Contacts, a third of which is asked for and not learnt from, radius of the disc, and largest linear peak / size."""
_AXIS = np.array([0.6, 0.48, 0.64])
"""About it forces are turned by 90 degrees; it is along no normal."""
GRID = {
    "cascade": {
        "asked_errors": [0.05],
        "budgets_ms": [],
        "stages": [
            {"model": "linear_fem"},
            {"model": "warped_compliance", "setting": {"samples": 0}},
            {"model": "detail_correction", "setting": {"coarse": "converged", "samples": 0}},
        ],
    }
}


def cases() -> list[Case]:
    def case(name: str, scene: str, times: float = 1.0, along: bool = False, **body: float) -> Case:
        expected = "errors below the bounds that come with the answers"
        measure = "largest error against fine quadratic elements / its bound"
        run, models = partial(_asked, times, along, body), ("cascade",)
        return Case(f"bound_{name}", scene, expected, measure, 1.0, run, models, blunt=models)

    return [
        case("twice_the_load", "presses twice as hard as what bounds were found on", 2.0),
        case("three_times_the_load", "presses three times as hard as what bounds were found on", 3.0),
        case("pulled", "pulls, where bounds were found on presses", -1.0),
        case("tangential", "forces along the surface, where bounds were found on presses", 1.0, True),
        case("slivers", "a layer of elements with dihedral angles of a degree, of what bounds are found on, too",
             degrees=1.0),
        case("incompressible", "ν = 0.49, where linear elements lock; of what bounds are found on, too", poisson=0.49),
    ]  # fmt: skip


@cache
@locking_is_measured()
def _case(poisson: float = 0.3, degrees: float = 0.0) -> tuple[ModelCase, ModelCase]:
    """Press a bar, held at one end, at CONTACTS contacts: what is learnt from, and what is asked for."""
    mesh = box([0.2, 0.05, 0.05], [4, 2, 2])
    if degrees:  # the second layer is as thin as the elements' angles are to be
        places = np.array([0.0, 0.05, 0.05 + 0.025 * np.tan(np.radians(degrees)), 0.12, 0.2])
        nodes = np.column_stack([np.interp(mesh.nodes[:, 0], np.linspace(0.0, 0.2, 5), places), mesh.nodes[:, 1:]])
        mesh = TetMesh(nodes, mesh.tetrahedra)
    body = nest("bar", mesh, 1, np.flatnonzero(mesh.nodes[:, 0] == 0.0), replace(SOFT, poisson=poisson))
    able = np.array([contact for contact in contacts_of(body) if mesh.nodes[contact, 0] > 0.06])
    chosen = np.sort(np.random.default_rng(1).choice(able, CONTACTS, replace=False))
    stored = compute_compliance(body, RADIUS_M, contacts=chosen, order=2)
    unit = -body.fine.normals[stored.contacts]
    peaks = np.linalg.norm(np.einsum("ci,cink->cnk", unit, stored.fine), axis=2).max(axis=1)
    force = DEPTH * body.fine.size / peaks.max() * unit
    case = ModelCase.untrained(body, "pressed", RADIUS_M, SETTINGS.seed, 1e-8, GRID)
    case = replace(case, response=stored, options=SETTINGS)
    loads = loads_of(stored.contacts, force)
    simulations = Simulation(case, 0, 1e-8), Simulation(case, 1, 1e-8, order=2)
    coarse, fine = (np.array([s.displacement(load) for load in loads]) for s in simulations)
    db = database_of(body, stored.contacts, force, coarse, fine)
    asked = np.arange(CONTACTS) % 3 == 0
    learnt, held = (replace(case, database=db.take(np.flatnonzero(side))) for side in (~asked, asked))
    return learnt, held


@locking_is_measured()
def _asked(times: float, along: bool, body: dict[str, float], model: str) -> Answer:
    """Find what ``times`` the forces do at contacts not learnt from, judged by the bounds of these answers.

    along : whether the forces are turned about _AXIS, away from the normal
    """
    learnt, held = _case(**body)
    solver, fine = cascade.offline(learnt).online({"asked": 0.05}), Simulation(learnt, 1, 1e-8, order=2)
    up, db = to_surface(learnt.body, 1, 2), held.database
    forces = times * (np.cross(db.force, _AXIS) if along else db.force)
    loads = loads_of(db.contact, forces)
    told: list[Told] = [solver.respond(load) for load in loads]
    found, bounds = np.array([each.displacement for each in told]), np.array([each.error for each in told], float)
    finite(found, bounds)
    truth = np.array([up @ fine.displacement(load) for load in loads])
    peaks = np.linalg.norm(truth, axis=2).max(axis=1)

    def error(answer: np.ndarray) -> float:
        wrong = np.sqrt(np.mean(np.sum((answer - truth) ** 2, axis=2), axis=1)) / peaks
        return float((wrong / bounds).max())

    return Answer(found, np.zeros_like(found), error)
