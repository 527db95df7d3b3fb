"""Hard cases of reduced motion: loads beyond those it is meant for, starts and elements that are ill-shaped."""

from functools import partial
from typing import Any

import numpy as np

from palpate.bodies.box import box
from palpate.bodies.material import Material
from palpate.bodies.mesh import TetMesh
from palpate.bodies.particles import Particles, solid_particles
from palpate.studies.hard_cases.hard_case import Answer, Case
from palpate.studies.hard_cases.stage import REDUCED, SECOND, SOFT, bar, play

MODELS = tuple(REDUCED)
NEWTONS = 0.01
"""A push on the tip that moves it by a tenth of the bar's length."""
MEASURE = "RMSE over frames and nodes / the largest displacement"
STEP_S, DURATION_S, FRAMES = 0.01, 0.5, 25


def cases() -> list[Case]:
    """Return the declared cases of motion in modes."""

    def case(name: str, scene: str, run: Any, expected: str = "the motion of the mesh", **rest: Any) -> Case:
        words = (name, "dynamics", "palpate", scene, expected, MEASURE, 0.02)
        return Case.of(*words, run=run, models=MODELS, **rest)

    found = [
        case(f"modes_load_times_{k}", f"a bar is pushed by {k} times what moves its tip by a tenth of its length, "
             "and let go", partial(_pushed, bar(), k))
        for k in (2, 3)
    ]  # fmt: skip
    flattened = dict.fromkeys(MODELS, ("not_converged",))
    refused = dict.fromkeys(MODELS, ("refused",))
    return [
        *found,
        case("modes_load_times_100", "the same by 100 times that, which flattens elements",
             partial(_pushed, bar(), 100), "that modes cannot tell is reported", declared=flattened),
        case("modes_inverted_start", "a bar that moves in modes starts inverted", _inverted, "refused",
             declared=refused),
        case("modes_slivers", "a bar with a layer of elements of 0.1° is pushed and let go",
             partial(_pushed, _thin(), 1)),
        case("modes_incompressible", "a bar of Poisson's ratio 0.49 is pushed and let go; both lock alike",
             partial(_pushed, bar(material=Material(3000.0, 0.49, 1000.0)), 1)),
    ]  # fmt: skip


def _more(times: float) -> dict[str, Any]:
    load = {"at_m": [0.2, 0.025, 0.05], "force_n": [0.0, 0.2 * times * NEWTONS, -times * NEWTONS], "radius_m": 0.02}
    load |= {"start_s": 0.0, "press_s": 0.15, "hold_s": 0.1, "release_s": 0.05}
    return {"held": None, "push": {"loads": [load]}}


def _pushed(particles: Particles, times: float, model: str) -> Answer:
    """Compare all frames with those of the mesh, at a fifth of the step."""
    found, expected = (
        play(name, particles, step_s, DURATION_S, _more(times), frames=FRAMES).positions[1:]
        for name, step_s in ((model, STEP_S), (next(iter(SECOND)), STEP_S / 5.0))
    )
    peak = float(np.linalg.norm(expected - particles.nodes, axis=2).max())

    def error(a: np.ndarray) -> float:
        return float(np.sqrt(np.mean(np.sum((a - expected) ** 2, axis=2)))) / peak

    return Answer(found, np.broadcast_to(particles.nodes, found.shape), error)


def _inverted(model: str) -> Answer:
    particles = bar()
    found = play(model, particles, STEP_S, DURATION_S, _more(1.0), start="inverted").positions
    return Answer(found, found, lambda a: 0.0)


def _thin() -> Particles:
    places = np.insert(np.linspace(0.0, 0.2, 9), 4, 0.075 + 0.025 * np.tan(np.radians(0.1)))
    mesh = box([len(places) - 1.0, 0.05, 0.05], [len(places) - 1, 2, 2])
    nodes = mesh.nodes.copy()
    nodes[:, 0] = np.interp(nodes[:, 0], np.arange(len(places)), places)
    mesh = TetMesh(nodes, mesh.tetrahedra)
    return solid_particles(mesh, np.flatnonzero(nodes[:, 0] == 0.0), SOFT, "bar")
