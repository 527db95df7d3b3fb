"""Learning from place and force alone: no force, the samples themselves, forces between them, and derivatives."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.benchmark.load import Load, Press, Refused
from palpate.errors import InputError
from palpate.models import pod_of_loads
from palpate.models.kinds import PODOfLoads

LEARNERS = {learner: PODOfLoads(modes=12, learner=learner) for learner in ("gaussian", "network")}


@pytest.fixture(scope="module")
def learnt(slab_case):
    return slab_case[0], {name: model.prepare(slab_case[0]) for name, model in LEARNERS.items()}


@pytest.mark.parametrize("learner", LEARNERS)
def test_no_force_moves_nothing_and_others_are_refused(learnt, learner):
    case, solvers = learnt
    contact = int(case.database.contact[0])
    assert np.abs(solvers[learner].respond(Load.at(contact, np.zeros(3)))).max() < 1e-15
    with pytest.raises(Refused):
        solvers[learner].respond(Load((Press(contact, moved=np.ones(3)),)))
    with pytest.raises(InputError, match="not a free surface node"):
        solvers[learner].respond(Load.at(int(case.body.anchors[0][0]), np.ones(3)))


def test_modes_are_those_of_the_samples(learnt):
    """With fewer modes the answer lies in fewer dimensions, those in which the samples vary most."""
    case, _ = learnt
    solver = PODOfLoads(modes=2).prepare(case)
    db = case.database
    found = np.array([solver.respond(Load.at(c, f)).ravel() for c, f in zip(db.contact, db.force, strict=True)])
    assert np.linalg.matrix_rank(found, tol=1e-9 * np.linalg.norm(found)) == 2
    left = [np.linalg.svd(rows, compute_uv=False)[0] for rows in (found, db.fine.reshape(len(found), -1))]
    assert 0.3 < left[0] / left[1] < 1.05


def test_settings_have_at_most_as_many_modes_as_samples(learnt, grid):
    case, _ = learnt
    few = replace(case, database=case.database.take(np.arange(5)))
    gaussian, network = LEARNERS.values()
    assert [each.modes for each in gaussian.tried(case, grid)] == sorted({4, 12, case.n_training})
    assert [each.modes for each in gaussian.tried(few, grid)] == [4, 5]
    assert [each.text for each in network.tried(case, grid)] == [f"modes=12, hidden={units}" for units in (4, 8, 16)]


def test_slopes_of_the_network_are_its_differences():
    draw = np.random.default_rng(1)
    weights = [draw.normal(size=shape) for shape in ((4, 5), (6, 5), (6, 9 * 4))]
    given = draw.normal(size=(8, 3)), draw.normal(size=(8, 9)), draw.normal(size=(8, 4))
    _, slopes = pod_of_loads._slopes(weights, *given)
    for layer, slope in enumerate(slopes):
        way, step = draw.normal(size=slope.shape), 1e-6
        ahead, back = ([*weights] for _ in range(2))
        ahead[layer], back[layer] = weights[layer] + step * way, weights[layer] - step * way
        difference = (pod_of_loads._slopes(ahead, *given)[0] - pod_of_loads._slopes(back, *given)[0]) / 2 / step
        assert difference == pytest.approx(float(np.vdot(slope, way)), rel=1e-6)


def test_a_process_knows_what_is_linear_in_the_force():
    """Targets that are linear in the force and vary slowly over the body are found at places that were held out."""
    draw = np.random.default_rng(2)
    places, forces = np.repeat(draw.uniform(size=(12, 3)), 3, axis=0), draw.normal(size=(36, 3))
    turn = draw.normal(size=(3, 3, 4))

    def targets(places, forces):
        return np.einsum("ki,ijm,kj->km", np.sin(places), turn, forces)

    fold = np.arange(36) // 3 % 4
    folds = [(np.flatnonzero(fold != part), np.flatnonzero(fold == part)) for part in range(4)]
    predict = pod_of_loads.gaussian_process(places, forces, targets(places, forces), folds, 1)
    place, force = np.full(3, 0.5), np.array([0.3, -0.2, 0.5])
    wanted = targets(place[None], force[None])[0]
    assert np.linalg.norm(predict(place, force) - wanted) < 0.1 * np.linalg.norm(wanted)
