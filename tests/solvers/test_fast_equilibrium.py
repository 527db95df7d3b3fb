"""L-BFGS with the multigrid of the rest state finds what Newton's method finds, and hands over where it does not."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.bodies.body import nest
from palpate.bodies.material import Material
from palpate.effects.patch_load import nodal_load
from palpate.effects.quadratic_elements import QuadraticElements
from palpate.errors import NotConverged
from palpate.solvers import equilibrium
from palpate.solvers.equilibrium import Equilibrium, FastEquilibrium
from palpate.solvers.lbfgs import descend


def push(problem, contact, force):
    load = np.zeros_like(problem.mesh.nodes)
    load[contact] = force
    return load


@pytest.fixture(scope="module")
def bent(slab):
    """The slab pressed by a disc, by more than a twentieth of its size: both ways to its equilibrium, and the load."""
    newton, fast = Equilibrium(slab, 0, order=2), FastEquilibrium(slab, 0, order=2)
    return newton, fast, nodal_load(slab, 0, 44, np.array([0.02, 0.01, -0.06]), 0.03, order=2)


def test_it_finds_newtons_answer_without_any_matrix(bent, slab, monkeypatch):
    newton, fast, load = bent
    expected = newton.solve(load, 1e-9).x
    monkeypatch.setattr(FastEquilibrium, "_stiffness", lambda self, x, definite: pytest.fail("assembled"))
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
    monkeypatch.setattr(equilibrium, "MAX_ITERATIONS", 16)
    found = fast.solve(load, 1e-9)
    assert found.history[:17] == fast.approach(load, 0.0, 16).history
    assert 0 < found.iterations - 16 < expected.iterations
    assert found.linear_solves > 0 and found.history[-1] <= 1e-9
    assert len(found.history) == len(found.seconds) and (np.diff(found.seconds) > 0.0).all()
    assert np.abs(found.x - expected.x).max() < 1e-7 * np.abs(expected.x - newton.mesh.nodes).max()
    monkeypatch.setattr(equilibrium, "MAX_ITERATIONS", 60)
    monkeypatch.setattr(equilibrium, "PACE", 1e-6)  # no search is as fast as that
    assert fast.solve(load, 1e-12).linear_solves > 0


def test_newton_begins_anew_where_the_energy_is_not_convex(bent, monkeypatch):
    """What L-BFGS has found beyond a hill is forgotten: the answer is Newton's from the same start, to the last bit."""
    newton, fast, load = bent

    def over_a_hill(*asked):
        return replace(descend(*asked), convex=False)

    monkeypatch.setattr(equilibrium, "descend", over_a_hill)
    for start in (None, newton.solve(0.8 * load, 1e-6).x):
        expected, found = newton.solve(load, 1e-6, start), fast.solve(load, 1e-6, start)
        assert found.linear_solves == expected.linear_solves > 0 and found.iterations > expected.iterations
        assert np.array_equal(found.x, expected.x)


def test_what_newton_does_not_find_is_not_found(bent, monkeypatch):
    _, fast, load = bent
    monkeypatch.setattr(equilibrium, "MAX_ITERATIONS", 2)
    monkeypatch.setattr(Equilibrium, "solve", lambda *_: (_ for _ in ()).throw(NotConverged("no", [1.0])))
    with pytest.raises(NotConverged, match="no"):
        fast.solve(load, 1e-8)


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


def test_nothing_moves_without_a_load(bent):
    _, fast, load = bent
    for found in (fast.solve(0.0 * load, 1e-8), fast.approach(0.0 * load, 1e-8, 3)):
        assert np.array_equal(found.x, fast.mesh.nodes) and found.history == [0.0]


def test_a_nearly_incompressible_body_has_newtons_answer_too(box):
    mesh = box([4, 2, 2], [0.2, 0.1, 0.1])
    body = nest("bar", mesh, 1, np.flatnonzero(mesh.nodes[:, 0] == 0.0), Material(3000.0, 0.49, 1000.0))
    newton, fast = Equilibrium(body, 0, order=2), FastEquilibrium(body, 0, order=2)
    load = push(newton, 40, [0.0, 0.0, -0.1])
    expected, found = newton.solve(load, 1e-8), fast.solve(load, 1e-8)
    assert found.history[-1] <= 1e-8
    assert np.abs(found.x - expected.x).max() < 1e-5 * np.abs(expected.x - newton.mesh.nodes).max()
