"""Effects offer exactly the hooks that they name, and the description of hooks costs nothing to import."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from palpate.bodies.cutting.ties import cut_particles
from palpate.bodies.material import NAMED, Material, kind_of
from palpate.bodies.particles import Particles, particles_of
from palpate.bodies.supports import Bed
from palpate.effects import effect as hooks
from palpate.effects.effect import HOOKS, incomplete, is_load, members, offers
from palpate.scenes import effect_registry

LOAD = {"at_m": [0.2, 0.1, 0.08], "force_n": [0, 0, -1], "radius_m": 0.05}
LOAD |= {"start_s": 0, "press_s": 0, "hold_s": 1, "release_s": 0}
SETTINGS = {
    "gravity": {"acceleration_m_s2": [0, 0, -9.81]},
    "push": {"loads": [LOAD]},
    "hooks": [
        {"at_m": [0.2, 0.1, 0.08], "radius_m": 0.05, "start_s": 0, "pull_s": 0, "hold_s": 1, "release_s": 0} | way
        for way in ({"shift_m": [0, 0, 0.01]}, {"force_n": [0, 0, 1]})
    ],
    "threads": [
        {
            "ends_m": [[0.2, 0.1, 0.08], [0.1, 0.1, 0.08]],
            "stiffness_n_m": 1,
            "start_s": 0,
            "tighten_s": 0,
            "tightened_to": 1,
        }
    ],
    "volume": {"stiffness_n_m": 30.0},
    "body_springs": {"stiffness_n_m": 40.0, "damping_ratio": 0.1},
    "maxwell": {"stiffness_ratio": 0.5, "relaxation_s": 0.1},
    "plasticity": {"yield_strain": 0.05, "creep_1_s": 10.0, "max_strain": 0.5},
    "prony": {"shares": [0.5], "times_s": [0.1]},
    "shape_matching": {"mode": "linear", "alpha": 0.5, "beta": 0.5, "clusters": {"kind": "one"}},
}
ELASTIC = {"kelvin": "springs", "maxwell": "springs", "bending": "triangles"}


def made(name: str, slab) -> object:
    """Make one of the registered effects."""
    body = replace(slab, bed=Bed(slab.coarse.nodes[0], 0.1, 1e4)) if name == "bed" else slab
    particles = particles_of(body, 0, surface=False)
    if name in ("triangles", "bending"):
        nodes = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
        triangles, none = np.array([[0, 1, 2], [0, 2, 3]]), np.empty((0, 4), dtype=int)
        particles = Particles("sheet", nodes, np.ones(4), np.array([0]), triangles, none, Material(1e3, 0.3, 1e3), 1e-3)
    if name == "cut":
        plane = {"point_m": slab.coarse.nodes.mean(axis=0), "normal": [1, 0, 0]}
        particles = cut_particles("scene", slab, 0, {"plane": plane, "at_s": 0.0, "lasts_s": 0.0, "way": "conform"})
    entry, settings = effect_registry.EFFECTS[name], SETTINGS.get(name)
    if name in effect_registry.FINITE_ELEMENTS:
        own = str(Path(__file__).parents[2] / "examples/hencky.py")
        law = next((law for law in NAMED if kind_of(law) == name), own)
        particles = replace(particles, material=replace(particles.material, law=law))
    elastic = None
    if entry.role != "elastic":
        elastic = made(ELASTIC.get(name, "corotational"), slab)
    return effect_registry.effect(name).make(particles, settings or dict(entry.settings or {}), elastic)


@pytest.mark.parametrize("name", effect_registry.EFFECTS)
def test_an_effect_offers_what_it_names_and_nothing_else(name, slab):
    effect = made(name, slab)
    offered = {hook.__name__ for hook in HOOKS if offers(effect, hook)}
    assert offered == {hook.__name__ for hook in HOOKS if hook in type(effect).__mro__}
    assert offered
    assert incomplete(effect) == ""
    assert is_load(effect) == (name == "push")


def test_every_hook_is_listed_and_begins_with_its_own_member():
    described = {
        value
        for value in vars(hooks).values()
        if getattr(value, "_is_protocol", False) and value.__module__ == hooks.__name__
    }
    assert set(HOOKS) == described - {hooks.Effect, hooks.Rigid}
    assert len({members(hook)[0] for hook in HOOKS}) == len(HOOKS)
    assert members(hooks.Goals) == ("goals", "alpha")
    assert members(hooks.Stiffness) == ("add_stiffness", "couples")


def test_a_hook_needs_all_of_its_members():
    assert offers(SimpleNamespace(add_damping=print, couples=[]), hooks.Damping)
    assert not offers(SimpleNamespace(add_damping=print), hooks.Damping)
    assert incomplete(SimpleNamespace(add_damping=print)) == "add_damping and no couples"
    assert incomplete(SimpleNamespace(energy=print)) == "energy and no add_force"
    assert incomplete(SimpleNamespace(add_force=print, observe=print)) == ""
    assert not is_load(SimpleNamespace(add_force=print, outer=False))


def test_the_description_of_hooks_imports_nothing_heavy():
    look = "import sys, palpate.effects.effect; print(*{m.split('.')[0] for m in sys.modules})"
    done = subprocess.run([sys.executable, "-c", look], capture_output=True, text=True, check=True)
    assert not {"pandas", "scipy", "numba", "skfem"} & set(done.stdout.split())
