"""Lasting deformation: the plasticity that suits the elastic effect."""

from palpate.bodies.material import LAWS
from palpate.bodies.particles import Particles
from palpate.effects.effect import Effect, Goals, offers
from palpate.errors import InputError


def make(particles: Particles, settings: dict, elastic: Effect | None) -> Effect:
    """Make the plastic flow of finite elements or of shape-matching clusters; InputError for springs and triangles.

    settings : ``yield_strain`` (elastic strain above which the body flows), ``creep_1_s`` [1/s], ``max_strain`` (upper
        bound of the plastic strain)
    """
    if offers(elastic, Goals):
        from palpate.effects.shape_matching import ShapeMatching
        from palpate.effects.shape_plasticity import ShapePlasticity

        if isinstance(elastic, ShapeMatching):
            return ShapePlasticity(particles, settings, elastic)
    from palpate.effects.linear_elements import LinearElements

    if isinstance(elastic, LinearElements) and elastic.tissue.law == LAWS[0]:
        from palpate.effects.fem_plasticity import FemPlasticity

        return FemPlasticity(elastic, settings["yield_strain"], settings["creep_1_s"], settings["max_strain"])
    raise InputError(
        f"{particles.name}: plasticity is not offered for springs, triangles and other laws; "
        "choose corotational or shape_matching, or leave it out."
    )
