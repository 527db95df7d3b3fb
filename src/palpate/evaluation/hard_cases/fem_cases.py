"""Hard cases of elasticity: materials, meshes and loads at which finite elements and their rivals may fail."""

from functools import cache

import numpy as np

from palpate.bodies.body import Body, nest
from palpate.bodies.box import box
from palpate.bodies.material import Material
from palpate.bodies.mesh import TetMesh
from palpate.bodies.mesh_checks import check_boundary
from palpate.bodies.mesh_quality import dihedral_angles
from palpate.bodies.particles import Particles, solid_particles
from palpate.effects.effect import Effect
from palpate.effects.held import Held
from palpate.effects.linear_elements import LinearElements
from palpate.effects.springs import Springs
from palpate.evaluation.hard_cases import locking
from palpate.evaluation.hard_cases.hard_case import Case, finite
from palpate.evaluation.hard_cases.stage import FEM, MODELS, SHAPES, SOFT, SPRINGS, Stepper, bar, edge_error, end_face
from palpate.solvers import backward_euler
from palpate.solvers.equilibrium import Equilibrium
from palpate.solvers.system import System

STATIC = {"fem_static": 0, "fem_multigrid": 1}
"""The level of the mesh by model: one level, and two levels with multigrid."""
MOVING = (*FEM, *SPRINGS, *SHAPES)
RESIDUAL = "residual force at free nodes / the load"
MOMENTUM = "change of momentum in 20 steps / sum of the nodes' momenta at the start"


def cases() -> list[Case]:
    """Return the declared cases of this family."""

    def case(name, scene, expected, measure, bound, run, models, declared=None, source="palpate"):
        words = (name, "fem", source, scene, expected, measure, bound)
        return Case.of(*words, run=run, models=models, declared=declared)

    return [
        case("nearly_incompressible", "ν = 0.4999, a bar bent by a force at its end", "equilibrium", RESIDUAL, 1e-6,
             lambda model: _residual(_beam(STATIC[model], 0.4999), 0.01), STATIC),
        case("locking", "ν = 0.4999: deflection with linear tetrahedra against quadratic ones; on three levels, and "
             "with ν = 0.45 instead", "the deficit is smaller on finer meshes and smallest with 0.45",
             "relative deficit of the deflection", 0.5, locking.missing, locking.CASES),
        case("stiffness_contrast", "one half of a bar is a million times as stiff as the other, and the bar is pulled",
             "the elongation of theory", "relative error of the elongation", 1e-6, _contrast, (*FEM, *SPRINGS)),
        case("slivers", "a layer of elements with dihedral angles of 0.1°", "the deflection without that layer",
             "relative difference of the two deflections", 0.05, _slivers, STATIC),
        case("half_turn", "a free body rotated by 180°", "it stays rotated, without force",
             "largest relative edge error after 20 steps", 1e-10, _half_turn, MOVING),
        case("thousandfold_inverting_force", "1000 times the force at which the first element inverts",
             "equilibrium, or no convergence is reported", RESIDUAL, 1e-6, _monstrous, STATIC,
             dict.fromkeys(STATIC, ("stable", "not_converged"))),
        case("unanchored_static", "an equilibrium of a body without held nodes", "refused: none exists", RESIDUAL,
             0.0, lambda model: _residual(_beam(STATIC[model], 0.3, held=False), 0.01), STATIC,
             dict.fromkeys(STATIC, ("refused",))),
        case("unanchored_thrown", "a free body moves, with random velocities added", "momentum is conserved",
             MOMENTUM, 1e-7, lambda model: _thrown(model, bar(held=False)), (*FEM, *SPRINGS)),
        case("single_tetrahedron", "one element is released at three times its size", "its rest shape",
             "largest relative edge error after 20 s", 1e-3, _single, MOVING),
        case("joined_by_one_node_as_mesh", "a mesh of two boxes that share one node", "refused: a hinge",
             "elements accepted", 0.0, _hinge_checked, ("mesh_check",), {"mesh_check": ("refused",)}),
        case("joined_by_one_node_thrown", "two boxes that share one node move", "momentum is conserved", MOMENTUM,
             1e-7, lambda model: _thrown(model, solid_particles(_hinge(), np.array([], dtype=int), SOFT, "hinge")),
             (*FEM, *SPRINGS)),
        case("stretch_at_0.488", "ν = 0.488, a cube stretched to three times its length by its ends",
             "equilibrium of forces", "residual force at free nodes / the force on an end", 1e-6, _stretched, FEM,
             source="Smith, de Goes, Kim 2018"),
    ]  # fmt: skip


def _beam(level: int, poisson: float, held: bool = True) -> Body:
    mesh = box([0.2, 0.05, 0.05], [8, 2, 2])
    ends = np.flatnonzero(mesh.nodes[:, 0] == 0.0) if held else np.array([], dtype=np.int64)
    return nest("bar", mesh, level, ends, Material(3000.0, poisson, 1000.0))


def _residual(body: Body, newtons: float) -> float:
    """Compute the relative residual of the equilibrium under a load at the end, independently of the solver."""
    return _left(body, *_solved(body, newtons))


def _solved(body: Body, newtons: float) -> tuple[np.ndarray, np.ndarray]:
    load = np.outer(end_face(body.fine), [0.0, 0.0, -newtons])
    return Equilibrium(body, len(body.levels) - 1).solve(load, 1e-8).x, load


def _left(body: Body, x: np.ndarray, load: np.ndarray) -> float:
    finite(x)
    force = LinearElements(body.fine, body.material).force(x) + load
    force[body.anchors[-1]] = 0.0
    return float(np.linalg.norm(force) / np.linalg.norm(load))


def _contrast(model: str) -> float:
    """Compare the elongation of a bar of ν = 0, or of a chain of springs, with theory: x = F L (1/k + 1/K)."""
    if model in SPRINGS:
        ends, stiff = np.column_stack([np.arange(10), np.arange(1, 11)]), np.repeat([1e6, 1.0], 5)
        nodes, force, expected = np.outer(np.arange(11.0), [1.0, 0.0, 0.0]), np.eye(11)[10], 5.0 * (1.0 + 1e-6)
        none = np.empty((0, 3), dtype=int), np.empty((0, 4), dtype=int)
        particles = Particles("chain", nodes, np.ones(11), np.array([0]), *none, SOFT)
        elastic: dict[str, Effect] = {"springs": Springs(ends, stiff, np.ones(10))}
    else:
        particles = bar(material=Material(3000.0, 0.0, 1000.0))
        mesh = TetMesh(particles.nodes, particles.tetrahedra)
        hard = particles.nodes[mesh.tetrahedra].mean(axis=1)[:, 0] < 0.1
        elastic = {
            name: LinearElements(TetMesh(mesh.nodes, mesh.tetrahedra[which]), Material(young, 0.0, 1000.0))
            for name, which, young in (("soft", ~hard, 3000.0), ("hard", hard, 3e9))
        }
        force, expected = end_face(mesh), 0.1 / (3000.0 * 0.05**2) * (1.0 + 1e-6)
    system = System(particles, elastic | {"held": Held(particles.held), "pull": _Pull(force)})
    integrator, x = backward_euler.BackwardEuler(system, 1e-10), particles.nodes
    for _ in range(4):  # steps so long that inertia is negligible
        x, _ = integrator.step(x, np.zeros_like(x), 1e4)
    finite(x)
    moved = float(force @ (x - particles.nodes)[:, 0])
    return abs(moved / expected - 1.0)


class _Pull:
    """A force of 1 N along x, distributed over nodes."""

    outer = True

    def __init__(self, shares: np.ndarray):
        self._force = np.outer(shares, [1.0, 0.0, 0.0])

    def add_force(self, x: np.ndarray, v: np.ndarray, force: np.ndarray) -> None:
        force += self._force


def _slivers(model: str) -> float:
    """Compare the deflections of a bar with one very thin layer of elements and of a bar without that layer."""
    thin, ways = 0.025 * np.tan(np.radians(0.1)), []
    for places in (np.linspace(0.0, 0.2, 9), np.insert(np.linspace(0.0, 0.2, 9), 4, 0.075 + thin)):
        mesh = box([len(places) - 1.0, 0.05, 0.05], [len(places) - 1, 2, 2])
        nodes = mesh.nodes.copy()
        nodes[:, 0] = np.interp(nodes[:, 0], np.arange(len(places)), places)
        mesh = TetMesh(nodes, mesh.tetrahedra)
        body = nest("bar", mesh, STATIC[model], np.flatnonzero(nodes[:, 0] == 0.0), SOFT)
        x, load = _solved(body, 0.01)
        ways.append(float(np.vdot(load, x - body.fine.nodes)))
    if not dihedral_angles(mesh).min() < 0.11:
        raise AssertionError("the slivers are not as thin as this case requires")
    return abs(ways[1] / ways[0] - 1.0)


def _half_turn(model: str) -> float:
    particles = bar(held=False)
    x = particles.nodes * [-1.0, -1.0, 1.0]
    return edge_error(particles, Stepper(model, particles).go(x, np.zeros_like(x), 0.01, 20)[0])


@cache
def _inverting(level: int) -> float:
    """Find the force [N] on the end, within a factor of two, that inverts the first element."""
    body, newtons = _beam(level, 0.3), 0.01
    while TetMesh(_solved(body, newtons)[0], body.fine.tetrahedra).volumes.min() > 0.0:
        newtons *= 2.0
    return newtons


def _monstrous(model: str) -> float:
    level = STATIC[model]
    return _residual(_beam(level, 0.3), 1000.0 * _inverting(level))


def _thrown(model: str, particles: Particles) -> float:
    random = np.random.default_rng(3).normal(size=particles.nodes.shape)
    v = [1.0, 2.0, 3.0] + np.cross([0.0, 0.0, 20.0], particles.nodes) + 0.3 * random
    masses = particles.masses[:, None]
    after = Stepper(model, particles, tolerance=1e-10).go(particles.nodes, v, 0.01, 20)[1]
    return float(np.linalg.norm((masses * (after - v)).sum(axis=0)) / np.linalg.norm(masses * v, axis=1).sum())


def _single(model: str) -> float:
    mesh = TetMesh(0.1 * np.vstack([np.zeros(3), np.eye(3)]), np.array([[0, 1, 2, 3]]))
    particles = solid_particles(mesh, np.array([], dtype=int), SOFT, "tetrahedron")
    one = (
        {"shape_matching": MODELS[model][1]["shape_matching"] | {"clusters": {"kind": "one"}}}
        if model in SHAPES
        else {}
    )
    step_s, steps = (0.01, 2000) if model in SHAPES else (0.05, 400)
    x, _ = Stepper(model, particles, one).go(3.0 * mesh.nodes, 0.0 * mesh.nodes, step_s, steps)
    return edge_error(particles, x)


def _hinge() -> TetMesh:
    one = box([0.05, 0.05, 0.05], [2, 2, 2])
    corner = len(one.nodes) - 1  # the last node of one box is the first of the other
    nodes = np.vstack([one.nodes, one.nodes[1:] + one.nodes[corner]])
    number = np.concatenate([[corner], np.arange(corner + 1, len(nodes))])
    return TetMesh(nodes, np.vstack([one.tetrahedra, number[one.tetrahedra]]))


def _hinge_checked(model: str) -> float:
    mesh = _hinge()
    check_boundary("hinge.msh", mesh)
    return float(len(mesh.tetrahedra))


def _stretched(model: str) -> float:
    """Hold both ends apart and let the nodes between them reach equilibrium; return the relative residual."""
    mesh = box([0.1, 0.1, 0.1], [3, 3, 3])
    ends = np.flatnonzero(np.isin(mesh.nodes[:, 0], mesh.nodes[[0, -1], 0]))
    particles = solid_particles(mesh, ends, Material(3000.0, 0.488, 1000.0), "cube")
    x = mesh.nodes * [3.0, 1.0, 1.0]
    x, _ = Stepper(model, particles, {"held": None}).go(x, np.zeros_like(x), 0.05, 200)
    finite(x)
    force = LinearElements(mesh, particles.material).force(x)
    on_end = np.linalg.norm(force[mesh.nodes[:, 0] == 0.0].sum(axis=0))
    return float(np.linalg.norm(np.delete(force, ends, axis=0)) / on_end)
