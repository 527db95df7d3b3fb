"""Shapes that are pressed settle where goals and load balance, and a fit finds the softness that made the samples."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.benchmark.accuracy import errors
from palpate.benchmark.load import Load
from palpate.errors import InputError
from palpate.models.kinds import ShapeMatching
from palpate.models.shape_matching import LEFT, Shapes, Softness, cubes, fit

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


@pytest.mark.parametrize(
    "softness",
    [
        pytest.param(SOFT, marks=pytest.mark.slow),
        Softness(1e-4, 0.3, 0.5),
        pytest.param(Softness(1e-4, 0.6, 1.0), marks=pytest.mark.slow),
    ],
)
def test_a_fit_finds_the_softness_that_made_the_samples(slab_case, shapes, softness):
    """Its α too, as after 60 steps the swing is not over."""
    training, steps = slab_case[0].database, 60
    asked = list(zip(training.contact.tolist(), training.force, strict=True))
    shapes.soften(softness)
    fine = np.array([shapes.up @ shapes.settle(*load, steps) for load in asked])
    found = fit(shapes, replace(training, fine=fine), steps, 12, 100)
    assert found.alpha == softness.alpha
    assert found.scale_s2 == pytest.approx(softness.scale_s2, rel=0.05)
    assert found.beta == pytest.approx(softness.beta, abs=0.05)
    shapes.soften(found)
    answers = [shapes.up @ shapes.settle(*load, steps) for load in asked]
    assert max(errors(a, u).rmse_of_peak for a, u in zip(answers, fine, strict=True)) < 0.02
    shapes.soften(SOFT)


def test_fitted_shapes_answer_contacts_they_never_saw(slab_case, grid):
    """A quarter as wrong as the answer that nothing moves, and far better than twice or half as soft."""
    case, test, _ = slab_case
    tried = ShapeMatching().tried(case, grid)
    assert len(tried) >= 5
    solver = tried[2].prepare(case)
    asked = list(zip(test.contact.tolist(), test.force, test.fine, strict=True))

    def wrong(answer):
        return np.mean([errors(answer(contact, force), u).rmse_of_peak for contact, force, u in asked])

    nothing = wrong(lambda contact, force: np.zeros((case.n_surface, 3)))
    fitted = wrong(lambda contact, force: solver.respond(Load.at(contact, force)))
    assert fitted < 0.25 * nothing
    half, twice = (
        wrong(lambda contact, force, factor=factor: solver.respond(Load.at(contact, factor * force)))
        for factor in (0.5, 2.0)
    )
    assert min(half, twice) > 1.5 * fitted  # the response is nearly in proportion to the scale of forces
    assert 0.0 < solver.memory_mb < 10.0
    assert np.abs(solver.respond(Load.at(asked[0][0], np.zeros(3)))).max() <= 1e-12
    with pytest.raises(InputError, match="not a free surface node"):
        solver.respond(Load.at(case.body.anchors[0][0], np.ones(3)))
