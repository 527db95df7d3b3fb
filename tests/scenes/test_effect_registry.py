"""An effect is added to palpate with one line of its registry."""

from dataclasses import replace

import numpy as np
from palpate.scenes.scene import Scene

from palpate.bodies.particles import particles_of
from palpate.scenes import effect_registry
from palpate.scenes.effect_registry import EFFECTS, INTEGRATORS, Entry
from palpate.scenes.run_scene import compose, decisions, run

WIND = """
class Wind:
    outer = True

    def __init__(self, force_n):
        self._force_n = force_n

    def add_force(self, x, v, force):
        force[:, 0] += self._force_n


def make(particles, settings, elastic):
    return Wind(settings["force_n"])
"""
SCENE = Scene("s", "auto", "backward_euler", 0.01, 0.05, settings={"wind": {"force_n": 1e-3}})


def test_one_line_adds_an_effect_and_a_default_makes_its_block_optional(monkeypatch, tmp_path, slab):
    (tmp_path / "wind_of_a_test.py").write_text(WIND)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setitem(EFFECTS, "wind", Entry("wind_of_a_test"))
    particles = particles_of(slab, 0, surface=False)
    moved = run(SCENE, particles).motion.positions[-1] - particles.nodes
    assert moved[:, 0].max() > 1e-6
    table = decisions(replace(SCENE, settings={}), particles).set_index("effect")
    assert not table.loc["wind", "called"]
    assert list(compose(replace(SCENE, settings={}), particles).effects) == ["corotational", "held"]
    monkeypatch.setitem(EFFECTS, "wind", Entry("wind_of_a_test", settings={"force_n": 2.0}))
    system = compose(replace(SCENE, effects=["corotational", "wind"], settings={}), particles)
    force = system.outer_force(particles.nodes, np.zeros_like(particles.nodes))
    assert (force[:, 0] == 2.0).all()


def test_every_entry_can_be_imported_and_every_elastic_effect_has_a_damping_that_suits_it():
    assert all(callable(effect_registry.effect(name).make) for name in EFFECTS)
    assert all(callable(effect_registry.integrator(name).make) for name in INTEGRATORS)
    assert {EFFECTS[name].damping for name in effect_registry.ELASTIC} <= set(effect_registry.DAMPINGS)
