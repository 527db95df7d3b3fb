"""A held body reduced to modes: what a push at some places, its weight and free swinging make of it."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import sparse

from palpate.bodies.particles import Particles
from palpate.effects import push
from palpate.effects.effect import Weight
from palpate.effects.linear_elements import LinearElements
from palpate.errors import InputError
from palpate.linalg.multigrid import Factor
from palpate.models.reduction.averaged_cells import AveragedCells
from palpate.models.reduction.motion_modes import Solve, bends, orthonormal, uncoupled
from palpate.models.reduction.vibration import vibrations
from palpate.solvers.system import System

AT_ONCE = {"start_s": 0.0, "press_s": 0.0, "hold_s": np.inf, "release_s": 0.0}


@dataclass(frozen=True, eq=False)
class ReducedBody:
    """Modes in which neither mass nor stiffness couples coordinates, and the cells that give the elastic energy.

    modes : (3n, r), with φᵀKφ = 1, so that coordinates are in √J; masses : (r,), φᵀMφ
    """

    modes: np.ndarray
    masses: np.ndarray
    cells: AveragedCells

    @classmethod
    def of(cls, system: System, settings: dict[str, Any]) -> "ReducedBody":
        """Reduce a body at rest; ``settings`` are the scene's block ``reduced``.

        vibrations : number of vibration modes; bent : how many of them get second-order modes, with those of weight
        places : discs {at_m, radius_m} that a push gets modes for: three for unit forces, and six of second order
        coarsened : levels by which cells are coarser than elements
        InputError if nothing is held, for a place that cannot be pressed, and for more modes than coordinates.
        """
        elastic, particles = system.elastic, system.particles
        assert isinstance(elastic, LinearElements)  # as ``make`` of the integrator asks for
        if system.free.all():
            raise InputError("it needs a body that is held, as one that is not drifts out of all modes; choose bdf2.")
        stiffness = system.stiffness(particles.nodes, definite=True)
        assert stiffness is not None  # finite elements have one
        system.hold(stiffness)
        solve = _solver(stiffness, system.free)
        swinging, _ = vibrations(solve, particles.masses, system.free, settings["vibrations"])
        loads = [*_unit_pushes(particles, settings["places"]), *_unit_weights(system)]
        groups = [np.concatenate([_answers(solve, each), swinging[: settings["bent"]]]) for each in loads]
        size = particles.size
        second = [bends(elastic, particles.nodes, solve, each, size) for each in groups if len(each)]
        matrix = stiffness.tocsr()
        modes, masses = uncoupled(orthonormal([swinging, *groups, *second], matrix), particles.masses * system.free)
        return cls(modes, masses, AveragedCells(elastic, modes, matrix, settings["coarsened"]))

    @property
    def count(self) -> int:
        """The number of modes."""
        return len(self.masses)

    def project(self, force: np.ndarray) -> np.ndarray:
        """Return the share (r,) of a force (n, 3) [N] in each mode."""
        return force.ravel() @ self.modes

    def expand(self, q: np.ndarray) -> np.ndarray:
        """Return displacements (n, 3) [m] at coordinates ``q`` (r,), or velocities of their rates."""
        return (self.modes @ q).reshape(-1, 3)


def _solver(stiffness: sparse.bsr_array, free: np.ndarray) -> Solve:
    """Factorise ``stiffness``, whose held rows are those of the identity; forces on held nodes have no effect."""
    factor = Factor(stiffness)
    return lambda force: factor.solve(np.where(free[:, None], force, 0.0))


def _answers(solve: Solve, forces: np.ndarray) -> np.ndarray:
    """Return linear answers (k, n, 3) [m] to ``forces`` (k, n, 3) [N]."""
    return np.array([solve(force) for force in forces]).reshape(forces.shape)


def _unit_pushes(particles: Particles, places: list[dict]) -> list[np.ndarray]:
    """Return for each place the nodal forces (3, n, 3) [N] of 1 N along x, y and z; InputError as ``push.make``."""
    found = []
    for place in places:
        forces = np.zeros((3, *particles.nodes.shape))
        for unit, force in zip(np.eye(3), forces, strict=True):
            load = push.make(particles, {"loads": [place | AT_ONCE | {"force_n": unit}]}, None)
            load.at(0.0)
            load.add_force(particles.nodes, force, force)
        found.append(forces)
    return found


def _unit_weights(system: System) -> list[np.ndarray]:
    """Return the forces (3, n, 3) [N] of 1 m/s² along x, y and z, if a weight acts."""
    return [system.masses[None, :, None] * np.eye(3)[:, None, :] for _ in system.offering(Weight)]
