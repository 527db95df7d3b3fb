"""Each shipped scene in a process of its own: what it does not name is not imported, not made, and not called."""

import json
import subprocess
import sys

import pytest
from fixtures.shipped import completed

from palpate.scenes.acting_effects import acting, assumed
from palpate.scenes.effect_registry import EFFECTS, INTEGRATORS
from palpate.setting_types import plain

CONFIG = completed()
RUN = """
import gc, json, sys
from pydantic import TypeAdapter
from palpate.bodies.make_body import make_body
from palpate.bodies.settings import Body
from palpate.scenes import run_scene as runs
from palpate.scenes.moved_particles import particles_in
from palpate.scenes.settings import Scene

entry, bodies = json.load(sys.stdin)
scene = Scene.model_validate(entry)
particles = particles_in(scene, [make_body(name, TypeAdapter(Body).validate_python(body)) for name, body in bodies])
systems, compose = [], runs.compose
runs.compose = lambda *arguments: systems.append(compose(*arguments)) or systems[-1]
done = runs.run(scene.but(duration_s=2 * scene.step_s), particles)
again = runs.run(scene.but(duration_s=2 * scene.step_s), particles)
gc.collect()
print(json.dumps({
    "steps": done.steps,
    "repeats": done.motion.positions.tobytes() == again.motion.positions.tobytes()
    and done.motion.energy.equals(again.motion.energy),
    "effects": list(systems[0].effects),
    "timed": list(done.effect_seconds),
    "alive": sorted({str(type(thing).__module__) for thing in gc.get_objects()}),
    "modules": sorted(sys.modules),
}))
"""


QUICK = ("cube_pile",)


@pytest.fixture(
    scope="module",
    params=[pytest.param(name, marks=[] if name in QUICK else pytest.mark.slow) for name in CONFIG.scenes],
)
def seen(request) -> dict:
    """What a process holds that has made two steps of a scene."""
    scene = CONFIG.scenes[request.param]
    named = acting(scene, assumed(scene, CONFIG.bodies[scene.body]))
    given = json.dumps([plain(scene), [[name, plain(CONFIG.bodies[name])] for name in scene.bodies]])
    done = subprocess.run([sys.executable, "-c", RUN], input=given, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout) | {"named": named, "integrator": scene.integrator}


def test_only_what_is_named_is_imported(seen):
    loaded = set(seen["modules"])
    assert {entry.module for entry in EFFECTS.values()} & loaded == {EFFECTS[name].module for name in seen["named"]}
    assert not [m for m in loaded if m.startswith("palpate.effects.laws.")]  # all are corotational, which needs none
    assert {name for name, module in INTEGRATORS.items() if module in loaded} == {seen["integrator"]}
    packages = {"enrichment", "evaluation", "figures"} | (set() if "contact" in seen["named"] else {"collision"})
    assert not [m for m in loaded if m.startswith("palpate.") and m.split(".")[1] in packages]
    assert not {"matplotlib", "pyvista", "snakemake"} & loaded


def test_only_what_is_named_is_made_and_called_and_repeats_to_the_bit(seen):
    assert seen["steps"] == 2 and seen["repeats"]
    assert seen["effects"] == seen["timed"] and sorted(seen["effects"]) == sorted(seen["named"])


def test_nothing_alive_is_of_what_is_not_named(seen):
    alive = {entry.module for entry in EFFECTS.values()} & set(seen["alive"])
    assert alive == {EFFECTS[name].module for name in seen["named"] if name != "plasticity"}
    # the one name with two makings, neither in its own module: the one that does not suit the elastic effect is absent
    makings = {"palpate.effects.fem_plasticity", "palpate.effects.shape_plasticity"}
    assert len(makings & set(seen["modules"])) == ("plasticity" in seen["named"])
