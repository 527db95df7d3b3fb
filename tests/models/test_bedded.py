"""Models that simulate, relax or reduce elements carry a body's bed as finite elements do."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.games import LONG, WITHIN

from palpate.benchmark.accuracy import errors
from palpate.benchmark.load import Load
from palpate.benchmark.presses import choose_loads
from palpate.benchmark.static_responses import assemble, press
from palpate.bodies.supports import Bed
from palpate.effects.patch_load import nodal_load
from palpate.models import fem, relaxed
from palpate.models.model_registry import model
from palpate.solvers.compliance import compute_compliance
from palpate.solvers.equilibrium import Equilibrium

RADIUS_M = 0.03


@pytest.fixture(scope="module")
def bedded(slab_case):
    """The slab on a bed under its lower side, nothing else holding it, with quadratic responses to discs."""
    case = slab_case[0]
    loose = replace(case.body, anchors=[np.empty(0, dtype=np.int64)] * 2)
    body = replace(loose, bed=Bed(np.array([0.1, 0.05, 0.0]), 0.3, 3e5, np.array([0.0, 0.0, -1.0])))
    return replace(case, body=body, radius_m=RADIUS_M, response=compute_compliance(body, RADIUS_M, order=2), used={})


@pytest.mark.parametrize("name", ["linear_fem", "warped_compliance", "contact_modes", "fast_fem", "fem_p2"])
def test_a_bed_bears_what_models_press(bedded, name):
    """Against quadratic elements on a level of the same size, under a press so small that all are linear."""
    contact, force = int(bedded.response.contacts[0]), np.array([0.0, 0.0, -2e-4])
    finer = Equilibrium(bedded.body, 0, order=2)
    load = nodal_load(bedded.body, 0, contact, force, RADIUS_M, order=2)
    moved = (finer.solve(load, 1e-9).x - finer.mesh.nodes)[bedded.body.fine.surface]
    made = model(name, {})
    setting = [each for each in made.settings(bedded) if each.get("target") != "limit"][-1]
    found = made.offline(bedded).online(setting).respond(Load.at(contact, force))
    assert errors(getattr(found, "displacement", found), moved).rmse_of_peak < 0.05


LONGER = {
    "xpbd": {"steps": 6000, "step": 0.125},
    "vertex_block_descent": {"sweeps": 2000},
    "projective_dynamics": {"iterations": 300},
}
"""What is changed of LONG: a soft bed takes longer to settle on."""


@pytest.fixture(scope="module")
def distance(bedded):
    """How far from the elements' equilibrium a method ends, under a press of 7 mm on the slab of 0.2 m."""
    load = Load.at(int(bedded.response.contacts[0]), np.array([0.5, 0.0, -1.5]))
    equilibrium = fem.Fem(bedded, {"level": 0, "start": "rest", "tolerance": 1e-10}, 1).respond(load)

    def measure(method, **changed):
        found = relaxed.Relaxed(bedded, LONG[method] | LONGER[method] | changed, method).respond(load)
        return errors(found, equilibrium).rmse_of_peak

    return measure


@pytest.mark.parametrize("method", LONGER)
def test_methods_of_games_end_at_the_equilibrium_on_a_bed(distance, method):
    assert distance(method) < WITHIN[method]


def test_steps_of_xpbd_end_nearer_with_their_square(distance):
    """Springs that differ from the elements' would leave an error that does not depend on the step."""
    assert distance("xpbd") < 0.3 * distance("xpbd", step=0.25, steps=3000)


@pytest.fixture(scope="module")
def sampled(bedded):
    """The same with twelve training samples at six contacts, by presses of 2 % of the size."""
    loads = choose_loads(bedded.body, compute_compliance(bedded.body, RADIUS_M), [0.8, 1.2], 0.02, RADIUS_M, 12, 1)
    fine, coarse = press(bedded.body, 1, loads, 1e-8), press(bedded.body, 0, loads, 1e-8)
    database = assemble(bedded.body, loads, fine, coarse, "abc")
    return replace(bedded, database=replace(database, seconds=np.full(12, 2.0)), used={})


@pytest.mark.parametrize("name, within", [("pod_galerkin", 5e-3), ("pod_gaussian", 0.1)])
def test_reduced_models_repeat_their_samples_on_a_bed(sampled, name, within):
    made, db = model(name, {}), sampled.database
    solver = made.offline(sampled).online(made.settings(sampled)[-1])
    for contact, force, fine in zip(db.contact[:3], db.force, db.fine, strict=False):
        found = solver.respond(Load.at(int(contact), force))
        assert errors(getattr(found, "displacement", found), fine).rmse_of_peak < within
