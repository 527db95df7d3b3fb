"""Every effect and integrator of the registry can be made, and a scene has a field for each effect."""

from palpate.scenes import effect_registry
from palpate.scenes.effect_registry import EFFECTS, INTEGRATORS
from palpate.scenes.settings import Scene

OF_THE_BODY = {"bed", "triangles", *effect_registry.FINITE_ELEMENTS}
"""Effects that a scene has no field for."""


def test_every_entry_can_be_imported_and_is_a_field_unless_the_body_says_it():
    assert all(callable(effect_registry.effect(name).make) for name in EFFECTS)
    assert all(callable(effect_registry.integrator(name).make) for name in INTEGRATORS)
    assert set(EFFECTS) - set(Scene.model_fields) == OF_THE_BODY
