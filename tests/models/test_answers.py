"""What every model of the registry must do, and the physics that single ones must get right."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.benchmark.accuracy import errors
from palpate.benchmark.load import Load, displacement_of
from palpate.benchmark.model import LIMIT
from palpate.benchmark.static_responses import assemble, press
from palpate.bodies.contacts import contacts_of
from palpate.effects.bed import BedSprings
from palpate.effects.patch_load import nodal_load
from palpate.errors import InputError
from palpate.models.coarse_answers import Enriched, coarse_solver
from palpate.models.enrichment.features import FEATURES
from palpate.models.enrichment.paper_enrichment import WEIGHTS
from palpate.models.fem_statics import ContactShares, Simulation
from palpate.models.kinds import (
    FEM,
    DetailCorrection,
    LinearFEM,
)
from palpate.models.model_registry import MODELS
from palpate.models.shape_matching import Shapes, Softness
from palpate.models.springs.mass_spring import Network
from palpate.solvers.compliance import Compliance, compute_compliance
from palpate.solvers.equilibrium import Equilibrium
from palpate.studies.enrichment.samples import choose_loads

BLENDS = [f"{features}_{weights}" for features, weights in zip(FEATURES, WEIGHTS, strict=False)]
LEARNT = ["ridge_upsampling", "kernel_ridge_detail", "pod_rbf", *BLENDS]
STORED = ["linear_fem", "linear_residual", "warped_compliance"]
NAMES = ["fem_p1", "fem_p2", *STORED, "detail_correction", "interpolation", *LEARNT]
RADIUS_M = 0.03


@pytest.fixture(scope="module")
def patched(slab_case):
    """The slab's case under discs, with quadratic responses to these; its samples press nodes of linear elements."""
    case = slab_case[0]
    return replace(case, radius_m=RADIUS_M, response=compute_compliance(case.body, RADIUS_M, order=2), used={})


@pytest.fixture(scope="module")
def answer(slab_case):
    """Mean rmse_of_peak of a model over the test samples."""
    case, test, _ = slab_case

    def ask(model):
        return mean_error(model.prepare(case), test)

    return ask


def untargeted(tried):
    """The last model that is not brought to the limit."""
    return [each for each in tried if getattr(each, "target", None) != LIMIT][-1]


def mean_error(solver, samples):
    asked = zip(samples.contact, samples.force, samples.fine, strict=True)
    return np.mean([errors(solver.respond(Load.at(c, f)), u).rmse_of_peak for c, f, u in asked])


@pytest.mark.parametrize("name", NAMES)
def test_settings_are_many_and_told_apart_and_a_bad_contact_is_refused(slab_case, grid, name):
    case = slab_case[0]
    tried = MODELS[name].tried(case, grid)
    few = {"linear_fem": 2, "linear_residual": 3, "warped_compliance": 4, "interpolation": 4}
    assert len(tried) >= few.get(name, 5)
    assert len({each.text for each in tried}) == len(tried)
    solver = tried[-1].prepare(case)
    for contact in (int(case.body.anchors[0][0]), len(case.body.fine.nodes)):
        with pytest.raises(InputError, match="not a free surface node"):
            solver.respond(Load.at(contact, np.ones(3)))
    assert 0 < solver.memory_mb < 10


@pytest.mark.parametrize("name", NAMES)
def test_contacts_that_are_not_prepared_change_no_other_answer(slab_case, grid, name):
    """Where contacts are limited, models that store responses refuse the others, and simulations answer them."""
    case, test, _ = slab_case
    all_of = case.response
    kept = np.union1d(case.database.contact, test.contact)
    rows = [all_of.row(contact) for contact in kept]
    few = Compliance(kept, all_of.fine[rows], all_of.restricted[rows], all_of.coarse[rows])
    made = MODELS[name].tried(case, grid)[-1]
    whole, limited = (made.prepare(replace(case, response=response)) for response in (all_of, few))
    asked = int(test.contact[0]), test.force[0]
    assert np.array_equal(limited.respond(Load.at(*asked)), whole.respond(Load.at(*asked)))
    missing = int(np.setdiff1d(all_of.contacts, kept)[0])
    if name in (*STORED, "detail_correction"):
        with pytest.raises(InputError, match=rf"^contact {missing} is not .* prepared; choose one that is\.$"):
            limited.respond(Load.at(missing, np.ones(3)))
    else:
        assert np.isfinite(limited.respond(Load.at(missing, 1e-3 * np.ones(3)))).all()


@pytest.mark.parametrize("name", NAMES)
def test_patches_are_answered(patched, grid, name):
    """Under a small force on a disc, whoever knows the load is as near the linear response as its mesh is good."""
    made, contact = untargeted(MODELS[name].tried(patched, grid)), int(patched.database.contact[0])
    solver = made.prepare(patched)
    force = 1e-3 * patched.database.force[0]
    found = solver.respond(Load.at(contact, force))
    assert found.shape == (patched.n_surface, 3) and np.isfinite(found).all()
    if made.sees == "load":
        linear = np.tensordot(force, patched.response.fine[patched.response.row(contact)], 1)
        assert errors(found, linear).rmse_of_peak < {"fem_p1": 0.25, "detail_correction": 0.1}.get(name, 1e-3)


def networks(case, kind):
    """Return springs of the material's modulus, or one shape, and what settles it."""
    if kind == "springs":
        network = Network(case, 0)
        network.stiffen(np.full(len(network.rest), 3000.0), 0.0)
        return network.particles, lambda contact, force: _settled(network, contact, force)
    shapes = Shapes(case, "linear", {"kind": "one"})
    shapes.soften(Softness(1e-4, 0.5))
    return shapes.particles, lambda contact, force: shapes.settle(contact, force, 4000)


def _settled(network, contact, force):
    network.press(contact, force)
    return network.settle(network.rest) - network.rest


@pytest.mark.parametrize("kind", ["shapes", "springs"])
def test_what_is_not_held_has_no_equilibrium_and_on_a_bed_the_bed_bears_the_whole_press(bedded, kind):
    """Inner forces of springs and of shapes sum to nothing, so that the bed's must be the press's."""
    bedded = replace(bedded, radius_m=0.0)
    with pytest.raises(InputError, match="nothing is held"):
        networks(replace(bedded, body=replace(bedded.body, bed=None)), kind)
    particles, settle = networks(bedded, kind)
    contact, force = int(bedded.database.contact[0]), np.array([0.004, -0.002, -0.01])
    moved = settle(contact, force)
    springs = BedSprings(particles, particles.beds)
    borne = springs.lumped @ moved if kind == "shapes" else (springs.matrix @ moved.ravel()).reshape(-1, 3).sum(axis=0)
    assert np.allclose(borne, force, rtol=0.01, atol=1e-5)
    assert springs.lumped.sum() == pytest.approx(springs.matrix.sum() / 3)


def test_converged_fine_elements_are_the_samples(answer):
    """The slab's samples are of linear elements on level 1, and those of quadratic ones elsewhere."""
    assert answer(FEM(order=1, level=1, tolerance=1e-8)) < 1e-6
    assert answer(FEM(order=2, level=1, tolerance=1e-8)) > 0.01


def test_one_iteration_goes_along_the_linear_response(slab_case):
    """From rest the exact Hessian is the linear stiffness; a line search may only shorten the step."""
    case, test, _ = slab_case
    small = 1e-6 * test.force[0]
    contact = int(test.contact[0])
    moved = Simulation(case, 0, 1e-8, iterations=1).displacement(Load.at(contact, small))
    linear = np.tensordot(small, case.response.coarse[case.response.row(contact)], 1)
    assert np.abs(moved - linear).max() < 1e-5 * np.abs(linear).max()


def test_a_disc_presses_all_levels_and_elements_alike(patched):
    """Spread forces add up to the whole one on every level, and are those that samples are simulated with."""
    body, force = patched.body, np.array([1.0, -2.0, 3.0])
    for level, order in ((0, 1), (1, 1), (0, 2), (1, 2)):
        found = ContactShares(patched, level, order)
        for contact in contacts_of(body)[:5]:
            nodes, shares = found.of(int(contact))
            load = nodal_load(body, level, contact, force, RADIUS_M, order)
            assert np.allclose(np.outer(shares, force), load[nodes], rtol=1e-12, atol=0.0)
            assert load.sum(axis=0) == pytest.approx(force, rel=1e-12) and len(nodes) > 1


def test_a_linear_detail_on_a_linear_coarse_answer_is_linear_fem(slab_case):
    case, test, _ = slab_case
    unturned = DetailCorrection(coarse="linear", turned=False).prepare(case)
    linear = LinearFEM().prepare(case)
    for contact, force in zip(test.contact, test.force, strict=True):
        expected = linear.respond(Load.at(contact, force))
        assert np.abs(unturned.respond(Load.at(contact, force)) - expected).max() < 1e-9 * np.abs(expected).max()


@pytest.mark.parametrize("name", ["kernel_ridge_detail", "pod_rbf", "unordered_nonnegative_b", "detail_correction"])
def test_a_model_learns_from_such_coarse_answers_as_it_gets(slab_case, grid, name):
    """One that has learnt from converged answers, but gets linear ones, is far from its samples and does worse."""
    case = slab_case[0]
    cheap, *_, best = MODELS[name].tried(case, grid)
    assert (cheap.coarse, best.coarse) == ("linear", "converged")
    consistent, other = (each.prepare(case) for each in (cheap, best))
    worse = mean_error(Enriched(other._method, coarse_solver(case, "linear")), case.database)
    assert mean_error(consistent, case.database) < 0.8 * worse


def test_a_learnt_model_pays_for_its_samples_and_no_other_does(slab_case, grid):
    case = slab_case[0]
    used = {"linear_fem": {"compliance"}, "warped_compliance": {"compliance"}, "fem_p1": set()}
    used |= {"linear_residual": {"compliance", "training"}, "pod_rbf": {"compliance", "training"}}
    for name, expected in used.items():
        fresh = replace(case, used={})
        made = FEM(order=1, level=0, iterations=1) if name == "fem_p1" else MODELS[name].tried(fresh, grid)[0]
        made.prepare(fresh)
        assert set(fresh.used) - {"coarse answers", "buckling"} == expected, name


@pytest.mark.parametrize("name", ["linear_fem", "warped_compliance", "contact_modes", "fast_fem", "fem_p2"])
def test_a_bed_bears_what_models_press(bedded, grid, name):
    """Against quadratic elements on a level of the same size, under a press so small that all are linear."""
    contact, force = int(bedded.response.contacts[0]), np.array([0.0, 0.0, -2e-4])
    finer = Equilibrium(bedded.body, 0, order=2)
    load = nodal_load(bedded.body, 0, contact, force, RADIUS_M, order=2)
    moved = (finer.solve(load, 1e-9).x - finer.mesh.nodes)[bedded.body.fine.surface]
    found = untargeted(MODELS[name].tried(bedded, grid)).prepare(bedded).respond(Load.at(contact, force))
    assert errors(displacement_of(found), moved).rmse_of_peak < 0.05


@pytest.fixture(scope="module")
def sampled(bedded):
    """The same with twelve training samples at six contacts, by presses of 2 % of the size."""
    loads = choose_loads(bedded.body, compute_compliance(bedded.body, RADIUS_M), [0.8, 1.2], 0.02, RADIUS_M, 12, 1)
    fine, coarse = press(bedded.body, 1, loads, 1e-8), press(bedded.body, 0, loads, 1e-8)
    database = assemble(bedded.body, loads, fine, coarse, "abc")
    return replace(bedded, database=replace(database, seconds=np.full(12, 2.0)), used={})


@pytest.mark.parametrize("name, within", [("pod_galerkin", 5e-3), ("pod_gaussian", 0.1)])
def test_reduced_models_repeat_their_samples_on_a_bed(sampled, grid, name, within):
    solver, db = MODELS[name].tried(sampled, grid)[-1].prepare(sampled), sampled.database
    for contact, force, fine in zip(db.contact[:3], db.force, db.fine, strict=False):
        found = solver.respond(Load.at(int(contact), force))
        assert errors(displacement_of(found), fine).rmse_of_peak < within
