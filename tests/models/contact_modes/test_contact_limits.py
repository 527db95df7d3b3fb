"""How hard a contact may be pressed: a finer level's answer decides, and what goes beyond is doubted."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.benchmark.load import Doubted, Load
from palpate.models.contact_modes import contact_modes, workshop
from palpate.models.contact_modes.workshop import SOUND, TRIAL_RESIDUAL, Workshop, bearing

RADIUS = 0.03


def test_a_press_that_the_finer_level_bears_is_the_limit_and_one_that_it_does_not_is_lowered(slab_case):
    body, contact = slab_case[0].body, int(slab_case[1].contact[0])
    shop = Workshop(body, RADIUS, 1)
    assert shop.gap == 1
    shown = shop.shown(contact, "snapshots")
    hard = np.linalg.norm(shown.forces[0])
    assert bearing(shop, [contact], "snapshots")[0] == pytest.approx(-shown.normal / hard)
    other = Workshop(body, RADIUS, 1)
    other.make(("snapshots", contact), lambda: replace(shown, forces=20 * shown.forces, answers=20 * shown.answers))
    lowered = 1.0 / np.linalg.norm(bearing(other, [contact], "snapshots"))
    assert 0.9 * hard < lowered < 19 * hard
    finer, disc = other.elements(1), other.disc(contact, 1)
    load = finer.nodal(*disc, -lowered * shown.normal)
    moved = finer.settle(load, np.zeros_like(finer.rest), 400, TRIAL_RESIDUAL)
    assert np.linalg.norm(finer.force(moved) + load) <= TRIAL_RESIDUAL * np.linalg.norm(load)
    assert finer.least_det(moved) > 0.9 * SOUND


def test_a_press_that_squeezes_nothing_is_believed_without_a_trial_on_the_finer_level(slab_case, monkeypatch):
    body, contact = slab_case[0].body, int(slab_case[1].contact[0])
    shown = Workshop(body, RADIUS, 1).shown(contact, "columns")
    light = replace(shown, forces=0.1 * shown.forces, answers=0.1 * shown.answers)
    for sure, tried in ((workshop.SURE, False), (1.1, True)):
        monkeypatch.setattr(workshop, "SURE", sure)
        shop = Workshop(body, RADIUS, 1)
        shop.make(("columns", contact), lambda: light)
        assert bearing(shop, [contact], "columns")[0] @ light.forces[0] == pytest.approx(1.0)
        assert (("elements", 1) in shop.seconds) == tried


def test_a_press_beyond_what_is_known_to_be_borne_is_doubted_and_its_answer_kept(slab_case):
    case, contact, force = replace(slab_case[0], radius_m=RADIUS), int(slab_case[1].contact[0]), slab_case[1].force[0]
    setting = {"modes": "snapshots", "rings": 50, "thinned": 0.003, "target": "operator"}
    solver, load = contact_modes.offline(case).online(setting), Load.at(contact, 0.5 * force)
    expected = solver.respond(load)
    kept = solver.prepared[contact,]
    most = 1.0 / float((kept.bearing @ load.single()[1]).max())
    solver.prepared[contact,] = kept._replace(bearing=1.2 * most * kept.bearing)
    with pytest.raises(Doubted, match="times as hard as finer elements are known to bear") as told:
        solver.respond(load)
    assert np.array_equal(told.value.answer.displacement, expected.displacement)
    solver.prepared[contact,] = kept._replace(bearing=most * kept.bearing)
    assert np.array_equal(solver.respond(load).displacement, expected.displacement)
