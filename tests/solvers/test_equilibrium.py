"""Equilibria of bodies: balance, a direct solver, load steps, numbering, and what is refused."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from fixtures.bodies import LIVER
from fixtures.direct import direct
from scipy.spatial import cKDTree

from palpate.bodies.body import Body, nest
from palpate.bodies.make_body import make_body
from palpate.bodies.material import Material, Tissue
from palpate.bodies.mesh import TetMesh
from palpate.bodies.simple_shapes import box
from palpate.bodies.surface_quadrature import midpoints
from palpate.effects.linear_elements import LinearElements
from palpate.effects.patch_load import nodal_load
from palpate.effects.quadratic_elements import QuadraticElements
from palpate.errors import InputError, NotConverged
from palpate.linalg import minimiser
from palpate.linalg.minimiser import minimise_by_lbfgs, minimise_by_newton
from palpate.solvers import equilibrium
from palpate.solvers.equilibrium import Equilibrium, FastEquilibrium


def push(body, level, contact, force):
    load = np.zeros_like(body.levels[level].nodes)
    load[contact] = force
    return load


@pytest.mark.parametrize(("level", "kind"), [(0, LinearElements), (1, LinearElements), (0, QuadraticElements)])
def test_linear_solver_against_a_direct_one(slab, level, kind):
    order = 2 if kind is QuadraticElements else 1
    solver, finest = Equilibrium(slab, level, order).linear_solver(), level + order - 1
    rest, held = slab.levels[finest].nodes, slab.anchors[finest]
    load = np.random.default_rng(0).normal(size=rest.shape)
    load[held] = 0.0
    expected = direct(kind(slab.levels[level], slab.material).stiffness(rest), held, load)
    assert np.abs(solver(load) - expected).max() < 1e-8 * np.abs(expected).max()
    loaded_anchors = load.copy()
    loaded_anchors[held] = 1.0
    assert np.array_equal(solver(loaded_anchors), solver(load))
    assert not solver(np.zeros_like(load)).any()


@pytest.mark.parametrize(("order", "newtons", "least"), [(1, [0.5, 0.3, -0.4], 0.2), (2, [0.3, 0.2, -0.3], 0.1)])
def test_what_is_returned_is_in_balance(beam, order, newtons, least):
    """Checked with the elasticity alone; the anchors bear the whole load and its moment."""
    load, level = push(beam, 1, 265, newtons), 2 - order
    solution = Equilibrium(beam, level, order).solve(load, 1e-9)
    elements = (LinearElements if order == 1 else QuadraticElements)(beam.levels[level], beam.material)
    force = elements.force(solution.x) + load
    free = np.setdiff1d(np.arange(len(load)), beam.anchors[1])
    assert np.linalg.norm(force[free]) < 1e-9 * np.linalg.norm(load)
    assert solution.history[-1] == pytest.approx(np.linalg.norm(force[free]) / np.linalg.norm(load), rel=1e-3)
    assert np.array_equal(solution.x[beam.anchors[1]], beam.fine.nodes[beam.anchors[1]])
    assert np.abs(solution.x - beam.fine.nodes).max() > least * beam.fine.size
    assert force[beam.anchors[1]].sum(axis=0) == pytest.approx(load.sum(axis=0), rel=1e-7)
    moments = [np.cross(solution.x, f).sum(axis=0) for f in (force, load)]
    assert moments[0] == pytest.approx(moments[1], rel=1e-6)


@pytest.mark.parametrize(("kind", "order"), [(Equilibrium, 1), (FastEquilibrium, 2)])
def test_no_load_needs_no_iteration(slab, kind, order):
    solver, held = kind(slab, 2 - order, order), push(slab, 1, slab.anchors[1][0], [1.0, 2.0, 3.0])
    for load in (np.zeros_like(slab.fine.nodes), held):
        for solution in (solver.solve(load, 1e-10), solver.approach(load, 1e-10, 3)):
            assert np.array_equal(solution.x, solver.mesh.nodes)
            assert solution.history == [0.0] and solution.iterations == 0


def test_solving_leaves_nothing_behind(slab):
    """The second solution is the first, bit for bit, whatever was solved in between."""
    solver, load = Equilibrium(slab, 1), push(slab, 1, 44, [0.0, 0.3, -0.4])
    before, kept = solver.solve(load, 1e-8), slab.fine.nodes.copy()
    solver.solve(push(slab, 1, 41, [0.5, 0.0, 0.2]), 1e-8)
    assert np.array_equal(solver.solve(load, 1e-8).x, before.x)
    assert np.array_equal(slab.fine.nodes, kept)


def renumbered(body, seed):
    """The same body with coarse nodes, elements and their corners in another order, and the nodes' new numbers."""
    random = np.random.default_rng(seed)
    order = random.permutation(len(body.coarse.nodes))
    new = np.argsort(order)
    elements = random.permutation(new[body.coarse.tetrahedra])[:, [1, 2, 0, 3]]  # an even permutation of corners
    mesh = TetMesh(body.coarse.nodes[order], elements)
    return nest("other", mesh, len(body.levels) - 1, new[body.anchors[0]], body.material), new


@pytest.mark.parametrize("which", ["slab", "unrefined cylinder"])
def test_solution_does_not_depend_on_numbering(slab, beam, which):
    """On the slab with multigrid: it is irregular, so that no tie between diagonals is broken by numbers."""
    body, contact, force = slab, 44, [0.0, 0.3, -0.4]
    if which != "slab":
        body, contact, force = Body("fine", [beam.fine], [], [beam.anchors[1]], beam.material), 265, [0.03, 0.02, -0.03]
    level = len(body.levels) - 1
    other, new = renumbered(body, 1)
    here = Equilibrium(body, level).solve(push(body, level, contact, force), 1e-12).x
    there = Equilibrium(other, level).solve(push(other, level, new[contact], force), 1e-12).x
    distance, match = cKDTree(other.fine.nodes).query(body.fine.nodes)
    assert distance.max() < 1e-15 and len(np.unique(match)) == len(match)
    assert np.abs(here - body.fine.nodes).max() > 0.05 * body.fine.size
    assert np.abs(here - there[match]).max() < 1e-9 * body.fine.size


def test_load_steps_reach_the_same_equilibrium(slab, monkeypatch):
    """Allowed only few iterations at a time, the solver must divide the load, and tell all that it took."""
    load = push(slab, 1, 44, [0.0, 0.3, -0.4])
    whole = Equilibrium(slab, 1).solve(load, 1e-10)
    calls = []

    def impatient(problem, x, scale, tolerance, **others):
        calls.append(tolerance)
        return minimise_by_newton(problem, x, scale, tolerance, max_iterations=whole.iterations - 2, **others)

    monkeypatch.setattr(equilibrium, "minimise_by_newton", impatient)
    stepped = Equilibrium(slab, 1).solve(load, 1e-10)
    assert len(calls) >= 3 and calls[-1] == 1e-10
    assert stepped.iterations > whole.iterations
    assert stepped.linear_solves > whole.linear_solves and stepped.products > whole.products
    assert len(stepped.seconds) == len(stepped.history) and np.all(np.diff(stepped.seconds) >= 0)
    assert np.abs(stepped.x - whole.x).max() < 1e-8 * slab.fine.size


def test_gives_up_below_the_smallest_step(slab, monkeypatch):
    monkeypatch.setattr(equilibrium, "minimise_by_newton", partial(minimise_by_newton, max_iterations=0))
    with pytest.raises(NotConverged, match=r"at 2% of the load in steps of 1\.6%") as failure:
        Equilibrium(slab, 1).solve(push(slab, 1, 44, [0.0, 0.0, -1.0]), 1e-8)
    assert failure.value.history == [pytest.approx(1 / 2**k, rel=1e-9) for k in range(7)]


def test_a_body_that_nothing_holds_and_a_level_that_is_missing_are_refused(slab):
    two = TetMesh(
        np.vstack([slab.coarse.nodes, slab.coarse.nodes + 1.0]),
        np.vstack([slab.coarse.tetrahedra, slab.coarse.tetrahedra + len(slab.coarse.nodes)]),
    )
    with pytest.raises(InputError, match=r"^two: nothing holds a piece of it"):
        Equilibrium(nest("two", two, 0, slab.anchors[0], slab.material), 0)
    loose = replace(slab, name="loose", anchors=[np.array([], dtype=int)] * 2)
    with pytest.raises(InputError, match=r"^loose: nothing is held.*give it anchors or a bed\.$"):
        Equilibrium(loose, 0)
    with pytest.raises(InputError, match=r"^slab: quadratic elements on level 1 need level 2; refine it once more\.$"):
        Equilibrium(slab, 1, order=2)


def test_a_residual_that_rounding_alone_leaves_is_accepted(box):
    """So light a load on a nearly incompressible body asks for more digits than positions have."""
    mesh = box([4, 2, 2], [0.2, 0.05, 0.05])
    body = nest("bar", mesh, 1, np.flatnonzero(mesh.nodes[:, 0] == 0.0), Material(3000.0, 0.4999, 1000.0))
    load = push(body, 1, len(mesh.nodes) - 1, [0.0, 0.0, -1e-4])
    solution = Equilibrium(body, 1).solve(load, 1e-10)
    assert 1e-10 < solution.history[-1] < 1e-4
    linear = Equilibrium(body, 1).linear_solver(1e-6)(load)
    moved = solution.x - body.fine.nodes
    assert np.abs(moved - linear).max() < 0.01 * np.abs(linear).max()


@pytest.fixture(scope="module")
def bent(slab):
    """The slab pressed by a disc, by more than a twentieth of its size: both ways to its equilibrium, and the load."""
    newton, fast = Equilibrium(slab, 0, order=2), FastEquilibrium(slab, 0, order=2)
    return newton, fast, nodal_load(slab, 0, 44, np.array([0.02, 0.01, -0.06]), 0.03, order=2)


def test_it_finds_newtons_answer_without_any_matrix(bent, slab, monkeypatch):
    newton, fast, load = bent
    expected = newton.solve(load, 1e-9).x
    monkeypatch.setattr(FastEquilibrium, "linearise", lambda self, x, definite: pytest.fail("assembled"))
    found = fast.solve(load, 1e-8)
    assert np.abs(expected - slab.fine.nodes).max() > 0.05 * slab.fine.size
    assert np.abs(found.x - expected).max() < 1e-6 * np.abs(expected - slab.fine.nodes).max()
    force = QuadraticElements(slab.coarse, slab.material).force(found.x) + load
    free = np.setdiff1d(np.arange(len(load)), slab.anchors[1])
    assert np.linalg.norm(force[free]) <= 1e-8 * np.linalg.norm(load)
    assert found.history[-1] == pytest.approx(np.linalg.norm(force[free]) / np.linalg.norm(load), rel=1e-4)
    assert found.linear_solves == 0 and found.products == found.iterations
    again = fast.solve(load, 1e-8, start=found.x)
    assert np.array_equal(again.x, found.x) and again.iterations == 0


def test_newton_goes_on_from_where_it_was_too_slow(bent, monkeypatch):
    newton, fast, load = bent
    expected = newton.solve(load, 1e-9)
    monkeypatch.setattr(minimiser, "MAX_ITERATIONS", 16)
    found = fast.solve(load, 1e-9)
    assert found.history[:17] == fast.approach(load, 0.0, 16).history
    assert 0 < found.iterations - 16 < expected.iterations
    assert found.linear_solves > 0 and found.history[-1] <= 1e-9
    assert len(found.history) == len(found.seconds) and (np.diff(found.seconds) > 0.0).all()
    assert np.abs(found.x - expected.x).max() < 1e-7 * np.abs(expected.x - newton.mesh.nodes).max()
    monkeypatch.setattr(minimiser, "MAX_ITERATIONS", 60)
    monkeypatch.setattr(minimiser, "PACE", 1e-6)  # no search is as fast as that
    assert fast.solve(load, 1e-12).linear_solves > 0


def test_newton_begins_anew_where_the_energy_is_not_convex(bent, monkeypatch):
    """What L-BFGS has found beyond a hill is forgotten: the answer is Newton's from the same start, to the last bit."""
    newton, fast, load = bent

    def over_a_hill(*asked):
        return replace(minimise_by_lbfgs(*asked), convex=False)

    monkeypatch.setattr(minimiser, "minimise_by_lbfgs", over_a_hill)
    for start in (None, newton.solve(0.8 * load, 1e-6).x):
        expected, found = newton.solve(load, 1e-6, start), fast.solve(load, 1e-6, start)
        assert found.linear_solves == expected.linear_solves > 0 and found.iterations > expected.iterations
        assert np.array_equal(found.x, expected.x)


def test_every_iteration_lowers_the_energy_and_the_first_is_a_cycle(bent):
    newton, fast, load = bent
    answers = [fast.approach(load, 1e-12, n) for n in range(10)]
    assert [answer.iterations for answer in answers] == list(range(10))
    assert np.array_equal(answers[0].x, newton.mesh.nodes)
    energies = [fast.energy(answer.x) for answer in answers]
    assert (np.diff(energies) < 0.0).all()
    step = answers[1].x - newton.mesh.nodes
    cycle = fast._precondition(np.where(fast._held[:, None], 0.0, load))
    halvings = -np.log2(np.vdot(step, cycle) / np.vdot(cycle, cycle))
    assert halvings == pytest.approx(round(halvings), abs=1e-9) and halvings > -1e-9
    assert np.abs(step - 0.5**halvings * cycle).max() < 1e-12 * np.abs(cycle).max()
    assert answers[9].history[-1] < 0.1 * answers[1].history[-1]


def two_layers(mesh: TetMesh, refinements: int, contrast: float, axis: int, middle_m: float) -> Body:
    """Make a bar along x, held at its beginning, that is stiffer beyond its middle along an axis; ν is 0."""
    stiff = mesh.nodes[mesh.tetrahedra].mean(axis=1)[:, axis] > middle_m
    materials = tuple(Material(YOUNG * factor, 0.0, 1000.0) for factor in (1.0, contrast))
    held = np.flatnonzero(mesh.nodes[:, 0] == 0.0)
    return nest("bar", mesh, refinements, held, materials[0], regions=Tissue(materials, stiff.astype(int)))


def pulled(mesh, order: int) -> np.ndarray:
    """Integrate STRESS on the end of the bar with the shape functions of the elements: nodal forces (n, 3) [N]."""
    ends = mesh.triangles[(mesh.nodes[mesh.triangles][..., 0] > LENGTH - 1e-9).all(axis=1)]
    a, b, c = (mesh.nodes[ends[:, i]] for i in range(3))
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    nodes = ends if order == 1 else midpoints(mesh, ends)
    load = np.zeros((len(mesh.nodes) + (len(mesh.edges) if order == 2 else 0), 3))
    np.add.at(load[:, 0], nodes.ravel(), np.repeat(STRESS * areas / 3, 3))
    return load


@pytest.mark.parametrize(("contrast", "tolerance"), [(10.0, 1e-6), (1e4, 1e-3)])
@pytest.mark.parametrize(("level", "order"), [(0, 1), (2, 1), (1, 2)])
def test_two_layers_stretch_as_springs_in_a_row(contrast, tolerance, level, order):
    """Under a dead load F and with ν = 0 the law is P = E (s − 1), so each layer stretches by F/(A E), however far."""
    body = two_layers(box([LENGTH, 0.04, 0.04], [6, 2, 2]), 2, contrast, 0, LENGTH / 2)
    problem = Equilibrium(body, level, order)
    x = problem.solve(pulled(body.levels[level], order), 1e-8).x
    rest = problem.mesh.nodes
    for begin, young in ((0.0, YOUNG), (LENGTH / 2, YOUNG * contrast)):
        layer = (rest[:, 0] > begin - 1e-9) & (rest[:, 0] < begin + LENGTH / 2 + 1e-9)
        stretch = np.ptp(x[layer, 0]) / (LENGTH / 2) - 1.0
        assert stretch == pytest.approx(STRESS / young, rel=tolerance)
    assert np.abs(x[:, 1:] - rest[:, 1:]).max() < 1e-9


def test_layers_side_by_side_share_a_load_by_their_moduli():
    """Layers along z act in parallel, and the bar bends: a check of which element is which."""
    body = two_layers(box([LENGTH, 0.02, 0.04], [20, 2, 4]), 1, 10.0, 2, 0.02)
    load = 1e-4 * pulled(body.levels[0], 2)
    problem = Equilibrium(body, 0, 2)
    moved = problem.solve(load, 1e-8).x - problem.mesh.nodes
    # between two cross-sections away from the ends, where the traction is not the one of a beam
    ends = []
    for place in (0.25 * LENGTH, 0.75 * LENGTH):
        section = np.isclose(problem.mesh.nodes[:, 0], place)
        ends.append(np.polyfit(problem.mesh.nodes[section, 2] - 0.02, moved[section, 0], 1))
    slope, middle = ends[1] - ends[0]
    # composite beam under an axial force at half its height: Σ E A, Σ E S and Σ E I of the layers, of unit width
    height = 0.02
    area, first, second = (YOUNG * (height**k / k) * np.array([(-1.0) ** (k - 1), 10.0]).sum() for k in (1, 2, 3))
    strain, curvature = np.linalg.solve([[area, first], [first, second]], [1e-4 * STRESS * 2 * height, 0.0])
    assert middle == pytest.approx(strain * LENGTH / 2, rel=0.005)
    assert slope == pytest.approx(curvature * LENGTH / 2, rel=0.005)


def organ(contrast: float) -> Body:
    sphere = {"center_m": [0.02, -0.02, 0.01], "radius_m": 0.015}
    tumour = {"sphere": sphere, "young_pa": YOUNG * contrast}
    return make_body("liver", LIVER.but(young_pa=YOUNG, regions={"tumour": tumour}))


@pytest.mark.slow
@pytest.mark.parametrize(("level", "order", "most"), [(2, 1, 1.6), (1, 2, 2.8)])
def test_a_contrast_of_ten_thousand_takes_few_more_products(level, order, most):
    """Coarse elements have the materials of fine ones, so that multigrid does not suffer from the interface."""
    products, depths = {}, {}
    for contrast in (1.0, 1e4):
        body = organ(contrast)
        contact = int(body.coarse.surface[np.argmax(body.coarse.nodes[body.coarse.surface] @ [0.1, -0.1, 1.0])])
        load = nodal_load(body, level, contact, -0.1 * body.fine.normals[contact], 0.012, order)
        problem = Equilibrium(body, level, order)
        solution = problem.solve(load, 1e-8)
        assert solution.history[-1] <= 1e-8
        products[contrast] = solution.products
        depths[contrast] = float(np.vdot(load, solution.x - problem.mesh.nodes))
    assert products[1e4] <= most * products[1.0]
    assert depths[1e4] < depths[1.0]


LENGTH, YOUNG, STRESS = 0.2, 3000.0, 300.0
