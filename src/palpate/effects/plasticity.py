"""Lasting deformation: the plasticity that suits the elastic effect."""

from typing import Any

from palpate.bodies.particles import Particles
from palpate.effects.effect import Effect, Goals, offers


def make(particles: Particles, settings: dict, elastic: Any) -> Effect:
    """Make the plastic flow of shape-matching clusters or of corotational finite elements.

    settings : ``yield_strain`` (elastic strain above which the body flows), ``creep_1_s`` [1/s], ``max_strain`` (upper
        bound of the plastic strain)
    """
    has_goals = offers(elastic, Goals)
    if has_goals:
        from palpate.effects.shape_plasticity import ShapePlasticity

        return ShapePlasticity(settings, elastic)
    from palpate.effects.fem_plasticity import FemPlasticity

    return FemPlasticity(elastic, settings["yield_strain"], settings["creep_1_s"], settings["max_strain"])
