"""A cascade goes on until a bound is small enough, and says the bound of what it answers."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.errors import NotConverged
from palpate.models import cascade
from palpate.models.cascade_stages import Turning, mesh_bound
from palpate.models.conformal import bound_factor
from palpate.models.fem_statics import Simulation, to_surface
from palpate.models.linear_fem import Linear
from palpate.models.load import Answer, Load, Press, Refused, loads_of
from palpate.models.model import Model, setting_text
from palpate.samples.database import Database

STAGES = [{"model": "linear_fem"}, {"model": "warped_compliance", "setting": {"samples": 0}}]


@pytest.fixture
def case(slab_case):
    """The slab's case with twelve contacts, one sample each: its own samples, as if they were at others."""
    given, count = slab_case[0], 12
    contacts = given.prepared_contacts[:count]
    db: Database = given.database
    rows = np.resize(np.arange(len(db.contact)), count)
    linear = given.response.fine[:count]
    force = db.force[rows]
    fine = np.einsum("ci,cink->cnk", force, linear) * (1.0 + 0.02 * np.arange(1, count + 1))[:, None, None]
    many = replace(db.take(rows), contact=contacts, fine=fine)
    return replace(given, database=many, grid={"cascade": {"asked_errors": [0.1, 0.5], "stages": STAGES}})


class Known:
    """Answers with a share of the linear response, with its own estimate, or not at all."""

    memory_mb = 0.0

    def __init__(self, case, miss=0.0, own=None, fails=False):
        self.linear, self.miss, self.own, self.fails, self.asked = Linear(case), miss, own, fails, 0

    def respond(self, load):
        self.asked += 1
        if self.fails:
            raise NotConverged("no answer", [1.0])
        moved = (1.0 + self.miss) * self.linear.respond(load)
        return moved if self.own is None else Answer(moved, error=self.own)


def test_settings_are_the_errors_that_are_asked_for_the_largest_first(case):
    assert [setting_text(s) for s in cascade.settings(case)] == ["asked=0.5", "asked=0.1"]


def test_the_bound_is_found_on_the_training_contacts(case):
    """The linear response is short of the made-up answers by 2 to 19 %, so that its factor is known."""
    turning, scores = Turning(case), []
    for each, fine in zip(loads_of(case.database.contact, case.database.force), case.database.fine, strict=True):
        missed = Linear(case).respond(each) - fine
        rms = np.sqrt(np.mean(np.sum(missed**2, axis=1))) / np.linalg.norm(fine, axis=1).max()
        scores.append(rms / turning.of(each))
    load = Load.at(case.database.contact[0], case.database.force[0])
    bound = bound_factor(np.array(scores), case.database.contact) * turning.of(load) + mesh_bound(case)
    answer = cascade.prepare(case, {"asked": 1.01 * bound}).respond(load)
    np.testing.assert_allclose(answer.displacement, Linear(case).respond(load))
    assert answer.error == pytest.approx(bound)
    assert {"training", "compliance"} <= set(case.used)
    turned = cascade.prepare(case, {"asked": 0.99 * bound}).respond(load)
    assert not np.allclose(turned.displacement, answer.displacement)


def test_what_the_fine_elements_lack_is_bounded_by_the_level_below(slab_case):
    """Answers of quadratic elements on the coarse level, and of those on the fine one: their distance over 1.2."""
    given = slab_case[0]
    contacts = given.prepared_contacts[:10]
    forces = np.resize(given.database.force, (10, 3))
    loads = loads_of(contacts, forces)
    found = []
    for level in (0, 1):
        simulation, up = Simulation(given, level, 1e-6, order=2), to_surface(given.body, level, 2)
        found.append(np.array([up @ simulation.displacement(load) for load in loads]))
    db = replace(given.database.take(np.resize(np.arange(2), 10)), contact=contacts, force=forces, fine=found[1])
    apart = np.sqrt(np.mean(np.sum((found[0] - found[1]) ** 2, axis=2), axis=1))
    most = (apart / np.linalg.norm(found[1], axis=2).max(axis=1)).max()
    assert mesh_bound(replace(given, database=db)) == pytest.approx(most / 1.2, rel=0.02)
    assert mesh_bound(replace(given, database=db.take(np.arange(5)))) == np.inf


def of(case, asked, *stages, mesh=0.0):
    """A cascade of stages whose factors and solvers are given."""
    return cascade.Cascade(Turning(case), mesh, [cascade.Stage(*each) for each in stages], asked)


def test_a_bound_that_is_too_large_is_passed_over_without_asking(case):
    load = Load.at(case.database.contact[0], case.database.force[0])
    turned = Turning(case).of(load)
    cheap, dear = Known(case), Known(case, 0.1)
    stages = (cheap, 0.2 / turned, False), (dear, 0.01 / turned, False)
    first = of(case, 0.3, *stages).respond(load)
    assert (cheap.asked, dear.asked) == (1, 0) and first.error == pytest.approx(0.2)
    second = of(case, 0.1, *stages).respond(load)
    assert (cheap.asked, dear.asked) == (1, 1) and second.error == pytest.approx(0.01)
    np.testing.assert_allclose(second.displacement, 1.1 * first.displacement)


def test_what_the_fine_elements_lack_is_part_of_every_bound(case):
    load = Load.at(case.database.contact[0], case.database.force[0])
    turned = Turning(case).of(load)
    cheap, dear = Known(case), Known(case, 0.1)
    stages = (cheap, 0.2 / turned, False), (dear, 0.01 / turned, False)
    found = of(case, 0.3, *stages, mesh=0.15).respond(load)
    assert (cheap.asked, dear.asked) == (0, 1) and found.error == pytest.approx(0.16)


def test_what_the_model_says_itself_counts_after_it_has_answered(case):
    load = Load.at(case.database.contact[0], case.database.force[0])
    sure, unsure, last = Known(case, own=0.01), Known(case, own=0.2), Known(case)
    assert of(case, 0.05, (sure, 2.0, True), (last, 0.0, False)).respond(load).error == pytest.approx(0.02)
    of(case, 0.05, (unsure, 2.0, True), (last, 0.0, False)).respond(load)
    assert (sure.asked, unsure.asked, last.asked) == (1, 1, 1)


def test_a_stage_without_an_answer_is_passed_over_and_the_last_one_is_not(case):
    load = Load.at(case.database.contact[0], case.database.force[0])
    fails, works = Known(case, fails=True), Known(case)
    found = of(case, 0.5, (fails, 0.0, False), (works, np.inf, False)).respond(load)
    assert works.asked == 1 and found.error is None  # too few contacts for a bound
    with pytest.raises(NotConverged, match="no answer"):
        of(case, 0.5, (works, np.inf, False), (fails, 0.0, False)).respond(load)


def test_several_presses_and_depths_are_refused(case):
    node, solver = int(case.database.contact[0]), of(case, 0.5, (Known(case), 0.0, False))
    for load in (Load((Press(node, np.ones(3)),) * 2), Load((Press(node, moved=np.ones(3)),))):
        with pytest.raises(Refused):
            solver.respond(load)


def test_stages_are_prepared_once_and_their_time_is_charged_again(case, monkeypatch):
    prepared = []
    found = Model(lambda case: [{}], lambda case, setting: prepared.append(1) or Known(case))
    monkeypatch.setattr("palpate.models.model_registry.model", lambda name, own: found)
    fresh = replace(case, database=case.database.take(np.arange(12)))
    cascade.prepare(fresh, {"asked": 0.1})
    again = replace(fresh, used={})
    cascade.prepare(again, {"asked": 0.5})
    assert len(prepared) == 2 and again.used["stages"] > 0 and "compliance" in again.used
