"""Each decision of ``effects: auto`` turns when the scene changes."""

from dataclasses import replace

import numpy as np
import pytest
from palpate.scenes.scene import Scene

from palpate.bodies.material import Material
from palpate.bodies.particles import Particles
from palpate.bodies.supports import Bed
from palpate.scenes.acting_effects import Moved, acting, assumed, decide, has_contact, has_driven, has_forces, modules
from palpate.scenes.effect_registry import EFFECTS, ELASTIC
from palpate.scenes.run_scene import moved

NODES = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])
SOLID = Particles("tet", NODES, np.ones(4), np.array([0]), FACES, np.array([[0, 1, 2, 3]]), Material(1e3, 0.4, 1e3))
SURFACE = replace(SOLID, tetrahedra=np.empty((0, 4), dtype=int))
SHEET = replace(SURFACE, thickness_m=0.001)
SCENE = Scene("s", "auto", "backward_euler", 0.01, 1.0, settings={"gravity": {"acceleration_m_s2": [0, 0, -9.81]}})


def called(scene: Scene, particles: Particles) -> set[str]:
    return set(acting(scene.entry, moved(particles)))


def having(**blocks) -> Scene:
    return replace(SCENE, settings=SCENE.settings | blocks)


BEDDED = replace(SOLID, beds=((Bed(NODES[0], 0.5, 1e4), FACES),))
PUSH = {"loads": [{"force_n": [0, 0, -1]}]}
IDLE = {"loads": [{"force_n": [0, 0, 0]}]}
BALL = {"stiffness_n_m": 1, "instruments": [{"kind": "sphere"}]}
YIELD = {"yield_strain": 0.1, "max_strain": 0.5}
SOFT = replace(SOLID, material=Material(1e3, 0.2, 1e3))
RUBBER = replace(SOLID, material=Material(1e3, 0.4, 1e3, "neo_hookean"))
MINE = replace(SOLID, material=Material(1e3, 0.4, 1e3, "my.py"))


@pytest.mark.parametrize(
    ("effect", "yes", "no"),
    [
        ("corotational", (SCENE, SOLID), (SCENE, SHEET)),
        ("neo_hookean", (SCENE, RUBBER), (SCENE, SOLID)),
        ("own_law", (SCENE, MINE), (SCENE, RUBBER)),
        ("triangles", (SCENE, SHEET), (SCENE, SOLID)),
        ("springs", (having(springs={}), SOLID), (SCENE, SOLID)),
        ("springs", (SCENE, SURFACE), (SCENE, SHEET)),
        ("shape_matching", (having(shape_matching={}), SOLID), (SCENE, SOLID)),
        ("gravity", (SCENE, SOLID), (having(gravity={"acceleration_m_s2": [0, 0, 0]}), SOLID)),
        ("gravity", (SCENE, SOLID), (replace(SCENE, settings={}), SOLID)),
        ("gravity", (SCENE, SOLID), (SCENE, replace(SOLID, masses=np.zeros(4)))),
        ("held", (SCENE, SOLID), (replace(SCENE, held=False), SOLID)),
        ("held", (SCENE, SOLID), (SCENE, replace(SOLID, held=np.empty(0, dtype=int)))),
        ("bed", (SCENE, BEDDED), (SCENE, SOLID)),
        ("bed", (SCENE, BEDDED), (replace(SCENE, held=False), BEDDED)),
        ("push", (having(push=PUSH), SOLID), (having(push=IDLE), SOLID)),
        ("bending", (SCENE, SHEET), (having(springs={}), SHEET)),
        ("volume", (having(springs={}), SOLID), (having(springs={}), SOFT)),
        ("volume", (having(springs={}), SOLID), (SCENE, SOLID)),
        ("body_springs", (SCENE, SURFACE), (having(springs={}), SOLID)),
        ("contact", (having(contact=BALL), SOLID), (SCENE, SOLID)),
        ("plasticity", (having(plasticity=YIELD), SOLID), (having(plasticity=YIELD | {"max_strain": 0}), SOLID)),
        ("prony", (having(prony={}), SOLID), (SCENE, SOLID)),
        ("rayleigh", (SCENE, SOLID), (replace(SCENE, settings={}), SOLID)),
        ("rayleigh", (having(prony={}), SOLID), (having(prony={}, velocity_damping={}), SOLID)),
        ("rayleigh", (replace(SCENE, settings={}, start="random"), SOLID), (replace(SCENE, settings={}), SOLID)),
        ("kelvin", (having(springs={}), SOLID), (SCENE, SOLID)),
        ("maxwell", (having(springs={}, maxwell={}), SOLID), (having(springs={}), SOLID)),
        ("velocity_damping", (having(shape_matching={}), SOLID), (SCENE, SOLID)),
        ("wind", (replace(SCENE, own={"wind": "wind.py"}), SOLID), (SCENE, SOLID)),
    ],
)
def test_each_decision_flips(effect, yes, no):
    assert effect in called(*yes)
    assert effect not in called(*no)


@pytest.mark.parametrize("particles", [SOLID, SURFACE, SHEET])
def test_one_elastic_effect_and_a_reason_for_each_decision(particles):
    decisions = decide(SCENE.entry, moved(particles))
    assert sum(d.called for d in decisions if d.effect in ELASTIC) == 1
    assert all(d.reason for d in decisions)
    assert len({d.effect for d in decisions}) == len(decisions)


@pytest.mark.parametrize(
    ("entry", "body", "particles"),
    [
        ({}, {"kind": "box", "bed": {"radius_m": 1}}, BEDDED),
        ({"springs": {}}, {"kind": "box"}, SOLID),
        ({"surface": True}, {"kind": "box"}, SURFACE),
        ({}, {"kind": "sheet"}, SHEET),
        ({}, {"kind": "box", "law": "neo_hookean"}, RUBBER),
        ({"held": False, "contact": BALL, "start": "random"}, {"kind": "box"}, SOLID),
    ],
)
def test_the_settings_alone_decide_as_the_particles_do(entry, body, particles):
    entry = {"effects": "auto", "integrator": "bdf2"} | SCENE.settings | entry
    made = acting(entry, moved(particles))
    assert acting(entry, assumed(entry, body)) == made
    assert modules(entry, assumed(entry, body))[:-1] == [EFFECTS[name].module for name in made]


STILL = {"kind": "floor", "height_m": 0.0}
PUSHED = STILL | {"times_s": [0.5, 1.0], "shifts_m": [[0, 0, 0], [0, 0, 1]]}


@pytest.mark.parametrize(
    ("entry", "acts"),
    [
        ({"effects": "auto", "contact": {"instruments": []}}, False),
        ({"effects": "auto", "contact": {"instruments": [STILL]}}, True),
        ({"effects": "auto", "contact": {"self_contact": True}}, True),
        ({"effects": "auto", "others": [{"body": "block"}]}, True),
        ({"effects": ["springs"], "others": [{"body": "block"}], "contact": {"instruments": [STILL]}}, False),
        ({"effects": ["springs", "contact"]}, True),
    ],
)
def test_where_contact_acts(entry, acts):
    assert has_contact(entry | {"duration_s": 1.0}) is has_forces(entry | {"duration_s": 1.0}) is acts
    assert not has_driven(entry | {"duration_s": 1.0})


@pytest.mark.parametrize("name", ["hooks", "threads"])
def test_hooks_and_threads_act_where_they_are_described_and_are_felt(name):
    described = {"effects": "auto", name: [{}], "duration_s": 1.0}
    assert name in acting(described, Moved("solid")) and "rayleigh" in acting(described, Moved("solid"))
    assert has_forces(described) and has_driven(described) and not has_contact(described)
    assert not has_forces(described | {"effects": ["springs"]})


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
    entry = {"duration_s": duration, "contact": {"instruments": [STILL, tool]}}
    assert has_driven(entry | {"effects": "auto"}) is moves
    assert not has_driven(entry | {"effects": ["springs"]})
