"""Stability limit of the explicit steps of a search, for the stiffest springs that it may use."""

import numpy as np

from palpate.bodies.particles import Particles
from palpate.effects.effect import Effect
from palpate.effects.held import Held
from palpate.effects.kelvin import Kelvin
from palpate.effects.springs import Springs
from palpate.effects.volume_force import Volume
from palpate.errors import InputError
from palpate.models.springs.calibration.fitness import Range
from palpate.models.springs.calibration.spring_model import SpringModel
from palpate.models.springs.calibration.spring_motion import Settings, stiffnesses
from palpate.solvers.system import System, stable_step


def step_limit(particles: Particles, model: SpringModel, settings: Settings, young_pa: float) -> float:
    """Compute the longest step [s] that is stable about rest when all moduli are ``young_pa`` [Pa]."""
    stiffness = stiffnesses(model, np.full(len(model.masses), float(young_pa)))
    springs = Springs(model.pairs, stiffness, model.rest_m)
    effects: dict[str, Effect] = {"springs": springs, "kelvin": Kelvin(springs, model.masses, settings.damping_ratio)}
    if settings.volume_n_m > 0.0:
        effects["volume"] = Volume(particles, settings.volume_n_m)
    if len(model.held):
        effects["held"] = Held(model.held)
    return stable_step(System(particles, effects))


def check_step(particles: Particles, model: SpringModel, settings: Settings, limits: Range) -> None:
    """Raise InputError if the step is too long for the stiffest springs of ``limits``; softer ones are slower."""
    limit = step_limit(particles, model, settings, limits.high_pa)
    if settings.step_s > limit:
        raise InputError(
            f"springs.step_s is {settings.step_s:g} s, and springs of {limits.high_pa:g} Pa are stable up to "
            f"{limit:.3g} s only; take a shorter step, or lower springs.young_pa."
        )
