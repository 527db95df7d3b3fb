"""Which effects act: the blocks of a scene, and what its body says of itself."""

from dataclasses import replace

import numpy as np
import pytest
from pydantic import TypeAdapter

from palpate.bodies.material import Material
from palpate.bodies.particles import Particles
from palpate.bodies.settings import Body
from palpate.bodies.supports import Bed
from palpate.scenes.acting_effects import acting, assumed, decide, has_driven, has_forces, modules
from palpate.scenes.effect_registry import EFFECTS, ELASTIC
from palpate.scenes.run_scene import traits
from palpate.scenes.settings import Scene

NODES = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])
SOLID = Particles("tet", NODES, np.ones(4), np.array([0]), FACES, np.array([[0, 1, 2, 3]]), Material(1e3, 0.4, 1e3))
SURFACE = replace(SOLID, tetrahedra=np.empty((0, 4), dtype=int))
SHEET = replace(SURFACE, thickness_m=0.001)
BEDDED = replace(SOLID, beds=((Bed(NODES[0], 0.5, 1e4), FACES),))
RUBBER = replace(SOLID, material=Material(1e3, 0.4, 1e3, "neo_hookean"))
MINE = replace(SOLID, material=Material(1e3, 0.4, 1e3, "my.py"))
SCENE = Scene(body="tet", step_s=0.01, duration_s=1.0)
STILL = {"kind": "floor", "height_m": 0.0}
BALL = {"kind": "sphere", "center_m": [0, 0, 0], "radius_m": 1}


@pytest.mark.parametrize(
    ("effect", "yes", "no"),
    [
        ("corotational", ({}, SOLID), ({}, SHEET)),
        ("neo_hookean", ({}, RUBBER), ({}, SOLID)),
        ("own_law", ({}, MINE), ({}, RUBBER)),
        ("triangles", ({}, SHEET), ({"springs": {}}, SHEET)),
        ("springs", ({"springs": {}}, SOLID), ({}, SOLID)),
        ("springs", ({}, SURFACE), ({}, SHEET)),
        ("shape_matching", ({"shape_matching": {}}, SOLID), ({}, SOLID)),
        ("held", ({}, SOLID), ({"held": False}, SOLID)),
        ("held", ({}, SOLID), ({}, replace(SOLID, held=np.empty(0, dtype=int)))),
        ("bed", ({}, BEDDED), ({}, SOLID)),
        ("bed", ({}, BEDDED), ({"held": False}, BEDDED)),
        ("gravity", ({"gravity": {"acceleration_m_s2": [0, 0, 0]}}, SOLID), ({}, SOLID)),
        ("bending", ({"bending": {}}, SHEET), ({}, SHEET)),
        ("volume", ({"springs": {}, "volume": {}}, SOLID), ({"springs": {}}, SOLID)),
        ("wind", ({"own": {"wind": "wind.py"}}, SOLID), ({}, SOLID)),
    ],
)
def test_each_decision_flips(effect, yes, no):
    assert effect in acting(SCENE.but(**yes[0]), traits(yes[1]))
    assert effect not in acting(SCENE.but(**no[0]), traits(no[1]))


@pytest.mark.parametrize("particles", [SOLID, SURFACE, SHEET])
def test_one_elastic_effect_and_a_reason_for_each_decision(particles):
    decisions = decide(SCENE, traits(particles))
    assert sum(d.acts for d in decisions if d.effect in ELASTIC) == 1
    assert all(d.reason for d in decisions)
    assert len({d.effect for d in decisions}) == len(decisions)


UNDERLAY = {"sphere": {"center_m": [0, 0, 0], "radius_m": 1}, "stiffness_n_m3": 1e4}


@pytest.mark.parametrize(
    ("blocks", "body", "particles"),
    [
        ({}, {"kind": "box", "bed": UNDERLAY}, BEDDED),
        ({"springs": {}, "volume": {}}, {"kind": "box"}, SOLID),
        ({"surface": True}, {"kind": "box"}, SURFACE),
        (
            {"bending": {}},
            {"kind": "sheet", "sizes_m": [1, 1], "divisions": [1, 1], "thickness_m": 0.001, "anchors": {"nodes": [0]}},
            SHEET,
        ),
        ({}, {"kind": "box", "law": "neo_hookean"}, RUBBER),
        ({"held": False, "contact": {"instruments": [BALL]}, "start": "random"}, {"kind": "box"}, SOLID),
    ],
)
def test_the_settings_alone_decide_as_the_particles_do(blocks, body, particles):
    solid = {"young_pa": 1e3, "poisson": 0.4, "density_kg_m3": 1e3, "anchors": {"nodes": [0, 1, 2]}}
    solid |= {"sizes_m": [1, 1, 1], "divisions": [1, 1, 1], "refinements": 0} if body["kind"] == "box" else {}
    scene = SCENE.but(rayleigh={}, **blocks)
    made, before = acting(scene, traits(particles)), assumed(scene, TypeAdapter(Body).validate_python(solid | body))
    assert acting(scene, before) == made
    assert modules(scene, before)[:-1] == [EFFECTS[name].module for name in made]


def test_forces_are_felt_where_something_touches_or_pulls():
    hook, thread = {"at_m": [0, 0, 1], "shift_m": [0, 0, 1]}, {"ends_m": [[0, 0, 1], [1, 0, 0]]}
    for pulled in ({"hooks": [hook]}, {"threads": [thread]}):
        assert has_forces(SCENE.but(**pulled)) and has_driven(SCENE.but(**pulled))
    touched = SCENE.but(contact={"instruments": [STILL]})
    assert has_forces(touched) and not has_driven(touched)
    assert not has_forces(SCENE) and not has_driven(SCENE)


PUSHED = STILL | {"times_s": [0.5, 1.0], "shifts_m": [[0, 0, 0], [0, 0, 1]]}


@pytest.mark.parametrize(
    ("tool", "duration", "moves"),
    [
        (PUSHED, 1.0, True),
        (PUSHED, 0.6, True),
        (PUSHED, 0.5, False),
        (PUSHED | {"times_s": [-1.0, 0.0]}, 1.0, False),
        (PUSHED | {"shifts_m": [[0, 0, 1], [0, 0, 1]]}, 1.0, False),
        (PUSHED | {"times_s": [0.0], "shifts_m": [[0, 0, 1]]}, 1.0, False),
    ],
)
def test_what_is_driven_within_the_scene(tool, duration, moves):
    assert has_driven(SCENE.but(duration_s=duration, contact={"instruments": [STILL, tool]})) is moves
