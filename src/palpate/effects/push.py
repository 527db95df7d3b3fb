"""Loads that increase, stay constant and decrease over time."""

import numpy as np

from palpate.bodies.particles import Particles
from palpate.effects.effect import Effect, Load, Time
from palpate.effects.patch_load import Patch, patch_shares
from palpate.errors import InputError


def make(particles: Particles, settings: dict, elastic: Effect | None) -> "Push":
    """Make the loads of ``settings["loads"]``, each on the surface node nearest to its ``at_m`` (3,) [m] at rest.

    Raises InputError for a load off the surface, of a radius beyond the body's size, or on a held node.
    """
    return Push([_Load(particles, _contact(particles, i, load), load) for i, load in enumerate(settings["loads"])])


class Push(Load, Time):
    """Σ factor(t) · force: dead loads, of constant direction.

    Each ``force_n`` (3,) [N] is a pressure over a disc of ``radius_m``, as ``patch_shares`` distributes it (0: one
    node); its share on held nodes is lost to the anchors. All loads are zero until ``at`` is called.
    """

    outer = True

    def __init__(self, loads: list["_Load"]):
        self._loads = loads
        self._factors = [0.0] * len(loads)

    def at(self, t: float) -> None:
        self._factors = [load.factor(t) for load in self._loads]

    def add_force(self, x: np.ndarray, v: np.ndarray, force: np.ndarray) -> None:
        for load, factor in zip(self._loads, self._factors, strict=True):
            if factor:
                force[load.nodes] += factor * load.forces


class _Load:
    """One load: ``forces`` (k, 3) [N] on ``nodes`` (k,) at the factor 1."""

    def __init__(self, particles: Particles, contact: int, load: dict):
        patch = Patch(particles.nodes[contact], particles.normals[contact], load["radius_m"])
        self.nodes, shares = patch_shares(particles, patch)
        self.forces = np.outer(shares, np.array(load["force_n"], dtype=float))
        self._start, self._press = load["start_s"], load["press_s"]
        self._full = self._press + load["hold_s"]
        self._release = load["release_s"]

    def factor(self, t: float) -> float:
        """Return the factor at ``t`` [s]: up over ``press_s``, 1 over ``hold_s``, down over ``release_s``.

        Each ramp is 3q² − 2q³, as a sudden change would excite waves.
        """
        since = t - self._start
        return _ramp(since, self._press) - _ramp(since - self._full, self._release)


def _ramp(t: float, duration: float) -> float:
    if t < 0.0:
        return 0.0
    q = min(t / duration, 1.0) if duration > 0.0 else 1.0
    return q * q * (3.0 - 2.0 * q)


OFF = 0.1
"""Share of the body's size by which a load may lie off its surface, beyond what lies between two nodes."""


def _contact(particles: Particles, i: int, load: dict) -> int:
    if load["radius_m"] > particles.size:
        raise InputError(
            f"{particles.name}: push.loads[{i}].radius_m is {load['radius_m']:g} m, and the whole body is "
            f"{particles.size:.3g} m long; give the radius of what presses it, in metres."
        )
    distance = np.linalg.norm(particles.nodes[particles.surface] - np.array(load["at_m"], dtype=float), axis=1)
    nearest = int(np.argmin(distance))
    contact = int(particles.surface[nearest])
    if not distance[nearest] <= OFF * particles.size + _between(particles, contact):
        raise InputError(
            f"{particles.name}: push.loads[{i}].at_m is {distance[nearest]:.3g} m from the nearest node of its "
            f"surface, {np.round(particles.nodes[contact], 4).tolist()}; give a point on the surface, in metres."
        )
    if contact in particles.held:
        raise InputError(
            f"{particles.name}: push.loads[{i}].at_m is nearest to node {contact}, which is held; "
            "press farther from the anchors."
        )
    return contact


def _between(particles: Particles, contact: int) -> float:
    """Return the largest distance [m] of a point of the triangles at a node from the nearest of their corners."""
    corners = particles.nodes[particles.triangles[(particles.triangles == contact).any(axis=1)]]
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    return float(edges.max(initial=0.0)) / np.sqrt(3.0)
