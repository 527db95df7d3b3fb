"""Shapes that are pressed settle where goals and load balance, and a fit finds the softness that made the samples."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.errors import InputError
from palpate.evaluation.accuracy import errors
from palpate.models import shape_matching
from palpate.models.shape_statics import LEFT, Shapes, Softness, cubes, fit

SOFT = Softness(2e-4, 0.3)


@pytest.fixture(scope="module")
def shapes(slab_case) -> Shapes:
    made = Shapes(slab_case[0], "linear", cubes(slab_case[0].body.coarse))
    made.soften(SOFT)
    return made


def test_at_rest_goals_and_load_balance(slab_case, shapes):
    """x − g = φ f/m, but for what damping has left of the swing."""
    case = slab_case[0]
    contact, force = int(case.database.contact[0]), case.database.force[0]
    x = shapes.particles.nodes + shapes.settle(contact, force, 500)
    goals = np.empty_like(x)
    shapes._matching.goals(x, goals)
    push = np.zeros_like(x)
    push[contact] = SOFT.scale_s2 * force / shapes.particles.masses[contact]
    free = np.setdiff1d(np.arange(len(x)), shapes.particles.held)
    assert np.linalg.norm((x - goals - push)[free]) < 2 * LEFT * np.linalg.norm(push)
    assert np.array_equal(x[shapes.particles.held], shapes.particles.nodes[shapes.particles.held])


def test_a_fit_finds_the_softness_that_made_the_samples(slab_case, shapes):
    training, steps = slab_case[0].database, 60
    asked = zip(training.contact, training.force, strict=True)
    shapes.soften(SOFT)
    fine = np.array([shapes.up @ shapes.settle(int(contact), force, steps) for contact, force in asked])
    found = fit(shapes, replace(training, fine=fine), steps, 12, 40)
    assert found.scale_s2 == pytest.approx(SOFT.scale_s2, rel=0.5)
    shapes.soften(found)
    answer = shapes.up @ shapes.settle(int(training.contact[0]), training.force[0], steps)
    assert errors(answer, fine[0]).rmse_of_peak < 0.05


def test_fitted_shapes_answer_contacts_they_never_saw(slab_case):
    case, test, _ = slab_case
    settings = shape_matching.settings(case)
    assert len(settings) >= 5
    setting = settings[3]
    solver = shape_matching.prepare(case, setting)
    asked = zip(test.contact, test.force, test.fine, strict=True)
    assert np.mean([errors(solver.respond(int(c), f), u).rmse_of_peak for c, f, u in asked]) < 0.2
    assert 0.0 < solver.memory_mb < 10.0
    contact = int(test.contact[0])
    assert not np.abs(solver.respond(contact, np.zeros(3))).max() > 1e-12
    assert not np.isfinite(solver.respond(contact, np.array([np.nan, 0.0, 0.0]))).all()  # refused by ``checked``
    with pytest.raises(InputError, match="not a free surface node"):
        solver.respond(int(case.body.anchors[0][0]), np.ones(3))


def test_without_anchors_shapes_do_not_come_to_rest(loose):
    with pytest.raises(InputError, match="nothing is held"):
        Shapes(loose, "linear", {"kind": "one"})
