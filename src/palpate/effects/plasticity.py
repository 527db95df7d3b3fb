"""Lasting deformation: the plasticity that suits the elastic effect."""

from typing import Any

from palpate.bodies.particles import Particles
from palpate.effects import settings
from palpate.effects.effect import Effect, Goals, offers


def make(particles: Particles, plasticity: settings.Plasticity, elastic: Any) -> Effect:
    """Make the plastic flow of shape-matching clusters or of corotational finite elements."""
    has_goals = offers(elastic, Goals)  # in the condition itself it would narrow the type to Goals
    if has_goals:
        from palpate.effects.shape_plasticity import ShapePlasticity

        return ShapePlasticity(plasticity, elastic)
    from palpate.effects.fem_plasticity import FemPlasticity

    return FemPlasticity(elastic, plasticity.yield_strain, plasticity.creep_1_s, plasticity.max_strain)
