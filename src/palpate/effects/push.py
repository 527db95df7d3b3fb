"""Loads that increase, stay constant and decrease over time."""

from collections.abc import Sequence

import numpy as np

from palpate.bodies.mesh import Mesh, area_normals
from palpate.bodies.particles import Particles
from palpate.effects import settings
from palpate.effects.effect import Effect, Load, Time
from palpate.effects.patch_load import Patch, containing, course, load_point, patch_shares


def make(particles: Particles, push: settings.Push, elastic: Effect | None) -> "Push":
    """Make the loads of ``push`` on the discs of ``placed``; the same errors."""
    return Push(particles, placed(particles, particles.held, particles.name, push.loads))


def placed(mesh: Mesh, held: np.ndarray, name: str, loads: Sequence[settings.Load]) -> list[settings.Load]:
    """Return ``loads`` with ``at_m`` on the surface at rest, at the nearest point, and the outward ``normal`` there.

    held : nodes of ``mesh`` that do not move; name : the body's, for messages
    A load with a ``normal`` is returned as it is, so that the surface of one level places it for all levels of a body.
    Raises InputError for a load off the surface, of a radius beyond the body's size, or on held nodes.
    """
    on_surface = []
    for i, load in enumerate(loads):
        if load.normal is None:
            corners, weights = load_point(mesh, held, f"{name}: push.loads[{i}]", load)
            if (weights == 1.0).any():
                normal = mesh.normals[corners[weights.argmax()]]
            else:
                normal = area_normals(mesh.nodes, mesh.triangles[containing(mesh.triangles, corners, weights)]).sum(
                    axis=0
                )
                normal /= np.linalg.norm(normal)
            at_m = (weights @ mesh.nodes[corners]).tolist()
            load = load.model_copy(update={"at_m": at_m, "normal": normal.tolist()})
        on_surface.append(load)
    return on_surface


def disc(load: settings.Load) -> Patch:
    """Return the disc of a load that is ``placed``."""
    return Patch(np.array(load.at_m, dtype=float), np.array(load.normal, dtype=float), load.radius_m)


def factor(load: settings.Load, t: float) -> float:
    """Return the factor of ``force_n`` at ``t`` [s].

    From ``start_s`` it rises to 1 over ``press_s``, stays over ``hold_s`` and falls to 0 over ``release_s``.
    """
    return course(t - load.start_s, load.press_s, load.hold_s, load.release_s)


class Push(Load, Time):
    """Σ factor(t) · force: dead loads, of constant direction, that are ``placed``.

    Each ``force_n`` (3,) [N] is a pressure over a disc of ``radius_m``, as ``patch_shares`` distributes it over linear
    shape functions of ``mesh`` or, of ``order`` 2, quadratic ones (0: a point); its share on held nodes is lost to the
    anchors. All loads are zero until ``at`` is called.
    """

    outer = True

    def __init__(self, mesh: Mesh, loads: Sequence[settings.Load], order: int = 1):
        self._loads = loads
        spread = (patch_shares(mesh, disc(load), order) for load in loads)
        # the nodes (k,) of each, and its forces (k, 3) [N] on them at the factor 1
        self.parts = [
            (nodes, np.outer(shares, np.array(load.force_n, dtype=float)))
            for load, (nodes, shares) in zip(loads, spread, strict=True)
        ]
        self._factors = [0.0] * len(loads)

    def at(self, t: float) -> None:
        self._factors = [factor(load, t) for load in self._loads]

    def add_force(self, x: np.ndarray, v: np.ndarray, force: np.ndarray) -> None:
        for (nodes, forces), factor in zip(self.parts, self._factors, strict=True):
            if factor:
                force[nodes] += factor * forces
