"""A cascade goes on until a bound is small enough, and says the bound of what it answers."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.stub import Stub, made_up
from scipy import sparse

from palpate.benchmark.conformal import bound_factor
from palpate.benchmark.database import Database
from palpate.benchmark.load import Answer, Doubted, Load, Press, Refused, loads_of
from palpate.benchmark.model import Solver
from palpate.errors import InputError, NotConverged
from palpate.models import cascade
from palpate.models.cascade import Limits, Turning, prepared_stage
from palpate.models.fem_statics import Simulation, to_surface
from palpate.models.kinds import FEM, Cascade, LinearFEM, WarpedCompliance
from palpate.models.warped_response import WarpedResponse

CASCADE = Cascade(stages=(LinearFEM(), WarpedCompliance()))


@pytest.fixture
def case(slab_case):
    """The slab's case with twelve contacts, one sample each: its own samples, as if they were at others."""
    given, count = slab_case[0], 12
    contacts = given.prepared_contacts[:count]
    db: Database = given.database
    rows = np.resize(np.arange(len(db.contact)), count)
    linear = np.einsum("ci,cink->cnk", db.force[rows], given.response.fine[:count])
    fine = linear * (1.0 + 0.02 * np.arange(1, count + 1))[:, None, None]
    return replace(given, database=replace(db.take(rows), contact=contacts, fine=fine))


@pytest.fixture
def load(case):
    return Load.at(case.database.contact[0], case.database.force[0])


class Known(Solver):
    """Answers with a share of the linear response, with its own estimate, or not at all."""

    memory_mb = 0.0

    def __init__(self, case, miss=0.0, own=None, fails=False):
        self.linear, self.miss, self.own, self.fails, self.asked = LinearFEM().prepare(case), miss, own, fails, 0

    def respond(self, load):
        self.asked += 1
        if self.fails:
            raise NotConverged("no answer", [1.0])
        moved = (1.0 + self.miss) * self.linear.respond(load)
        return moved if self.own is None else Answer(moved, error=self.own)


def test_the_bound_is_found_on_the_training_contacts(case, load):
    """The linear response is short of the made-up answers by 2 to 19 %, and of their limits by more."""
    limits, scores = Limits(case), []
    turning = Turning(case, limits.beyond)
    for each, fine in zip(limits.loads, limits.fine, strict=True):
        missed = LinearFEM().prepare(case).respond(each) - fine
        rms = np.sqrt(np.mean(np.sum(missed**2, axis=1))) / np.linalg.norm(fine, axis=1).max()
        scores.append(rms / turning.of(each))
    bound = bound_factor(np.array(scores), limits.contact) * turning.of(load) + limits.unknown
    answer = CASCADE.having(asked=1.01 * bound).prepare(case).respond(load)
    np.testing.assert_allclose(answer.displacement, LinearFEM().prepare(case).respond(load))
    assert answer.error == pytest.approx(bound)
    assert {"training", "compliance"} <= set(case.used)


def test_turning_is_that_of_the_warped_response_to_the_second_order(case):
    """Of small forces the RMS of the whole change over the coarse nodes; twice the force turns twice as much.

    One force has a share, and several or a depth have none.
    """
    turning, stored = Turning(case, 0.0), case.response
    same = sparse.eye_array(len(case.body.coarse.nodes), format="csr")
    warped = WarpedResponse(replace(case.meshes, prolongation=same), replace(stored, fine=stored.restricted))
    contact, force = int(stored.contacts[3]), 1e-3 * case.database.force[3]
    flat = np.tensordot(force, stored.restricted[3], 1)
    change = warped.answer(contact, force)[0] - flat
    share = np.sqrt(np.mean(np.sum(change**2, axis=1))) / np.linalg.norm(flat[contact])
    assert turning.of(Load.at(contact, force)) == pytest.approx(share, rel=1e-2)
    assert turning.of(Load.at(contact, 2.0 * force)) == pytest.approx(2.0 * share, rel=1e-2)
    with pytest.raises(InputError):
        turning.of(Load.at(int(case.body.anchors[0][0]), force))
    solver = of(case, 0.5, (Known(case), 0.0, False))
    for load in (Load((Press(contact, force),) * 2), Load((Press(contact, moved=force),))):
        with pytest.raises(Refused):
            solver.respond(load)


def test_two_levels_are_extrapolated_as_if_ratios_were_between_two_and_four(slab_case):
    """Answers of quadratic elements on the coarse level, and of those on the fine one: their distance over 4 and 12."""
    given = slab_case[0]
    contacts = given.prepared_contacts[:10]
    forces = np.resize(given.database.force, (10, 3))
    loads = loads_of(contacts, forces)
    found = []
    for level in (0, 1):
        simulation, up = Simulation(given, level, 1e-6, order=2), to_surface(given.body, level, 2)
        found.append(np.array([up @ simulation.displacement(load) for load in loads]))
    db = replace(given.database.take(np.resize(np.arange(2), 10)), contact=contacts, force=forces, fine=found[1])
    limits = Limits(replace(given, database=db))
    change = found[1] - found[0]
    np.testing.assert_allclose(limits.fine, found[1] + change * 7 / 12, atol=1e-3 * np.abs(change).max())
    far = 0.25 * np.sqrt(np.mean(np.sum(change**2, axis=2), axis=1)) / np.linalg.norm(limits.fine, axis=2).max(axis=1)
    assert limits.beyond == pytest.approx(np.median(far) * 7 / 3, rel=0.02)
    assert limits.unknown == pytest.approx(far.max(), rel=0.02) and limits.contact.tolist() == contacts.tolist()
    assert Limits(replace(given, database=db.take(np.arange(5)))).unknown == np.inf


def test_a_contact_without_an_answer_is_no_part_of_a_bound(case):
    """What a stage refuses at one of twelve training contacts is passed over at run time, and says nothing there."""
    whole = LinearFEM().prepare(case)

    def refuse(load):
        if load.single()[0] == case.database.contact[0]:
            raise NotConverged("not here", [1.0])
        return whole.respond(load)

    [refusing] = made_up([{}], lambda *_: Stub(respond=refuse))
    stage = prepared_stage(case, Turning(case), Limits(case), refusing)
    assert np.isfinite(stage.factor)


def of(case, asked, *stages, mesh=0.0):
    """A cascade of stages whose factors and solvers are given."""
    prepared = cascade.Prepared(Turning(case), mesh, [cascade.CascadeStage(*each) for each in stages], case)
    return cascade.CascadeSolver(case, prepared, asked)


def test_a_bound_that_is_too_large_is_passed_over_without_asking(case, load):
    """What is not known of the limit is part of every bound."""
    turned = Turning(case).of(load)
    cheap, dear = Known(case), Known(case, 0.1)
    stages = (cheap, 0.2 / turned, False), (dear, 0.01 / turned, False)
    first = of(case, 0.3, *stages).respond(load)
    assert (cheap.asked, dear.asked) == (1, 0) and first.error == pytest.approx(0.2)
    second = of(case, 0.1, *stages).respond(load)
    assert (cheap.asked, dear.asked) == (1, 1) and second.error == pytest.approx(0.01)
    np.testing.assert_allclose(second.displacement, 1.1 * first.displacement)
    third = of(case, 0.3, *stages, mesh=0.15).respond(load)
    assert (cheap.asked, dear.asked) == (1, 2) and third.error == pytest.approx(0.16)


def test_a_stage_that_does_not_fit_the_budget_is_left_out_and_that_is_told(case, load):
    """Stages of 0.4, 0.7 and 200 ms, of which the first two are not sure enough, or do not answer."""
    turned = Turning(case).of(load)

    def asked(budget_ms, first, second=0.2):
        stages = [
            cascade.CascadeStage(Known(case, own=first, fails=first is None), 1.0, True, 4e-4),
            cascade.CascadeStage(Known(case, own=second), 1.0, True, 7e-4),
            cascade.CascadeStage(Known(case), 1e-3 / turned, False, 0.2),
        ]
        whole = cascade.CascadeSolver(case, cascade.Prepared(Turning(case), 0.0, stages, case), 0.05, budget_ms)
        return whole, [stage.solver for stage in stages]

    whole, solvers = asked(300.0, 0.3)
    assert whole.respond(load).error == pytest.approx(1e-3) and [each.asked for each in solvers] == [1, 1, 1]
    for budget_ms, first, error, calls in ((16.7, 0.3, 0.2, [1, 1, 0]), (1.0, 0.3, 0.3, [1, 0, 0])):
        whole, solvers = asked(budget_ms, first)
        with pytest.raises(Doubted, match="ms") as told:
            whole.respond(load)
        assert told.value.answer.error == pytest.approx(error) and [each.asked for each in solvers] == calls
    assert asked(1.0, 0.01)[0].respond(load).error == pytest.approx(0.01)
    whole, solvers = asked(1.0, None)
    with pytest.raises(NotConverged):
        whole.respond(load)
    assert [each.asked for each in solvers] == [1, 0, 0]


def test_what_the_model_says_itself_counts_after_it_has_answered(case, load):
    sure, unsure, last = Known(case, own=0.01), Known(case, own=0.2), Known(case)
    assert of(case, 0.05, (sure, 2.0, True), (last, 0.0, False)).respond(load).error == pytest.approx(0.02)
    of(case, 0.05, (unsure, 2.0, True), (last, 0.0, False)).respond(load)
    assert (sure.asked, unsure.asked, last.asked) == (1, 1, 1)


def test_where_no_bound_is_small_enough_the_least_one_answers(case, load):
    """Also if that is not the last: one that has answered, or one that would have been passed over."""
    turned = Turning(case).of(load)
    linear, sure, last = Known(case), Known(case, 0.1, own=0.05), Known(case, 0.2)
    stages = [(linear, 0.2 / turned, False), (sure, 1.0, True), (last, 0.1 / turned, False)]
    found = of(case, 0.01, *stages).respond(load)
    assert (linear.asked, sure.asked, last.asked) == (0, 1, 0) and found.error == pytest.approx(0.05)
    np.testing.assert_allclose(found.displacement, 1.1 * linear.linear.respond(load))
    stages[0] = (linear, 0.02 / turned, False)
    assert of(case, 0.01, *stages).respond(load).error == pytest.approx(0.02) and linear.asked == 1
    stages[0] = (Known(case, fails=True), 0.02 / turned, False)  # what would have been surest has no answer
    assert of(case, 0.01, *stages).respond(load).error == pytest.approx(0.05)


def test_contacts_that_a_stage_prepares_are_charged_to_the_setting_that_is_asked(case, load):
    fresh, stage = replace(case, used={}), Known(case)
    stage.precede = lambda load: case.charge("its contact", 3.0)
    solver = of(case, 0.5, (stage, 0.0, False))
    solver._case = fresh
    solver.precede(load)
    assert fresh.used["its contact"] == 3.0 and solver.memory_mb > 0.0


def test_a_stage_without_an_answer_is_passed_over_while_another_has_one(case, load):
    fails, works = Known(case, fails=True), Known(case)
    found = of(case, 0.5, (fails, 0.0, False), (works, np.inf, False)).respond(load)
    assert works.asked == 1 and found.error is None  # too few contacts for a bound
    assert of(case, 0.5, (works, np.inf, False), (fails, np.inf, False)).respond(load).error is None
    with pytest.raises(NotConverged, match="no answer"):
        of(case, 0.5, (fails, 0.0, False), (fails, np.inf, False)).respond(load)


def test_stages_are_prepared_once_and_their_time_is_charged_again(case):
    prepared = []
    stages = made_up([{"n": 1}, {"n": 2}], lambda case, setting: prepared.append(1) or Known(case))
    fresh = replace(case, database=case.database.take(np.arange(12)))
    asked = Cascade(stages=tuple(stages))
    asked.having(asked=0.1).prepare(fresh)
    fresh.used.clear()
    asked.having(asked=0.5).prepare(fresh)
    assert len(prepared) == 2 and fresh.used["stages"] > 0 and "compliance" in fresh.used


@pytest.mark.parametrize(
    ("model", "words"),
    [(WarpedCompliance(samples=8), "learns from the samples"), (FEM(order=1, level=7), "the body has the levels")],
)
def test_a_stage_learns_nothing_and_has_the_settings_of_its_model(case, model, words):
    limits = Limits(case)
    with pytest.raises(InputError, match=words):
        prepared_stage(case, Turning(case), limits, model)
