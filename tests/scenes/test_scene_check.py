"""Effects that exclude, need or do not suit each other are refused from the settings alone, before a body is made."""

import subprocess
import sys
from pathlib import Path

import pytest
from fixtures.bodies import made

from palpate.bodies.particles import particles_of
from palpate.errors import InputError
from palpate.files import read_yaml
from palpate.models import strokes
from palpate.run.settings import complete
from palpate.scenes.effect_registry import INTEGRATORS
from palpate.scenes.run_scene import run
from palpate.scenes.settings import Scene

ROOT = Path(__file__).parents[2]
ROUND = {"young_pa": 1e4, "poisson": 0.3, "density_kg_m3": 1000, "anchors": {"nodes": [0, 1, 2]}}
BAR = {"kind": "box", "sizes_m": [3, 1, 1], "divisions": [6, 2, 2], "refinements": 0} | ROUND
BODIES = {
    "bar": BAR,
    "hard": BAR | {"young_pa": 2e4},
    "spotted": BAR | {"regions": {"spot": {"sphere": {"center_m": [1, 0, 0], "radius_m": 1}, "young_pa": 1e5}}},
    "rubber": BAR | {"law": "neo_hookean"},
    "tissue": BAR | {"law": "exponential(8)"},
    "mine": BAR | {"law": str(ROOT / "examples/hencky.py")},
    "cloth": {"kind": "sheet", "sizes_m": [1, 1], "divisions": [6, 6], "thickness_m": 0.001} | ROUND,
}
SCENE = {"body": "bar", "step_s": 0.01, "duration_s": 0.1}
GRAVITY = {"gravity": {"acceleration_m_s2": [0, 0, -9.81]}}
PUSH = {"push": {"loads": [{"at_m": [3, 1, 1], "force_n": [0, 0, 1]}]}}
HOOKS = {"hooks": [{"at_m": [3, 1, 1], "shift_m": [0, 0, 0.01]}]}
STRETCH = {"structural_n_m": 1, "shear_n_m": 1, "bending_n_m": 0}
SHAPES = {"shape_matching": {}, "integrator": "goal_position"}
YIELD = {"plasticity": {"yield_strain": 0.1, "max_strain": 0.5}}
BALL = {"kind": "sphere", "center_m": [2, 0.5, 1.12], "radius_m": 0.1}
PATH = {"times_s": [0, 0.02], "shifts_m": [[0, 0, 0], [0, 0, -0.05]]}
PULL = {"force_n": [0, 0, 1]}
LONG = {"pull_s": 0.1, "hold_s": 0.5, "release_s": 0.1}
STROKE = {"integrator": "touching", "contact": {"instruments": [BALL | PATH]}}
SERIES = {"prony": {"shares": [0.5, 0.3], "times_s": [0.1, 1.0]}}


def check(scene):
    return complete({"bodies": BODIES, "scenes": {"s": SCENE | scene}}, Path("my.yaml"))


@pytest.mark.parametrize(
    "scene",
    [
        GRAVITY | {"rayleigh": {}},
        {"body": "rubber"} | GRAVITY,
        {"body": "mine", "rayleigh": {}} | GRAVITY,
        {"body": "tissue"} | GRAVITY,
        {"body": "cloth", "bending": {}} | GRAVITY,
        {"springs": {}, "volume": {}, "kelvin": {}, "integrator": "symplectic_euler"},
        {"surface": True, "springs": STRETCH, "body_springs": {}},
        SHAPES | YIELD | GRAVITY,
        SHAPES | {"rayleigh": {"stiffness_s": 0}},
        SERIES,
        {"others": [{"body": "hard", "shift_m": [0, 0, 2]}, {"body": "spotted", "shift_m": [0, 0, 4]}]},
    ],
)
def test_effects_that_suit_each_other_pass(scene):
    check(scene)


def test_the_shipped_scenes_pass():
    for file in (ROOT / "config.yaml", ROOT / "tests/smoke/config.yaml"):
        assert complete(read_yaml(file), file).scenes


@pytest.mark.parametrize(
    ("scene", "said"),
    [
        (
            {"body": "rubber"} | YIELD,
            " has plasticity, which works with corotational or shape_matching, and neo_hookean",
        ),
        ({"own": {"kinetic": "mine.py"}}, ".own.kinetic has a name that palpate uses itself; call it something"),
        ({"springs": {}, "shape_matching": {}}, " has both springs and shape_matching; keep one of them"),
        ({"bending": {}}, " has bending, which needs a body of kind sheet, and bar is moved as"),
        ({"kelvin": {}}, " has kelvin, which works with springs, and corotational holds"),
        ({"body": "cloth"} | SERIES, " has prony, which needs a body with tetrahedra, and cloth is moved as"),
        ({"prony": {"shares": [0.5, 0.5], "times_s": [1, 2]}}, ".prony.shares has the sum 1, of which 0.99 is the m"),
        ({"integrator": "goal_position"}, ".integrator is goal_position, which needs"),
        ({"shape_matching": {}}, ".integrator is backward_euler, and shape_matching needs"),
        ({"springs": STRETCH}, ".springs.structural_n_m has no use: a solid's springs"),
        ({"springs": {}, "surface": True}, ".springs lacks structural_n_m, and a surface alone has no"),
        ({"springs": dict.fromkeys(STRETCH, 0), "body": "cloth"}, ".springs has no stiffness above 0; give"),
        (SHAPES | {"shape_matching": {"clusters": {"kind": "cubes"}}}, ".shape_matching.clusters lacks edge_m; give"),
        (SHAPES | {"shape_matching": {"clusters": {"kind": "tetrahedra"}}, "surface": True}, ".*kind is tetrahedra,"),
        (SHAPES | {"rayleigh": {}}, ".rayleigh.stiffness_s is above 0, and"),
        (SHAPES | {"plasticity": YIELD["plasticity"] | {"max_strain": 1}}, ".plasticity.max_strain is 1; give a"),
        ({"springs": {}, "others": [{"body": "hard", "shift_m": [0, 0, 2]}]}, ".others: bar has"),
        ({"others": [{"body": "cloth", "shift_m": [0, 0, 2]}]}, ".others: bar has thickness_m 0 and cloth 0.001;"),
        (STROKE | {"held": False}, ".integrator is touching, .* nothing holds the body; choose backward_euler"),
        (STROKE | {"contact": {"instruments": [BALL]}}, ".integrator is touching, .* no instrument moves; choose"),
        (
            STROKE | {"contact": STROKE["contact"] | {"self_contact": True}},
            ".integrator is touching, .* touch each other or themselves",
        ),
        (STROKE | {"start": "inverted"}, ".integrator is touching, .* the start is inverted; choose backward_euler"),
        (STROKE | {"contact": STROKE["contact"] | {"push_out": True}}, ".*contact pushes out what overlaps;"),
        (STROKE | {"body_springs": {}}, ".* no part for body_springs"),
        (STROKE | {"volume": {}}, ".* no part for volume;"),
        ({"integrator": "xpbd", "body_springs": {}}, ".integrator is xpbd, which has no part for body_springs; leave"),
        (STROKE | {"springs": {}}, ".integrator is touching, .* the elastic effect is springs; choose backward_euler"),
        ({"integrator": "xpbd"} | HOOKS, ".integrator is xpbd, which has no part for hooks; leave that out"),
        ({"hooks": [HOOKS["hooks"][0] | PULL]}, r".hooks\[0\] has shift_m and force_n; give one of them"),
        ({"hooks": [{"at_m": [3, 1, 1]}]}, r".hooks\[0\] lacks shift_m; add it"),
        ({"hooks": [HOOKS["hooks"][0] | LONG], "step_s": 0.7}, r".step_s is 0\.7, and hooks\[0\] lasts 0\.7 s, so"),
        ({"threads": []}, r".threads is \[\]: "),
        (SHAPES | {"body": "spotted"}, ": spotted has regions, and shape_matching has one stiffness; take finite"),
    ],
)
def test_effects_that_do_not_are_refused_in_one_sentence(scene, said):
    with pytest.raises(InputError, match=rf"^my\.yaml: scenes\.s{said}") as caught:
        check(scene)
    assert str(caught.value)[-1] in ".?" and "\n" not in str(caught.value)


FACE = {"anchors": {"plane": {"axis": "x", "side": "min", "depth_m": 0.01}}}
ACTING = {"gravity": GRAVITY, "push": PUSH, "plasticity": YIELD, "prony": SERIES, "rayleigh": {"rayleigh": {}}}
ACTING |= {"hooks": HOOKS, "threads": {"threads": [{"ends_m": [[3, 1, 1], [2, 0, 1]]}]}}
ACTING |= {"velocity_damping": {"velocity_damping": {}}, "contact": {"contact": STROKE["contact"]}}


@pytest.mark.parametrize("integrator", [name for name in INTEGRATORS if name != "goal_position"])
@pytest.mark.parametrize("effect", ACTING)
def test_an_effect_is_refused_when_planned_if_its_integrator_refuses_it(integrator, effect, monkeypatch):
    monkeypatch.setattr(strokes, "BESIDE", ((0.0, 0.0, 0.0),))
    monkeypatch.setattr(strokes, "LEAST_STEPS", 4)
    entry = SCENE | {"duration_s": 0.02, "integrator": integrator} | ACTING[effect]
    entry |= {"contact": STROKE["contact"]} if integrator == "touching" else {}
    try:
        scene = check(entry).scenes["s"]
        planned = False
    except InputError as error:
        assert str(error).startswith(f"my.yaml: scenes.s.integrator is {integrator}, which has no part for {effect}; ")
        planned, scene = True, Scene(**entry)
    try:
        run(scene.but(substeps="auto"), particles_of(made("bar", BAR | FACE), 0, surface=False))
        refused = False
    except InputError as error:
        assert effect in str(error)
        refused = True
    assert planned == refused


def test_the_check_imports_no_effect_and_no_solver():
    code = "import sys, palpate.scenes.scene_check; print([m for m in sys.modules if m.startswith('palpate.')])"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert "scene_check" in found and "palpate.solvers" not in found
    assert {name for name in found.split("'") if name.startswith("palpate.effects.")} == {"palpate.effects.settings"}
