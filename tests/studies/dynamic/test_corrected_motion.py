"""A coarse motion is corrected so that small, slow loads give the fine linear response."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.poked_bar import poked

from palpate.bodies.body import Body
from palpate.bodies.material import Material
from palpate.bodies.simple_shapes import sheet
from palpate.models.fem_statics import to_surface
from palpate.scenes.run_scene import compose
from palpate.scenes.settings import Scene
from palpate.studies.dynamic.compared_scene import ComparedScene
from palpate.studies.dynamic.fitted import CorrectedMotion, corrects

GRAVITY = {"acceleration_m_s2": [0, 1e-3, 0]}
DAMPING = {"mass_1_s": 50.0, "stiffness_s": 0.1}


@pytest.fixture(scope="module")
def pressed(box) -> ComparedScene:
    slow = {"force_n": [0, 0, -1e-3], "hold_s": 1.0}
    return poked(box, slow, 4.0, 4, gravity=GRAVITY, rayleigh=DAMPING)


def test_a_motion_that_has_come_to_rest_is_the_fine_one(pressed):
    found, scene = CorrectedMotion(pressed), pressed.fem(40)
    assert 1.0 < found.softness < 2.0
    soft = pressed.move(scene, 0, pressed.body.material.young_pa / found.softness)[1].motion
    coarse, fine = (pressed.move(scene, level)[0][0] for level in (0, 1))
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
    assert not corrects(replace(pressed, body=pressed.body.up_to(0)))
    mesh = sheet([0.1, 0.1], [2, 2], 0.001)
    cloth = Body("cloth", [mesh], [], [np.array([4])], Material(5e4, 0.3, 1000.0))
    hangs = Scene(body="cloth", step_s=0.1, duration_s=1.0, gravity=GRAVITY)
    assert not corrects(ComparedScene.of(hangs, cloth, 1.0, 1))


def test_all_levels_are_pressed_on_the_same_disc(box):
    """Nested levels get loads of the same work on every displacement that is linear: the same force and moments."""
    scene = poked(box, {"at_m": [0.0875, 0.01, 0.04], "radius_m": 0.018})
    at = scene.placed_loads().pushes[0].at_m
    assert at == pytest.approx([0.0875, 0.01, 0.04]), "a node of the fine level alone"
    moments = []
    for level in (0, 1):
        particles = scene.particles(level)
        system = compose(scene.fem(scene.frames), particles)
        system.at(0.12)
        force = system.outer_force(particles.nodes, np.zeros_like(particles.nodes))
        moments.append(np.einsum("ni,nj->ij", force, np.hstack([np.ones((len(force), 1)), particles.nodes])))
    assert moments[0][2, 0] == pytest.approx(-0.2)
    assert moments[0] == pytest.approx(moments[1], abs=1e-12)
