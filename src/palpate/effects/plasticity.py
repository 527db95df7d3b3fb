"""Lasting deformation: which plasticity fits the elastic effect."""

from palpate.bodies.particles import Particles
from palpate.errors import InputError


def make(particles: Particles, settings: dict, elastic):
    """Plastic flow of finite elements or of shape-matching clusters; InputError for springs and triangles.

    settings : ``yield_strain`` (elastic strain up to which nothing flows), ``creep_1_s`` [1/s], ``max_strain``
        (plastic strain that is never exceeded)
    """
    if hasattr(elastic, "goals"):
        from palpate.effects.shape_matching.shape_plasticity import ShapePlasticity

        return ShapePlasticity(particles, settings, elastic)
    from palpate.effects.corotational import Corotational

    if isinstance(elastic, Corotational):
        from palpate.effects.fem_plasticity import FemPlasticity

        return FemPlasticity(elastic, settings["yield_strain"], settings["creep_1_s"], settings["max_strain"])
    raise InputError(
        f"{particles.name}: plasticity is not offered for springs and triangles; "
        "choose corotational or shape_matching, or leave it out."
    )
