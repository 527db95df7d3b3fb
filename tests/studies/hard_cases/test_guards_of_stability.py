"""Without its guard each model is believed where the body is about to give way, and is wrong."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.benchmark import truth
from palpate.benchmark.accuracy import errors
from palpate.benchmark.database import database_of
from palpate.benchmark.load import Doubted, Load, Press, displacement_of, loads_of
from palpate.benchmark.model import Case
from palpate.benchmark.presses import Sample
from palpate.benchmark.truth import truth_of
from palpate.models import near_buckling, pod_galerkin
from palpate.models.contact_modes import contact_modes
from palpate.models.fem_statics import Simulation
from palpate.models.kinds import FEM, FastFEM, PODGalerkin
from palpate.solvers import equilibrium, pushed_discs
from palpate.solvers.equilibrium import Equilibrium, FastEquilibrium
from palpate.studies.hard_cases.enrichment_cases import SETTINGS as FIT
from palpate.studies.hard_cases.nonlinear_cases import EULER_N, RADIUS_M, body_of, press_of, stability
from palpate.studies.hard_cases.stage import bar_body, end_face, judge

CASES = {case.name: case for case in stability()}


@pytest.mark.slow
def test_contact_modes_without_guards_answer_with_the_straight_column(monkeypatch):
    """Each guard is enough: the tangent in the contact's modes, and the body's own shapes, which these may lack."""
    case, off = CASES["column_at_1.4_asked"], {"LEAST_STIFFNESS": -1e9, "LARGEST_SHARE": np.inf}
    for name, value in off.items():
        with monkeypatch.context() as one:
            one.setattr(contact_modes, name, value)
            assert judge(case, "contact_modes")["outcome"] == "not_converged"
    for name, value in off.items():
        monkeypatch.setattr(contact_modes, name, value)
    row = judge(case, "contact_modes")
    assert row["outcome"] == "wrong" and row["value"] > 0.3


@pytest.mark.parametrize("model", ["linear_fem", "warped_compliance"])
def test_linear_responses_without_a_guard_miss_how_far_a_column_bends(monkeypatch, model):
    case = CASES["column_off_its_axis"]
    assert judge(case, model)["outcome"] == "not_converged"
    monkeypatch.setattr(near_buckling, "LARGEST_SHARE", np.inf)
    row = judge(case, model)
    assert row["outcome"] == "wrong" and row["value"] > 0.05


def test_elements_that_settle_answer_where_those_that_stop_early_doubt():
    """At half of Euler's load."""
    body, (node, force) = body_of("column"), press_of("column", 0.5)
    case, load = Case.untrained(body, "hard", RADIUS_M, 0, 1e-8), Load.at(node, force)
    with pytest.raises(Doubted):
        FastFEM(iterations=8).prepare(case).respond(load)
    expected = displacement_of(FEM(order=2, tolerance=1e-8).prepare(case).respond(load))
    found = displacement_of(FastFEM(level=0, tolerance=1e-3).prepare(case).respond(load))
    assert errors(found, expected).rmse_of_peak < 0.01


def unchecked(problem, at_rest, size, solution, settle):
    """Stand in for ``made_stable``."""
    return solution


@pytest.mark.parametrize("solver", [Equilibrium, FastEquilibrium])
def test_elements_without_a_guard_stay_straight(monkeypatch, solver):
    body = bar_body(1)
    load = np.outer(end_face(body.fine), [-1.002 * EULER_N, 0.0, 0.0])

    def aside():
        return float(np.abs((solver(body, 0, 2).solve(load, 1e-6).x - body.fine.nodes)[:, 1:].mean(axis=0)).max())

    assert aside() > 2e-3
    monkeypatch.setattr(equilibrium, "made_stable", unchecked)
    assert aside() < 2e-4


def test_a_post_that_is_pushed_stays_straight_without_a_guard(monkeypatch):
    """A little beyond the depth at which it buckles; farther on Newton's method leaves the straight post by itself."""
    body, (node, way) = body_of("post"), press_of("post", 1.05)
    case = Case.untrained(body, "hard", RADIUS_M, 0, 1e-6)
    simulation = Simulation(case, 0, 1e-6, order=2)

    def aside():
        moved, _ = simulation.answer(Load((Press(node, moved=way),)))
        return float(np.abs(moved[:, 1:].mean(axis=0)).max())

    assert aside() > 2e-3
    monkeypatch.setattr(pushed_discs, "made_stable", unchecked)
    assert aside() < 2e-5


def test_galerkin_without_guards_answers_with_the_straight_column(monkeypatch):
    """Of samples of how it is pressed and bends a little. Each guard is enough: the tangent, and the body's shapes."""
    body, (node, force) = body_of("column"), press_of("column", 1.0)
    ways = np.array([[0.9, 0.0, 0.0], [0.3, 0.0, 0.0], [0.0, 0.005, 0.0], [0.0, 0.0, 0.005]]) * force[0]
    nodes = np.full(len(ways), node)
    none = [np.zeros((len(ways), *mesh.nodes.shape)) for mesh in (body.coarse, body.fine)]
    case = Case(body, "hard", RADIUS_M, database_of(body, nodes, ways, *none), None, FIT, 1e-8)
    elements = FEM(order=2, level=0, tolerance=1e-8).prepare(case)
    fine = np.array([displacement_of(elements.respond(load)) for load in loads_of(nodes, ways)])
    case = replace(case, database=replace(case.database, fine=fine))
    solver = PODGalerkin(modes=20, thinned=0.0, nodes=1).prepare(case)
    load = Load.at(node, 1.4 * force)
    guards = [(pod_galerkin, "LEAST_STIFFNESS", -1e9), (solver._buckling, "_largest", np.inf)]
    for guard in guards:
        with monkeypatch.context() as one, pytest.raises(Doubted):
            one.setattr(*guard)
            solver.respond(load)
    for guard in guards:
        monkeypatch.setattr(*guard)
    found, expected = solver.respond(load), displacement_of(elements.respond(load))
    assert np.linalg.norm(found, axis=1).max() < 0.3 * np.linalg.norm(expected, axis=1).max()


def pressed_column(share):
    """Return a press of the column, as truths are asked for it, at a ``share`` of the load under which it buckles."""
    return [Sample(0, Load.at(*press_of("column", share)), RADIUS_M)]


def test_a_truth_of_a_column_that_buckles_on_finer_elements_only_is_rejected():
    """The softest value is looked at on the next level, too, while it is below ``truth.FIRM``: 0.05 at 0.9 of this."""
    with pytest.warns(UserWarning, match="no truth"):
        found = truth_of(body_of("column"), pressed_column(1.0), {0})
    assert "level 1: the equilibrium is not stable" in found.rejected[0]


@pytest.mark.slow
def test_a_truth_without_guards_is_the_straight_column(monkeypatch):
    """Each guard is enough: the softest direction, and the Hessian that had to be clamped."""
    body, press = body_of("column"), pressed_column(1.06)
    with pytest.warns(UserWarning, match="no truth"):
        assert "not stable" in truth_of(body, press, {0}).rejected[0]
    monkeypatch.setattr(truth._Level, "check_stable", lambda solver, x: np.inf)
    with pytest.warns(UserWarning, match="no truth"):
        assert truth_of(body, press, {0}).rejected[0] == truth.CLAMPED
    monkeypatch.setattr(truth._Level, "linearise", FastEquilibrium.linearise)
    found = truth_of(body, press, {0})
    assert found.rejected[0] == "" and np.abs(found.displacement[0, :, 1:].mean(axis=0)).max() < 1e-3
