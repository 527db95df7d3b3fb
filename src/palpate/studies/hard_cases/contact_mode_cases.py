"""Hard cases of reduced models of contacts: loads beyond what they are made of, slivers, and nearly no compression."""

import numpy as np

from palpate.benchmark.accuracy import errors
from palpate.benchmark.database import database_of
from palpate.benchmark.load import Load, displacement_of
from palpate.benchmark.model import Case
from palpate.bodies.body import Body, nest
from palpate.bodies.box import box
from palpate.bodies.material import Material
from palpate.bodies.mesh import TetMesh
from palpate.models import fem
from palpate.models.contact_modes import contact_modes
from palpate.studies.hard_cases.hard_case import Answer
from palpate.studies.hard_cases.hard_case import Case as HardCase
from palpate.studies.hard_cases.pressed_samples import SETTINGS

MODEL = "contact_modes"
SETTING = {"modes": "snapshots", "rings": 50, "thinned": 0.003, "target": "operator"}
RADIUS_M = 0.02
NEWTONS = 0.018
"""A press that moves the bar's end by a tenth of its length."""


def cases() -> list[HardCase]:
    """Return the declared cases of this family."""

    told = {MODEL: ("stable", "not_converged")}

    def case(name, scene, expected, body, direction, declared=None):
        words = (name, "fem", "palpate", scene, expected, "RMSE / peak against quadratic elements", 0.02)
        return HardCase.of(*words, run=lambda _: _pressed(body(), direction), models=[MODEL], declared=declared)

    return [
        case("press_twofold", "a bar's end is pressed twice as hard as it is made for", "the answer, or it is told",
             bar, [0.0, 0.0, -2.0], told),
        case("press_threefold", "the same three times as hard", "the answer, or it is told",
             bar, [0.0, 0.0, -3.0], told),
        case("press_sideways", "the same along the surface", "the answer, or it is told", bar, [0.0, 1.0, 0.0], told),
        case("press_outwards", "the same as a pull", "the answer, or it is told", bar, [0.0, 0.0, 1.0], told),
        case("press_on_slivers", "a layer of elements with dihedral angles of 0.1°", "the answer",
             lambda: bar(degrees=0.1), [0.0, 0.0, -1.0]),
        case("press_at_0.49", "ν = 0.49, where quadratic elements resist volume on average", "it is told",
             lambda: bar(poisson=0.49), [0.0, 0.0, -1.0], {MODEL: ("not_converged",)}),
    ]  # fmt: skip


def bar(poisson: float = 0.3, degrees: float = 0.0) -> Body:
    """Make a bar of 0.2 m, held at one end, of one level; if given, with a layer of elements of so small angles."""
    places = np.linspace(0.0, 0.2, 9)
    if degrees:
        places = np.insert(places, 4, 0.075 + 0.025 * np.tan(np.radians(degrees)))
    mesh = box([len(places) - 1.0, 0.05, 0.05], [len(places) - 1, 2, 2])
    nodes = mesh.nodes.copy()
    nodes[:, 0] = np.interp(nodes[:, 0], np.arange(len(places)), places)
    held = np.flatnonzero(nodes[:, 0] == 0.0)
    return nest("bar", TetMesh(nodes, mesh.tetrahedra), 0, held, Material(3000.0, poisson, 1000.0))


def _pressed(body: Body, direction: list[float]) -> Answer:
    """Press the bar and compare with quadratic elements."""
    load, case = pressing(body, direction), case_of(body)
    found = displacement_of(contact_modes.offline(case).online(SETTING).respond(load))
    expected = displacement_of(fem.Fem(case, {"level": 0, "start": "rest", "tolerance": 1e-8}, 2).respond(load))
    return Answer(found, np.zeros_like(found), lambda answer: errors(answer, expected).rmse_of_peak)


def pressing(body: Body, direction: list[float]) -> Load:
    """Return a press of the middle of the top near the free end, by a multiple of NEWTONS."""
    far = np.linalg.norm(body.coarse.nodes - [0.175, 0.025, 0.05], axis=1)
    return Load.at(int(np.argmin(far)), NEWTONS * np.array(direction))


def case_of(body: Body) -> Case:
    """Return what models of ``body`` see: no samples."""
    none = np.empty((0, len(body.coarse.nodes), 3))
    database = database_of(body, np.empty(0, dtype=int), np.empty((0, 3)), none, none)
    return Case(body, "hard", RADIUS_M, database, None, SETTINGS, 1e-8, {"contact_modes": {"nodes": 12000}})
