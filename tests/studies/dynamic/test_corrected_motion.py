"""A coarse motion is corrected so that small, slow loads give the fine linear response."""

import numpy as np
import pytest

from palpate.bodies.body import Body, nest
from palpate.bodies.box import sheet
from palpate.bodies.material import Material
from palpate.models.fem_statics import to_surface
from palpate.studies.dynamic.fitted import CorrectedMotion, corrects
from palpate.studies.dynamic.trial import Trial, trial

PUSH = {"at_m": [0.1, 0.02, 0.04], "force_n": [0, 0, -1e-3], "radius_m": 0.03, "start_s": 0.0, "press_s": 0.1}
PUSH |= {"hold_s": 1.0, "release_s": 0.1}
ENTRY = {"body": "bar", "effects": ["corotational", "held", "push", "gravity", "rayleigh"], "push": {"loads": [PUSH]}}
ENTRY |= {"gravity": {"acceleration_m_s2": [0, 1e-3, 0]}, "rayleigh": {"mass_1_s": 50.0, "stiffness_s": 0.1}}


@pytest.fixture(scope="module")
def pressed(box) -> Trial:
    mesh = box([4, 2, 2], [0.1, 0.04, 0.04])
    body = nest("bar", mesh, 0, np.flatnonzero(mesh.nodes[:, 0] == 0.0), Material(20000.0, 0.3, 1000.0))
    return trial("poke", ENTRY, body, {"duration_s": 4.0, "frames": 4})


def test_a_motion_that_has_come_to_rest_is_the_fine_one(pressed):
    found = CorrectedMotion(pressed)
    assert 1.0 < found.softness < 2.0
    held = pressed.scale_loads(1.0)
    soft = held.move(held.fem(40), 0, held.body.material.young_pa / found.softness)[1].motion
    coarse, fine = held.move(held.fem(40), 0)[0][0], held.move(held.fem(40), 1)[0][0]
    corrected = found.correct(soft)[0]
    assert np.linalg.norm(corrected - fine) < 0.02 * np.linalg.norm(fine) < 0.2 * np.linalg.norm(coarse - fine)


def test_detail_turns_with_the_body(pressed):
    found = CorrectedMotion(pressed)
    still = pressed.body.coarse.nodes
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    turned = still @ turn.T - still
    detail = found._corrected(turned) - to_surface(pressed.body, 0) @ turned
    unturned = np.tensordot(found._shares @ turned.ravel(), found.detail, axes=1)
    assert detail == pytest.approx(unturned @ turn.T) and np.abs(detail).max() > 0.0


def test_only_held_solids_without_contact_have_linear_responses(pressed):
    assert corrects(pressed)
    assert not corrects(trial("poke", ENTRY, pressed.body, {"duration_s": 1.0, "frames": 1, "level": 0}))
    mesh = sheet([0.1, 0.1], [2, 2], 0.001)
    cloth = Body("cloth", [mesh], [], [np.array([4])], Material(5e4, 0.3, 1000.0))
    hangs = {"body": "cloth", "effects": ["triangles", "gravity", "held"], "gravity": ENTRY["gravity"]}
    own = {"duration_s": 1.0, "frames": 1, "models": ["fem_coarse"]}
    assert not corrects(trial("hang", hangs, cloth, own))
