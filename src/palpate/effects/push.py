"""Loads that are pressed on, held and released."""

import numpy as np

from palpate.bodies.particles import Particles
from palpate.effects.patch_load import disc_weights
from palpate.errors import InputError


def make(particles: Particles, settings: dict, elastic) -> "Push":
    """The loads of ``settings["loads"]``, each on the surface node nearest to its ``at_m`` (3,) [m] at rest.

    Raises InputError for a load farther from the body than the body is long, and for one on a held node.
    """
    return Push([_Load(particles, _contact(particles, i, load), load) for i, load in enumerate(settings["loads"])])


class Push:
    """Σ factor(t) · force: dead loads, whose direction does not follow the surface.

    Each ``force_n`` (3,) [N] spreads over a disc of ``radius_m`` as ``disc_weights`` has it (0: one node); what falls
    on held nodes goes into the anchors. Before ``at`` is told a time, nothing presses.
    """

    outer = True

    def __init__(self, loads: list["_Load"]):
        self._loads = loads
        self._factors = [0.0] * len(loads)

    def at(self, t: float) -> None:
        """Set how hard each load presses at time ``t`` [s]."""
        self._factors = [load.factor(t) for load in self._loads]

    def add_force(self, x: np.ndarray, v: np.ndarray, force: np.ndarray) -> None:
        """Add the loads to ``force`` (n, 3) [N]."""
        for load, factor in zip(self._loads, self._factors, strict=True):
            if factor:
                force[load.nodes] += factor * load.forces


class _Load:
    """One load: ``forces`` (k, 3) [N] on ``nodes`` (k,) when fully pressed."""

    def __init__(self, particles: Particles, contact: int, load: dict):
        weights = disc_weights(particles, contact, load["radius_m"])
        self.nodes = np.flatnonzero(weights)
        self.forces = np.outer(weights[self.nodes], np.array(load["force_n"], dtype=float))
        self._start, self._press = load["start_s"], load["press_s"]
        self._full = self._press + load["hold_s"]
        self._release = load["release_s"]

    def factor(self, t: float) -> float:
        """Up over ``press_s``, 1 over ``hold_s``, down over ``release_s``, each ramp 3q² − 2q³ without a kink: a
        sudden change would set off waves that say more of the load than of the body."""
        since = t - self._start
        return _ramp(since, self._press) - _ramp(since - self._full, self._release)


def _ramp(t: float, duration: float) -> float:
    if t < 0.0:
        return 0.0
    q = min(t / duration, 1.0) if duration > 0.0 else 1.0
    return q * q * (3.0 - 2.0 * q)


def _contact(particles: Particles, i: int, load: dict) -> int:
    distance = np.linalg.norm(particles.nodes[particles.surface] - np.array(load["at_m"], dtype=float), axis=1)
    nearest = int(np.argmin(distance))
    if not distance[nearest] <= particles.size:
        raise InputError(
            f"{particles.name}: push.loads[{i}].at_m is {distance[nearest]:.3g} m from the body, which is "
            f"{particles.size:.3g} m long; give a point near its surface, in metres."
        )
    contact = int(particles.surface[nearest])
    if contact in particles.held:
        raise InputError(
            f"{particles.name}: push.loads[{i}].at_m is nearest to node {contact}, which is held; "
            "press farther from the anchors."
        )
    return contact
