"""Paper 2's experiment: its cube, pressed on three faces, and how finite elements move then."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from palpate.bodies.body import Material
from palpate.bodies.particles import Particles, solid_particles
from palpate.calibration.closed_forms import volume_stiffness
from palpate.calibration.fem_motion import reference_motion
from palpate.calibration.fitness import Fitness, Range
from palpate.calibration.paper_cube import FACES, middle, paper_cube
from palpate.calibration.spring_model import Press, SpringModel, key_points, spring_model
from palpate.calibration.spring_motion import Settings
from palpate.calibration.step_limit import check_step
from palpate.errors import InputError
from palpate.files import write_whole

Motion = tuple[np.ndarray, np.ndarray]
"""Positions [m] and velocities [m/s] of the key points after each step, both (steps, p, 3)."""


@dataclass(frozen=True, eq=False)
class Experiment:
    """What springs are fitted to, and how their motion is computed; the volume force comes with ``with_volume``."""

    particles: Particles
    model: SpringModel
    presses: dict[str, Press]
    settings: Settings
    limits: Range

    def start(self) -> np.ndarray:
        """Where searches begin that need a start: the geometric middle of the range at each node, (n,) [Pa]."""
        return np.full(len(self.model.masses), np.sqrt(self.limits.low_pa * self.limits.high_pa))

    def with_volume(self, stiffness_n_m: float) -> "Experiment":
        """The same with a volume force of this stiffness; InputError if the step is too long for it."""
        settings = replace(self.settings, volume_n_m=stiffness_n_m)
        check_step(self.particles, self.model, settings, self.limits)
        return replace(self, settings=settings)

    def volume_n_m(self) -> float:
        """The stiffness that gives springs the bulk modulus of the material."""
        return volume_stiffness(self.model, self.particles.material)

    def fitness(self, press: str, references: dict[str, Motion]) -> Fitness:
        """How well springs follow the reference of one press."""
        return Fitness(self.model, self.presses[press], self.settings, *references[press])


def experiment(calibration: dict, poisson: float) -> Experiment:
    """The experiment that the config describes, with a reference of this Poisson ratio.

    calibration : the config's block of this name
    Raises InputError if the range is empty, a key point outside the cube, or the step too long.
    """
    mesh = paper_cube(calibration["side_m"])
    material = Material(calibration["material"]["young_pa"], poisson, calibration["material"]["density_kg_m3"])
    particles = solid_particles(mesh, np.flatnonzero(mesh.nodes[:, 2] == 0.0), material, "paper 2's cube")
    presses = {}
    for face in FACES:
        node, inward = middle(mesh, face)
        presses[face] = Press(face, node, calibration["force_n"] * inward, calibration["rise_s"])
    keys = key_points(mesh.nodes, mesh.tetrahedra, calibration["key_points_m"], "calibration.key_points_m")
    steps = round(calibration["duration_s"] / calibration["step_s"])
    if steps < 1:
        raise InputError(
            f"calibration.duration_s is {calibration['duration_s']:g} s and a step {calibration['step_s']:g} s; "
            "give the time of one step at least."
        )
    settings = Settings(calibration["step_s"], steps, calibration["damping_ratio"], keys)
    limits = Range(*calibration["young_pa"])
    found = Experiment(particles, spring_model(particles), presses, settings, limits)
    check_step(particles, found.model, settings, limits)
    return found


def simulate_references(found: Experiment, substeps: int) -> dict[str, Motion]:
    """How finite elements move under each press."""
    return {
        name: reference_motion(found.particles, found.model, press, found.settings, substeps)
        for name, press in found.presses.items()
    }


def save_references(references: dict[str, Motion], path: str | Path) -> None:
    """Write all motions to one file."""
    arrays = {f"{name}_{kind}": a for name, pair in references.items() for kind, a in zip("xv", pair, strict=True)}
    with write_whole(path) as part, open(part, "wb") as file:
        np.savez(file, **arrays)


def load_references(path: str | Path) -> dict[str, Motion]:
    """What ``save_references`` wrote."""
    with np.load(path) as file:
        return {name: (file[f"{name}_x"], file[f"{name}_v"]) for name in FACES}
