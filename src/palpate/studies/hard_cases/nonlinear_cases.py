"""Hard cases of laws, of starts (inverted, collapsed, random) and of relaxation by local solvers.

Springs have to find some equilibrium only: a mirror image is a rest state for them too, so they need not return.
"""

from dataclasses import replace
from functools import partial

import numpy as np

from palpate.bodies.body import Body, nest
from palpate.bodies.material import LAWS
from palpate.bodies.mesh import TetMesh
from palpate.bodies.particles import particles_of
from palpate.effects.elements import locking_is_measured
from palpate.effects.linear_elements import LinearElements
from palpate.models.relaxed import relaxes
from palpate.scenes.run_scene import initial_positions
from palpate.solvers.equilibrium import Equilibrium
from palpate.studies.hard_cases import fem_cases, stage
from palpate.studies.hard_cases.hard_case import Answer, Case
from palpate.studies.hard_cases.stage import EXPLICIT, FEM, RESIDUAL, SHAPES, SLOW, SOFT, SPRINGS


def laws() -> list[Case]:
    return [
        Case("each_law_crushed", "a bar under a press along its axis of half its Young's modulus, for each law",
             "equilibrium", RESIDUAL, 1e-6, partial(_residual, [-0.5, 0.0, 0.0]), LAWS),
        Case("each_law_inverting_force", "a sideways pull of twice Young's modulus, for each law",
             "equilibrium", RESIDUAL, 1e-6, partial(_residual, [0.0, 0.0, -2.0]), LAWS),
        Case("each_law_from_inside_out", "a bar is released at rest mirrored through its held end, for each law",
             "equilibrium", RESIDUAL, 1e-6, partial(_residual, [0.0, 0.0, -1e-3], mirrored=True), LAWS),
        Case("each_law_incompressible", "ν = 0.4999, quadratic elements, a bar bent by its end, for each law",
             "the deflection that scikit-fem computes", "relative error of the deflection", 0.05, _bent, LAWS,
             blunt=LAWS),
    ]  # fmt: skip


def _load(body: Body, moduli: list[float]) -> np.ndarray:
    """Return a traction on the end, given in Young's moduli, as nodal forces (n, 3) [N]."""
    return np.outer(stage.end_face(body.fine), np.array(moduli) * body.material.young_pa * 0.05**2)


def _residual(moduli: list[float], law: str, mirrored: bool = False) -> Answer:
    body = stage.bar_body(1, replace(SOFT, law=law))
    load, rest = _load(body, moduli), body.fine.nodes
    start = rest * [-1.0, 1.0, 1.0] if mirrored else None
    error = stage.residual(LinearElements(body.fine, body.tissue(1)), load, body.anchors[1])
    return Answer(Equilibrium(body, 1).solve(load, 1e-8, start).x, rest if start is None else start, error, zero=rest)


def _bent(law: str) -> Answer:
    """Compare the deflection of quadratic elements under a small load with that of another library."""
    body = stage.bar_body(1, replace(SOFT, poisson=fem_cases.POISSON, law=law))
    problem, load = Equilibrium(body, 0, 2), _load(body, [0.0, 0.0, -1e-4])
    way = load / np.abs(load).sum()
    expected = float(np.abs(load).sum()) * fem_cases.reference()
    found = problem.solve(load, 1e-6).x - problem.mesh.nodes
    return Answer(found, np.zeros_like(found), lambda moved: abs(float(np.vdot(way, moved)) / expected - 1.0))


SOURCES = {
    "inverted": "Irving, Teran, Fedkiw 2004",
    "plane": "Smith, de Goes, Kim 2018",
    "line": "Smith, de Goes, Kim 2018",
    "point": "Li et al. 2020 (IPC), one point",
    "random": "Li et al. 2020 (IPC), random",
}
BREATH = 1e-9
"""Perturbation, relative to the body's size, of starts that have to return to rest. Trap: a start of exactly zero width
stays so, in an unstable equilibrium of the corotational energy, which is smoothed there, so that no force arises."""
GAIN = 1e-9
"""Largest gain of energy, relative to that at the start, that rounding may cause."""
WEIGHT = {"gravity": {"acceleration_m_s2": [0.0, 0.0, -0.05]}}


def starts() -> list[Case]:
    return [
        *(
            Case(f"start_{kind}", f"a free body starts {kind} and drifts", "its rest shape, where the drift takes it",
                 "largest relative error of edges or of the centre's way after 20 s", 0.01, partial(_back, kind),
                 (*FEM, *SHAPES), source=source)
            for kind, source in SOURCES.items()
        ),
        *(
            Case(f"settles_from_{kind}", f"a held body starts exactly {kind}, under a weight",
                 "an equilibrium, without gain of energy",
                 "residual force / the weight; more than 1 if energy was gained", 0.2, partial(_settles, kind),
                 (*FEM, *SPRINGS, *(EXPLICIT if kind == "random" else ())),
                 # a spring of zero length has no direction
                 {"springs_implicit": ("stable", "not_converged")} if kind == "point" else {}, source=source)
            for kind, source in SOURCES.items()
        ),
    ]  # fmt: skip


def _back(kind: str, model: str) -> Answer:
    particles = stage.bar(held=False)
    x = initial_positions(particles, np.ones(len(particles.nodes), dtype=bool), kind, seed=1)
    x = x + BREATH * particles.size * np.random.default_rng(2).normal(size=x.shape)
    return stage.returns(model, particles, x)


def _settles(kind: str, model: str) -> Answer:
    """Simulate how a held body comes to rest, judged by the balance of forces."""
    particles = stage.bar()
    start = initial_positions(particles, ~np.isin(np.arange(len(particles.nodes)), particles.held), kind, seed=1)
    stepper = stage.Stepper(model, particles, {"held": None} | WEIGHT | (SLOW if model in EXPLICIT else {}))
    x, v, gained = start, np.zeros_like(start), 0.0
    first = stepper.total(x, v)
    # the last steps are so long that they damp the slowest mode to nothing
    for step_s, steps in [(5e-4, 10_000)] if model in EXPLICIT else [(0.05, 100), (1.0, 30)]:
        x, v = stepper.go(x, v, step_s, steps)
        gained = max(gained, stepper.gained / abs(first))

    def error(a: np.ndarray) -> float:
        return stage.unbalanced(stepper.system, a) if gained <= GAIN else 1.0 + gained

    return Answer(x, start, error, zero=particles.nodes)


SETTINGS: dict[str, dict[str, float]] = {
    "xpbd": {"steps": 3000, "iterations": 1, "step": 0.3},
    "vertex_block_descent": {"sweeps": 1500, "radius": 0.9999},
    "projective_dynamics": {"iterations": 400, "memory": 5},
}
"""Long enough that what is left is what the method itself does."""
LOAD = 0.01
"""Traction on the end of the bar, over Young's modulus, that bends it by a tenth of its length."""
ERROR = "RMS distance from the equilibrium that Newton's method finds / RMS displacement"


def relaxations() -> list[Case]:
    def case(name, scene, run):
        return Case(f"relaxed_{name}", scene, "the equilibrium of finite elements", ERROR, 0.03, run, SETTINGS)

    return [
        case("twice_the_load", "a bar is bent by a fifth of its length", partial(_relaxed, times=2.0)),
        case("three_times_the_load", "a bar is bent by three tenths of its length", partial(_relaxed, times=3.0)),
        case("from_inside_out", "a bent bar is released from where it is mirrored through its held end",
             partial(_relaxed, mirrored=True)),
        case("incompressible", "ν = 0.49: the pressure is far stiffer than the shear", partial(_relaxed, poisson=0.49)),
        case("slivers", "a layer of elements with dihedral angles of a degree", partial(_relaxed, thin=True)),
    ]  # fmt: skip


def _relaxed(
    method: str, times: float = 1.0, poisson: float = 0.3, mirrored: bool = False, thin: bool = False
) -> Answer:
    """Relax a bar under a load on its end, and compare it with the converged equilibrium."""
    mesh = stage.bar_mesh()
    if thin:  # the second layer is as thin as the elements' angles are to be
        nodes = mesh.nodes.copy()
        between = nodes[:, 0] > 0.03
        nodes[between, 0] = np.maximum(0.025 * (1.0 + np.tan(np.radians(1.0))), nodes[between, 0] - 0.0246)
        mesh = TetMesh(nodes, mesh.tetrahedra)
    held = mesh.nodes[:, 0] == 0.0
    body = nest("bar", mesh, 0, np.flatnonzero(held), replace(SOFT, poisson=poisson))
    load = np.outer(stage.end_face(mesh), [0.0, 0.0, times * LOAD * body.material.young_pa * 0.05**2])
    with locking_is_measured():
        moved = Equilibrium(body, 0).solve(load, 1e-10).x - mesh.nodes
    masses = particles_of(body, 0, surface=False).masses
    relax = relaxes(method, LinearElements(mesh, body.tissue(0)), masses, held, SETTINGS[method])
    begin = mesh.nodes * [-1.0, 1.0, 1.0] if mirrored else mesh.nodes
    found = relax(begin, load)[0]

    def error(x: np.ndarray) -> float:
        return float(np.linalg.norm(x - mesh.nodes - moved) / np.linalg.norm(moved))

    return Answer(found, begin, error, zero=mesh.nodes, origin=mesh.nodes)
