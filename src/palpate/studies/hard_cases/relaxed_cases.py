"""Hard cases of methods that relax a body step by step: large loads, a start inside out, thin elements, ν = 0.49."""

from collections.abc import Callable
from functools import partial

import numpy as np

from palpate.bodies.body import Body, nest
from palpate.bodies.box import box
from palpate.bodies.material import Material
from palpate.bodies.mesh import TetMesh
from palpate.bodies.particles import particles_of
from palpate.effects.elements import locking_is_measured
from palpate.effects.linear_elements import LinearElements
from palpate.models.relaxed import relaxes
from palpate.solvers.equilibrium import Equilibrium
from palpate.studies.hard_cases.hard_case import Answer, Case
from palpate.studies.hard_cases.stage import end_face

SETTINGS: dict[str, dict[str, float]] = {
    "xpbd": {"steps": 3000, "iterations": 1, "step": 0.3},
    "vertex_block_descent": {"sweeps": 1500, "radius": 0.9999},
    "projective_dynamics": {"iterations": 400, "memory": 5},
}
"""Long enough that what is left is what the method itself does."""
LOAD = 0.01
"""Traction on the end of the bar, over Young's modulus, that bends it by a tenth of its length."""
ERROR = "RMS distance from the equilibrium that Newton's method finds / RMS displacement"


def cases() -> list[Case]:
    """Return the declared cases of this family."""

    def case(name, scene, run, bound=0.03):
        words = (f"relaxed_{name}", "fem", "palpate", scene, "the equilibrium of finite elements", ERROR, bound)
        return Case.of(*words, run=run, models=SETTINGS)

    return [
        case("twice_the_load", "a bar is bent by a fifth of its length", partial(_bent, times=2.0)),
        case("three_times_the_load", "a bar is bent by three tenths of its length", partial(_bent, times=3.0)),
        case("from_inside_out", "a bent bar is released from where it is mirrored through its held end",
             partial(_bent, start=lambda rest: rest * [-1.0, 1.0, 1.0])),
        case("incompressible", "ν = 0.49: the pressure is far stiffer than the shear", partial(_bent, poisson=0.49)),
        case("slivers", "a layer of elements with dihedral angles of a degree", partial(_bent, thin=True)),
    ]  # fmt: skip


def _bent(
    method: str,
    times: float = 1.0,
    poisson: float = 0.3,
    start: Callable[[np.ndarray], np.ndarray] = lambda rest: rest,
    thin: bool = False,
) -> Answer:
    """Relax a bar under a load on its end, and compare it with the converged equilibrium."""
    body = _bar(poisson, thin)
    mesh, held = body.coarse, np.zeros(len(body.coarse.nodes), dtype=bool)
    held[body.anchors[0]] = True
    load = np.outer(end_face(mesh), [0.0, 0.0, times * LOAD * body.material.young_pa * 0.05**2])
    with locking_is_measured():
        moved = Equilibrium(body, 0).solve(load, 1e-10).x - mesh.nodes
    masses = particles_of(body, 0, surface=False).masses
    relax = relaxes(method, LinearElements(mesh, body.tissue(0)), masses, held, SETTINGS[method])
    begin = start(mesh.nodes)
    found = relax(begin, load)[0]
    return Answer(found, begin, lambda x: _distance(x - mesh.nodes, moved), zero=mesh.nodes, origin=mesh.nodes)


def _distance(found: np.ndarray, moved: np.ndarray) -> float:
    return float(np.linalg.norm(found - moved) / np.linalg.norm(moved))


def _bar(poisson: float, thin: bool) -> Body:
    mesh = box([0.2, 0.05, 0.05], [8, 2, 2])
    if thin:  # the second layer is as thin as the elements' angles are to be
        nodes = mesh.nodes.copy()
        between = nodes[:, 0] > 0.03
        nodes[between, 0] = np.maximum(0.025 * (1.0 + np.tan(np.radians(1.0))), nodes[between, 0] - 0.0246)
        mesh = TetMesh(nodes, mesh.tetrahedra)
    return nest("bar", mesh, 0, np.flatnonzero(mesh.nodes[:, 0] == 0.0), Material(3000.0, poisson, 1000.0))
