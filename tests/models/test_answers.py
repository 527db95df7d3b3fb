"""What every model of the registry must do, and the physics that single ones must get right."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.bodies.contacts import contacts_of
from palpate.effects.patch_load import nodal_load
from palpate.enrichment.blend_kinds import FEATURES, WEIGHTS
from palpate.errors import InputError
from palpate.evaluation.accuracy import errors
from palpate.models.fem_statics import ContactShares, Simulation, to_surface
from palpate.models.model import setting_text
from palpate.models.model_registry import model
from palpate.solvers.compliance import Compliance

BLENDS = [f"{features}_{weights}" for features in FEATURES for weights in WEIGHTS]
LEARNT = ["ridge_upsampling", "kernel_ridge_detail", "pod_rbf", *BLENDS]
OURS = ["warped_compliance", "detail_correction"]
FREE = ["linear_fem", "interpolation"]
NAMES = ["fem_coarse", "fem_fine", *OURS, *FREE, *LEARNT]


@pytest.fixture(scope="module")
def answer(slab_case):
    """Mean rmse_of_peak of a model's setting over the test samples, and the solver."""
    case, test, _ = slab_case

    def ask(name, setting):
        solver = model(name, {}).prepare(case, setting)
        asked = zip(test.contact, test.force, test.fine, strict=True)
        return np.mean([errors(solver.respond(int(c), f), u).rmse_of_peak for c, f, u in asked]), solver

    return ask


@pytest.mark.parametrize("name", NAMES)
def test_settings_are_many_and_told_apart(slab_case, name):
    settings = model(name, {}).settings(slab_case[0])
    few = dict.fromkeys(FREE, 1) | {"warped_compliance": 2}
    assert len(settings) >= few.get(name, 4)  # of 12 samples, 25 and 40 % are one setting
    assert len({setting_text(setting) for setting in settings}) == len(settings)


@pytest.mark.parametrize("name", NAMES)
def test_a_bad_contact_is_refused(slab_case, name):
    case = slab_case[0]
    made = model(name, {})
    solver = made.prepare(case, made.settings(case)[-1])
    for contact in (int(case.body.anchors[0][0]), len(case.body.coarse.nodes)):
        with pytest.raises(InputError, match="not a free surface node"):
            solver.respond(contact, np.ones(3))
    assert 0 < solver.memory_mb < 10


@pytest.mark.parametrize("name", NAMES)
def test_contacts_that_are_not_prepared_change_no_other_answer(slab_case, name):
    """Where contacts are limited, models that store responses refuse the others, and simulations answer them."""
    case, test, _ = slab_case
    all_of = case.response
    kept = np.union1d(case.database.contact, test.contact)
    rows = [all_of.row(contact) for contact in kept]
    few = Compliance(kept, all_of.fine[rows], all_of.restricted[rows], all_of.coarse[rows])
    made = model(name, {})
    setting = made.settings(case)[-1]
    whole, limited = (made.prepare(replace(case, response=response), setting) for response in (all_of, few))
    asked = int(test.contact[0]), test.force[0]
    assert np.array_equal(limited.respond(*asked), whole.respond(*asked))
    missing = int(np.setdiff1d(all_of.contacts, kept)[0])
    if name in ("linear_fem", *OURS):
        with pytest.raises(InputError, match=rf"^contact {missing} is not .* prepared; choose one that is\.$"):
            limited.respond(missing, np.ones(3))
    else:
        assert np.isfinite(limited.respond(missing, 1e-3 * np.ones(3))).all()


def test_what_the_middle_is_needs_three_levels(slab_case):
    assert model("fem_middle", {}).settings(slab_case[0]) == []


def test_converged_fine_elements_are_the_reference(answer):
    assert answer("fem_fine", {"tolerance": 1e-8})[0] < 1e-6


def test_more_iterations_are_never_much_worse_and_end_at_convergence(answer):
    for name in ("fem_coarse", "fem_fine"):
        wrong = [answer(name, {"iterations": n})[0] for n in (1, 2, 3, 5, 8)]
        assert wrong[0] > 1.05 * wrong[-1]
        assert wrong[-1] == pytest.approx(answer(name, {"tolerance": 1e-8})[0], rel=1e-3, abs=1e-7)


def test_one_iteration_goes_along_the_linear_response(slab_case):
    """From rest the exact Hessian is the linear stiffness; a line search may only shorten the step."""
    case, test, _ = slab_case
    small = 1e-6 * test.force[0]
    contact = int(test.contact[0])
    moved = Simulation(case, 0, 1e-8, iterations=1).displacement(contact, small)
    linear = np.tensordot(small, case.response.coarse[case.response.row(contact)], 1)
    assert np.abs(moved - linear).max() < 1e-5 * np.abs(linear).max()


def test_a_disc_presses_coarse_and_fine_alike(slab_case):
    """Spread forces add up to the whole one on every level."""
    body, force = slab_case[0].body, np.array([1.0, -2.0, 3.0])
    for level in (0, 1):
        found = ContactShares(body, level, 0.03)
        for contact in contacts_of(body)[:5]:
            nodes, shares = found.of(int(contact))
            load = nodal_load(body, level, contact, force, 0.03)
            assert np.allclose(np.outer(shares, force), load[nodes]) and np.isclose(shares.sum(), 1.0)


def test_what_interpolation_carries_up_is_coarse_at_coarse_nodes(slab_case):
    body = slab_case[0].body
    surface = body.fine.surface
    kept = surface < len(body.coarse.nodes)
    carried = to_surface(body, 0) @ body.coarse.nodes
    assert np.allclose(carried, body.fine.nodes[surface])
    assert np.array_equal(carried[kept], body.coarse.nodes[surface[kept]])


def test_interpolation_is_the_converged_coarse_mesh(answer):
    assert answer("interpolation", {})[0] == pytest.approx(answer("fem_coarse", {"tolerance": 1e-8})[0], rel=1e-12)


def test_compliance_that_is_not_warped_is_linear_fem(slab_case):
    case, test, _ = slab_case
    unturned = model("warped_compliance", {}).prepare(case, {"samples": 0, "turned": False})
    linear = model("linear_fem", {}).prepare(case, {})
    for contact, force in zip(test.contact, test.force, strict=True):
        expected = linear.respond(int(contact), force)
        assert np.abs(unturned.respond(int(contact), force) - expected).max() < 1e-9 * np.abs(expected).max()


def test_parts_of_detail_correction_are_each_worth_something(answer, slab_case):
    tried = model("detail_correction", {}).settings(slab_case[0])
    wrong = [answer("detail_correction", setting)[0] for setting in tried]
    texts = [setting_text(setting) for setting in tried]
    by_text = dict(zip(texts, wrong, strict=True))
    unturned, untaught = by_text["tolerance=0.001, samples=0, turned=false"], by_text["tolerance=0.001, samples=0"]
    assert untaught < unturned < answer("interpolation", {})[0]
    assert by_text["tolerance=1e-08, samples=12"] < unturned
    assert min(wrong) < answer("linear_fem", {})[0]


def test_learning_improves_warped_compliance_and_warping_linear_fem(answer):
    learnt, untaught = (answer("warped_compliance", {"samples": count})[0] for count in (12, 0))
    assert learnt < untaught < answer("linear_fem", {})[0]


def test_a_learnt_model_pays_for_its_samples_and_no_other_does(slab_case):
    case = slab_case[0]
    for name, used in (("pod_rbf", {"training"}), ("linear_fem", {"compliance"}), ("fem_fine", set())):
        fresh = replace(case, used={})
        made = model(name, {})
        made.prepare(fresh, made.settings(fresh)[0])
        assert set(fresh.used) == used


def test_pod_keeps_as_many_modes_as_asked(slab_case):
    """Answers with m modes lie in the mean plus m dimensions."""
    case, test, _ = slab_case
    solver = model("pod_rbf", {}).prepare(case, {"modes": 2})
    given = [
        solver.respond(int(c), s * f).ravel() for c, f in zip(test.contact, test.force, strict=True) for s in (1, 0.7)
    ]
    centred = np.array(given) - case.database.fine.reshape(case.n_training, -1).mean(axis=0)
    values = np.linalg.svd(centred, compute_uv=False)
    assert values[2] < 1e-10 * values[0]
