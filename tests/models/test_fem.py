"""Finite elements on every level: what a start changes and what it does not, and quadratic elements on the surface."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from palpate.benchmark.accuracy import errors
from palpate.benchmark.load import Load, SurfacePress
from palpate.bodies.refinement import finer
from palpate.effects.patch_load import nodal_load
from palpate.errors import InputError
from palpate.models.fem import BEFORE
from palpate.models.fem_statics import to_surface
from palpate.models.kinds import FEM, FastFEM, LinearFEM, Springs
from palpate.solvers.equilibrium import Equilibrium

STARTS = ("rest", "linear", "frame")


def ask(pressed, model):
    case, contact, force = pressed
    made = model.prepare(case)
    made.precede(Load.at(contact, force))
    return made.respond(Load.at(contact, force))


def wrong_after(pressed, model, counts):
    """RMSE over peak by start and number of iterations on the coarse level."""
    end, found = ask(pressed, model.having(level=0, tolerance=1e-9)), {}
    for start, n in product(STARTS, counts):
        answer = ask(pressed, model.having(level=0, start=start, iterations=n))
        found[start, n] = errors(answer, end).rmse_of_peak
    return found


@pytest.mark.parametrize(("order", "level"), [(1, 0), (1, 1), (2, 0), (2, 1)])
def test_a_converged_answer_does_not_depend_on_the_start(pressed, order, level):
    starts = STARTS if (order, level) != (2, 1) else ("rest", "frame")
    cold, *warm = (ask(pressed, FEM(order=order, level=level, start=s, tolerance=1e-9)) for s in starts)
    assert np.linalg.norm(cold, axis=1).max() > 0.01
    for answer in warm:
        assert np.abs(answer - cold).max() < 1e-6 * np.abs(cold).max()


def test_the_frame_before_is_that_of_nearly_the_same_load_and_no_other(pressed):
    """One iteration from it is one iteration from the answer to 97 % of the force; without ``precede``, from rest."""
    case, contact, force = pressed
    solver = FEM(order=1, level=0, start="frame", iterations=1).prepare(case)
    equilibrium, load = Equilibrium(case.body, 0), nodal_load(case.body, 0, contact, force, case.radius_m)
    up, rest = to_surface(case.body, 0), case.body.coarse.nodes
    cold = up @ (equilibrium.approach(load, 1e-8, 1).x - rest)
    warm = up @ (equilibrium.approach(load, 1e-8, 1, equilibrium.solve(BEFORE * load, 1e-8).x).x - rest)
    assert np.array_equal(solver.respond(Load.at(contact, force)), cold)
    solver.precede(Load.at(contact, force))
    for _ in range(2):  # asked again, the same
        assert np.abs(solver.respond(Load.at(contact, force)) - warm).max() < 1e-9 * np.abs(warm).max()
    assert np.abs(warm - cold).max() > 0.01 * np.abs(cold).max()
    other = FEM(order=1, level=0, iterations=1).prepare(case).respond(Load.at(contact, 0.9 * force))
    assert np.array_equal(solver.respond(Load.at(contact, 0.9 * force)), other)  # not asked for: from rest


def test_a_linear_start_is_the_linear_response_and_needs_prepared_contacts(pressed):
    case, contact, force = pressed
    model = FEM(order=2, level=0, start="linear", iterations=1)
    fresh = replace(case, database=replace(case.database), used={})
    solver = model.prepare(fresh)
    start = solver._start.at(Load.at(contact, force))
    equilibrium = Equilibrium(case.body, 0, 2)
    load = nodal_load(case.body, 0, contact, force, case.radius_m, 2)
    assert np.abs(start - equilibrium.linear_solver()(load)).max() < 1e-8 * np.abs(start).max()
    assert "columns" not in fresh.used
    model.prepare(fresh)
    assert fresh.used["columns"] > 0.0  # solved before, and charged
    known = replace(case.response, contacts=np.setdiff1d(case.response.contacts, [contact]))
    lacking = model.prepare(replace(fresh, database=replace(case.database), response=known))
    with pytest.raises(InputError, match="not one of the contacts that are prepared"):
        lacking.respond(Load.at(contact, force))
    assert model.needs_contacts and not FEM(order=2).needs_contacts


def test_quadratic_answers_stand_on_the_fine_surface_as_they_are(slab):
    """A quadratic field is carried exactly from every level, and by linear elements from none but the finest."""
    body, matrix = finer(slab), np.random.default_rng(0).normal(size=(6, 3))

    def field(x):
        return np.column_stack([x**2, x[:, :2] * x[:, 1:], x[:, 0] * x[:, 2]]) @ matrix

    fine = field(body.fine.nodes[body.fine.surface])
    for level in range(3):
        nodes = finer(body).levels[level + 1].nodes
        assert np.abs(to_surface(body, level, 2) @ field(nodes) - fine).max() < 1e-14
        linear = to_surface(body, level) @ field(body.levels[level].nodes)
        assert (np.abs(linear - fine).max() < 1e-15) == (level == 2)


@pytest.fixture(scope="module")
def disc(pressed):
    """The same under a force that moves it by several per cent of its size."""
    return *pressed[:2], 0.7 / 1.5 * pressed[2]


def test_every_iteration_helps_and_so_does_a_near_start(disc):
    wrong = wrong_after(disc, FastFEM(), (2, 4, 8, 12))
    for start in STARTS:
        assert wrong[start, 12] < 0.3 * wrong[start, 4] < wrong[start, 2]
    assert wrong["rest", 12] < 1e-3
    for n in (2, 4, 8):
        assert wrong["frame", n] < 0.3 * wrong["rest", n]
    assert wrong["linear", 2] < wrong["rest", 2]


@pytest.mark.parametrize("model", [FEM(order=2), FastFEM(tolerance=1e-6), LinearFEM(), LinearFEM(target="limit")])
def test_a_body_alone_is_asked(slab, model):
    """A small press is linear, and goes inward if nothing else is said."""
    node = int(slab.coarse.surface[-1])
    inward = [float(each) for each in -slab.fine.normals[node]]
    press = SurfacePress(node=node, force_n=1e-5, radius_m=0.02)
    found, same = (model.answer(slab, each) for each in (press, press.model_copy(update={"direction": inward})))
    assert found.error(same) < 1e-12 and found.doubt == ""
    assert found.error(LinearFEM().answer(slab, press)) < (0.1 if model == LinearFEM(target="limit") else 1e-3)
    with pytest.raises(InputError, match="no samples"):
        Springs().answer(slab, press)
    inside = np.setdiff1d(np.arange(len(slab.fine.nodes)), slab.fine.surface)
    for elsewhere in (inside[0], len(slab.fine.nodes)):
        with pytest.raises(InputError, match="not on the surface"):
            model.answer(slab, SurfacePress(node=int(elsewhere), force_n=1.0))
