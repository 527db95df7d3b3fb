"""Hard cases of elasticity: materials, meshes and loads at which elements and their rivals may fail, and locking."""

from dataclasses import replace
from functools import cache, partial
from typing import Any

import numpy as np

from palpate.bodies.body import Body
from palpate.bodies.material import Material
from palpate.bodies.mesh import TetMesh
from palpate.bodies.mesh_quality import check_boundary, dihedral_angles
from palpate.bodies.particles import Particles, solid_particles
from palpate.bodies.simple_shapes import box
from palpate.effects.effect import Effect
from palpate.effects.elements import PLAIN_POISSON, Elements
from palpate.effects.held import Held
from palpate.effects.linear_elements import LinearElements
from palpate.effects.patch_load import nodal_load
from palpate.effects.quadratic_elements import MeanDilatation, QuadraticElements
from palpate.effects.springs import Springs
from palpate.solvers import backward_euler
from palpate.solvers.equilibrium import Equilibrium, FastEquilibrium
from palpate.solvers.system import System
from palpate.studies.hard_cases import stage
from palpate.studies.hard_cases.stage import FEM, RESIDUAL, SHAPES, SOFT, SPRINGS, Answer, Case, refuses

POISSON, INSTEAD = 0.4999, 0.45
CASES = {
    "level_0": (0, POISSON, 1),
    "level_1": (1, POISSON, 1),
    "level_2": (2, POISSON, 1),
    "level_2_softer": (2, INSTEAD, 1),
    "quadratic_level_0": (0, POISSON, 2),
    "quadratic_level_1": (1, POISSON, 2),
}
"""Level of the mesh, Poisson's ratio and order of the elements of each computation."""
LOCKED = ("level_0", "level_1", "level_2", "level_2_softer")
"""Computations of CASES that are known to lock, the last one less."""


def deflection(model: str) -> Answer:
    """Compute how one of CASES deflects a bar under 1 N at its end, to be compared with ``reference_deflection``."""
    level, poisson, order = CASES[model]
    body = stage.bar_body(level + order - 1, replace(SOFT, poisson=poisson))
    weights = stage.end_face(body.fine)
    moved = Equilibrium(body, level, order).linear_solver(1e-8)(np.outer(weights, [0.0, 0.0, 1.0]))
    expected = reference_deflection()
    return Answer(moved, np.zeros_like(moved), lambda a: abs(1.0 - float(weights @ a[:, 2]) / expected))


@cache
def reference_deflection() -> float:
    """Compute the mean deflection [m] of the bar's loaded face under 1 N by ``taylor_hood``."""
    import skfem

    tissue = replace(SOFT, poisson=POISSON)
    bar = stage.bar_body(1, tissue).fine
    mesh = skfem.MeshTet(np.ascontiguousarray(bar.nodes.T), np.ascontiguousarray(bar.tetrahedra.T))
    ones = np.ones(len(bar.tetrahedra))
    basis, matrix = taylor_hood(mesh, tissue.shear_pa * ones, tissue.lame_pa * ones)
    face = skfem.FacetBasis(mesh, basis.elem, facets=mesh.facets_satisfying(lambda x: np.isclose(x[0], 0.2)))
    load = skfem.LinearForm(lambda v, w: v[2] / (0.05 * 0.05)).assemble(face)
    load = np.concatenate([load, np.zeros(matrix.shape[0] - basis.N)])
    held = basis.get_dofs(lambda x: np.isclose(x[0], 0.0)).all()
    return float(load @ skfem.solve(*skfem.condense(matrix, load, D=held)))


def taylor_hood(mesh: Any, shear_pa: np.ndarray, lame_pa: np.ndarray) -> tuple[Any, Any]:
    """Assemble linear elasticity with scikit-fem in elements with the pressure as an unknown, which do not lock.

    The displacement is quadratic and the pressure linear in each element (Taylor and Hood 1973).
    mesh : a skfem.MeshTet; shear_pa, lame_pa : Lamé parameters (n_elements,) [Pa]
    Returns the basis of the displacement, and the matrix of all unknowns, first those of the displacement.
    """
    import skfem
    from skfem.helpers import ddot, div, sym_grad

    basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementTetP2()))
    pressure = basis.with_element(skfem.ElementTetP1())
    shear, lame = (np.outer(each, np.ones(basis.X.shape[1])) for each in (shear_pa, lame_pa))
    strains = skfem.BilinearForm(lambda u, v, w: 2.0 * w.shear * ddot(sym_grad(u), sym_grad(v)))
    coupling = skfem.BilinearForm(lambda u, q, w: -div(u) * q).assemble(basis, pressure)
    bulk = skfem.BilinearForm(lambda p, q, w: -p * q / w.lame).assemble(pressure, lame=lame)
    return basis, skfem.bmat([[strains.assemble(basis, shear=shear), coupling.T], [coupling, bulk]], "csc")


SOLVERS: dict[str, type[Equilibrium]] = {"fem_quadratic": Equilibrium, "fem_fast": FastEquilibrium}
STATIC = {"fem_static": (0, 1), "fem_multigrid": (1, 1), "fem_quadratic": (0, 2), "fem_fast": (0, 2)}
"""Level of the mesh and order of the elements of each static model: linear elements on one level, on two with
multigrid, quadratic elements by Newton's method, and by L-BFGS."""
MOVING = (*FEM, *SPRINGS, *SHAPES)
LINEAR_ELEMENTS = ("fem_static", "fem_multigrid")
MOMENTUM = "change of momentum, or of the centre's motion, in 20 steps / sum of the nodes' momenta at the start"


def elasticity() -> list[Case]:
    return [
        Case("nearly_incompressible", "ν = 0.4999, a bar bent by a force at its end", "equilibrium", RESIDUAL, 1e-6,
             lambda model: _pressed(model, 0.4999, 0.01), STATIC),
        Case("locking", "ν = 0.4999: linear tetrahedra on three levels, with ν = 0.45 instead, and quadratic ones",
             "the deflection that scikit-fem computes; plain linear tetrahedra are known to miss it",
             "relative error of the deflection", 0.05, deflection, CASES,
             dict.fromkeys(LOCKED, ("wrong",)), bounds={"quadratic_level_1": 0.03}, blunt=("quadratic_level_0",)),
        Case("stiffness_contrast", "one half of a bar is a million times as stiff as the other, and the bar is pulled",
             "the elongation of theory", "relative error of the elongation", 1e-6, _contrast, (*FEM, *SPRINGS)),
        Case("slivers", "a layer of elements with dihedral angles of 0.1°", "the deflection without that layer",
             "relative difference of the two deflections", 0.05, _slivers, STATIC,
             bounds={"fem_multigrid": 0.03, "fem_quadratic": 0.001, "fem_fast": 0.001}, blunt=("fem_static",)),
        Case("half_turn", "a free body starts rotated by 180° and is thrown", "it flies on, rotated, without force",
             "largest distance from there after 20 steps / the way", 1e-8, _half_turn, MOVING),
        Case("thousandfold_inverting_force", "1000 times the force at which the first element inverts",
             "equilibrium, or no convergence is reported", RESIDUAL, 1e-6,
             lambda model: _pressed(model, 0.3, 1000.0 * _inverting(model)), LINEAR_ELEMENTS,
             ("stable", "not_converged")),
        Case("unanchored_static", "an equilibrium of a body without held nodes", "refused: none exists", RESIDUAL,
             0.0, refuses(lambda: _pressed("fem_static", 0.3, 0.01, held=False)), ("shared_check",), ("refused",)),
        Case("unanchored_thrown", "a free body moves, with random velocities added", "momentum is conserved",
             MOMENTUM, 1e-7, lambda model: _thrown(model, stage.bar_particles(held=False)), (*FEM, *SPRINGS)),
        Case("single_tetrahedron", "one element is released at three times its size, and drifts", "its rest shape",
             "largest relative error of edges or of the centre's way after 20 s", 1e-3, _single, MOVING),
        Case("joined_by_one_node_as_mesh", "a mesh of two boxes that share one node", "refused: a hinge",
             "none", 0.0, refuses(lambda: check_boundary("hinge.msh", _hinge())), ("mesh_check",), ("refused",)),
        Case("joined_by_one_node_thrown", "two boxes that share one node move", "momentum is conserved", MOMENTUM,
             1e-7, lambda model: _thrown(model, solid_particles(_hinge(), np.array([], dtype=int), SOFT, "hinge")),
             (*FEM, *SPRINGS)),
        Case("stretch_at_0.488", "ν = 0.488, a cube stretched to three times its length by its ends",
             "equilibrium of forces", "residual force at free nodes / the force on an end", 1e-6, _stretched, FEM,
             source="Smith, de Goes, Kim 2018"),
    ]  # fmt: skip


def _pressed(model: str, poisson: float, newtons: float, held: bool = True) -> Answer:
    """Load a bar at its end by a force down [N], and judge one of STATIC by the residual force."""
    body = stage.bar_body(sum(STATIC[model]) - 1, replace(SOFT, poisson=poisson), held=held)
    x, load = _solved(body, model, newtons)
    if STATIC[model][1] == 1:
        elements: Elements = LinearElements(body.fine, body.material)
    else:
        elements = (MeanDilatation if poisson > PLAIN_POISSON else QuadraticElements)(body.coarse, body.tissue(0))
    return Answer(x, body.fine.nodes, stage.residual_error(elements, load, body.anchors[-1]))


def _solved(body: Body, model: str, newtons: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the equilibrium positions (n, 3) [m] under a force down on the end, and its nodal forces (n, 3) [N]."""
    load = np.outer(stage.end_face(body.fine), [0.0, 0.0, -newtons])
    return SOLVERS.get(model, Equilibrium)(body, *STATIC[model]).solve(load, 1e-8).x, load


def _contrast(model: str) -> Answer:
    """Compare the elongation of a bar of ν = 0, or of springs, with F (1/k + 1/K), of halves of stiffness k and K."""
    if model in SPRINGS:
        spring_ends, stiffnesses = np.column_stack([np.arange(10), np.arange(1, 11)]), np.repeat([1e6, 1.0], 5)
        particles = stage.point_masses("chain", np.outer(np.arange(11.0), [1.0, 0.0, 0.0]), [0])
        force, expected = np.eye(11)[10], 5.0 * (1.0 + 1e-6)
        elastic: dict[str, Effect] = {"springs": Springs(spring_ends, stiffnesses, np.ones(10))}
    else:
        particles = stage.bar_particles(material=Material(3000.0, 0.0, 1000.0))
        mesh = TetMesh(particles.nodes, particles.tetrahedra)
        hard = particles.nodes[mesh.tetrahedra].mean(axis=1)[:, 0] < 0.1
        elastic = {
            name: LinearElements(TetMesh(mesh.nodes, mesh.tetrahedra[chosen]), Material(young, 0.0, 1000.0))
            for name, chosen, young in (("soft", ~hard, 3000.0), ("hard", hard, 3e9))
        }
        force, expected = stage.end_face(mesh), 0.1 / (3000.0 * 0.05**2) * (1.0 + 1e-6)
    system = System(particles, elastic | {"held": Held(particles.held), "load": stage.NodalForce(force)})
    integrator, x = backward_euler.BackwardEuler(system, 1e-10), particles.nodes
    for _ in range(4):  # steps so long that inertia is negligible
        x, _ = integrator.step(x, np.zeros_like(x), 1e4)
    rest = particles.nodes
    return Answer(x, rest, lambda a: abs(float(force @ (a - rest)[:, 0]) / expected - 1.0))


def _slivers(model: str) -> Answer:
    """Compare the load's work on a bar with one very thin layer of elements with ``expected``, that without it."""
    work_of_load = 0.0
    for degrees in (0.0, 0.1):
        body = stage.bar_body(sum(STATIC[model]) - 1, SOFT, degrees)
        x, load = _solved(body, model, 0.01)
        rest, expected, work_of_load = body.fine.nodes, work_of_load, float(np.vdot(load, x - body.fine.nodes))
    if not dihedral_angles(stage.bar_mesh(0.1)).min() < 0.11:
        raise AssertionError("the slivers are not as thin as this case requires")
    return Answer(x, rest, lambda a: abs(float(np.vdot(load, a - rest)) / expected - 1.0))


def _half_turn(model: str) -> Answer:
    """Throw a free body that starts rotated by 180°: it has to fly on without deformation."""
    particles, velocity = stage.bar_particles(held=False), np.array([0.0, 0.3, 0.4])
    x = particles.nodes * [-1.0, -1.0, 1.0]
    end, _ = stage.Stepper(model, particles).advance(x, np.tile(velocity, (len(x), 1)), 0.01, 20)
    shift = velocity * stage.coasting_distance(model, 0.01, 20)
    scale = np.linalg.norm(shift)
    return Answer(end, x, lambda a: float(np.linalg.norm(a - x - shift, axis=1).max() / scale), zero=particles.nodes)


@cache
def _inverting(model: str) -> float:
    """Find, by doubling, a force [N] on the bar's end that inverts an element and is at most twice the least one."""
    body, newtons = stage.bar_body(sum(STATIC[model]) - 1), 0.01
    while TetMesh(_solved(body, model, newtons)[0], body.fine.tetrahedra).volumes.min() > 0.0:
        newtons *= 2.0
    return newtons


def _thrown(model: str, particles: Particles) -> Answer:
    """Throw a free body that turns, with random velocities added."""
    random = np.random.default_rng(3).normal(size=particles.nodes.shape)
    v = [1.0, 2.0, 3.0] + np.cross([0.0, 0.0, 20.0], particles.nodes) + 0.3 * random
    return stage.free_flight(model, particles, v, 1e-10)


def _single(model: str) -> Answer:
    """Release a single tetrahedron from three times its size."""
    mesh = TetMesh(0.1 * np.vstack([np.zeros(3), np.eye(3)]), np.array([[0, 1, 2, 3]]))
    particles = solid_particles(mesh, np.array([], dtype=int), SOFT, "tetrahedron")
    return stage.recovery(model, particles, 3.0 * mesh.nodes, stage.one_cluster(model) if model in SHAPES else {})


def _hinge() -> TetMesh:
    """Make the mesh of two boxes that share one node."""
    cube = box([0.05, 0.05, 0.05], [2, 2, 2])
    corner = len(cube.nodes) - 1  # the last node of one box is the first of the other
    nodes = np.vstack([cube.nodes, cube.nodes[1:] + cube.nodes[corner]])
    new_number = np.concatenate([[corner], np.arange(corner + 1, len(nodes))])
    return TetMesh(nodes, np.vstack([cube.tetrahedra, new_number[cube.tetrahedra]]))


def _stretched(model: str) -> Answer:
    """Hold the ends of a cube apart, and step the nodes between them to equilibrium, judged by the residual force."""
    mesh = box([0.1, 0.1, 0.1], [3, 3, 3])
    end_nodes = np.flatnonzero(np.isin(mesh.nodes[:, 0], mesh.nodes[[0, -1], 0]))
    particles = solid_particles(mesh, end_nodes, Material(3000.0, 0.488, 1000.0), "cube")
    start, elements = mesh.nodes * [3.0, 1.0, 1.0], LinearElements(mesh, particles.material)
    reached, _ = stage.Stepper(model, particles, {"held": True}).advance(start, np.zeros_like(start), 0.05, 200)
    undeformed = mesh.nodes.copy()
    undeformed[end_nodes] = start[end_nodes]
    on_end = np.linalg.norm(elements.force(reached)[mesh.nodes[:, 0] == 0.0].sum(axis=0))

    def error(a: np.ndarray) -> float:
        return float(np.linalg.norm(np.delete(elements.force(a), end_nodes, axis=0)) / on_end)

    return Answer(reached, start, error, zero=undeformed)


def statics() -> list[Case]:
    def case(name, scene, times, mirrored=False):
        run = partial(_pressed_statically, times, mirrored)
        return Case(name, scene, "equilibrium", RESIDUAL, 1e-6, run, SOLVERS)

    return [
        case("twice_the_load", "a bar is pressed by a disc, twice as hard as moves it by a tenth of its length", 2.0),
        case("thrice_the_load", "the same, three times as hard", 3.0),
        case("inverted_start", "the same press, once, and the search starts from a bar that is mirrored", 1.0, True),
    ]  # fmt: skip


def _pressed_statically(times: float, mirrored: bool, model: str) -> Answer:
    """Press a bar near its end by ``times`` 0.05 N, from rest or ``mirrored`` in y, and judge the residual force."""
    body = stage.bar_body(1)
    solver, rest = SOLVERS[model](body, 0, 2), body.fine.nodes
    contact = int(np.argmax(body.coarse.nodes @ [1.0, 0.1, 1.0]))
    load = nodal_load(body, 0, contact, np.array([0.0, 0.0, -times * 0.05]), 0.03, order=2)
    start = None
    if mirrored:
        start = rest * [1.0, -1.0, 1.0]
        start[body.anchors[1]] = rest[body.anchors[1]]
    error = stage.residual_error(QuadraticElements(body.coarse, body.material), load, body.anchors[1])
    return Answer(solver.solve(load, 1e-8, start).x, rest, error)
