"""Effects offer exactly the hooks that they name, and the description of hooks costs nothing to import."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from palpate.bodies.cutting.settings import Cut, PlaneSettings
from palpate.bodies.cutting.ties import cut_particles
from palpate.bodies.material import NAMED, Material, kind_of
from palpate.bodies.particles import Particles, particles_of
from palpate.bodies.supports import Bed
from palpate.effects import effect as hooks
from palpate.effects import settings as blocks
from palpate.effects.effect import HOOKS, incomplete, is_load, members, offers
from palpate.scenes import effect_registry

AT, SOON = [0.2, 0.1, 0.08], {"radius_m": 0.05, "hold_s": 1, "release_s": 0}
HOOK = blocks.Hook(at_m=AT, pull_s=0, shift_m=[0, 0, 0.01], **SOON)
SETTINGS = {
    "gravity": blocks.Gravity(acceleration_m_s2=[0, 0, -9.81]),
    "push": blocks.Push(loads=[blocks.Load(at_m=AT, force_n=[0, 0, -1], press_s=0, **SOON)]),
    "hooks": [HOOK, HOOK.but(shift_m=None, force_n=[0, 0, 1])],
    "threads": [blocks.Thread(ends_m=[AT, [0.1, 0.1, 0.08]])],
    "contact": blocks.Contact(),
    "volume": blocks.Volume(stiffness_n_m=30.0),
    "body_springs": blocks.BodySprings(stiffness_n_m=40.0),
    "rayleigh": blocks.Rayleigh(),
    "kelvin": blocks.Kelvin(),
    "maxwell": blocks.Maxwell(stiffness_ratio=0.5, relaxation_s=0.1),
    "velocity_damping": blocks.VelocityDamping(),
    "plasticity": blocks.Plasticity(yield_strain=0.05, max_strain=0.5),
    "prony": blocks.Prony(shares=[0.5], times_s=[0.1]),
    "shape_matching": blocks.ShapeMatching(),
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
        plane = PlaneSettings(point_m=slab.coarse.nodes.mean(axis=0), normal=[1, 0, 0])
        particles = cut_particles("scene", slab, 0, Cut(plane=plane))
    if name in effect_registry.FINITE_ELEMENTS:
        own = str(Path(__file__).parents[2] / "examples/hencky.py")
        law = next((law for law in NAMED if kind_of(law) == name), own)
        particles = replace(particles, material=replace(particles.material, law=law))
    elastic = None
    if effect_registry.EFFECTS[name].role != "elastic":
        elastic = made(ELASTIC.get(name, "corotational"), slab)
    return effect_registry.effect(name).make(particles, SETTINGS.get(name), elastic)


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
