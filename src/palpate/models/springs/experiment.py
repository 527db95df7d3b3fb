"""Paper 2's experiment: its cube, pressed on three faces, and its motion by finite elements."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from palpate.bodies.material import Material
from palpate.bodies.particles import Particles, solid_particles
from palpate.files import write_whole
from palpate.models.springs import spring_motion
from palpate.models.springs.fitness import Fitness, Range, check_step, volume_stiffness
from palpate.models.springs.paper_cube import FACES, middle, paper_cube
from palpate.models.springs.spring_motion import Press, Settings, SpringModel

Motion = tuple[np.ndarray, np.ndarray]
"""Positions [m] and velocities [m/s] of the key points after each step, both (steps, p, 3)."""


@dataclass(frozen=True, eq=False)
class Experiment:
    """The presses that springs are fitted to, and the settings of their motion; ``with_volume`` adds a volume force."""

    particles: Particles
    model: SpringModel
    presses: dict[str, Press]
    settings: Settings
    limits: Range

    def start(self) -> np.ndarray:
        """Return the start of iterative searches: the geometric mean of the range's ends at each node, (n,) [Pa]."""
        return np.full(len(self.model.masses), np.sqrt(self.limits.low_pa * self.limits.high_pa))

    def with_volume(self, stiffness_n_m: float) -> "Experiment":
        """Return the experiment with a volume force of this stiffness; raises InputError if the step is too long."""
        settings = replace(self.settings, volume_n_m=stiffness_n_m)
        check_step(self.particles, self.model, settings, self.limits)
        return replace(self, settings=settings)

    def volume_n_m(self) -> float:
        """Return the stiffness [N/m] at which the springs have the bulk modulus of the material."""
        return volume_stiffness(self.model, self.particles.material)

    def fitness(self, press: str, references: dict[str, Motion]) -> Fitness:
        """Return the fitness function of one press against its reference."""
        return Fitness(self.model, self.presses[press], self.settings, *references[press])


def experiment(block: dict, poisson: float) -> Experiment:
    """Build the experiment that the config describes, with a reference of this Poisson ratio.

    block : the config's block ``springs``
    Raises InputError if a key point is outside the cube, or the step is too long.
    """
    mesh = paper_cube(block["side_m"])
    material = Material(block["material"]["young_pa"], poisson, block["material"]["density_kg_m3"])
    particles = solid_particles(mesh, np.flatnonzero(mesh.nodes[:, 2] == 0.0), material, "paper 2's cube")
    presses = {}
    for face in FACES:
        node, inward = middle(mesh, face)
        presses[face] = Press(face, node, block["force_n"] * inward, block["rise_s"])
    keys = spring_motion.key_points(mesh.nodes, mesh.tetrahedra, block["key_points_m"])
    steps = round(block["duration_s"] / block["step_s"])
    settings = Settings(block["step_s"], steps, block["damping_ratio"], keys)
    model = spring_motion.spring_model(particles)
    found = Experiment(particles, model, presses, settings, Range(*block["young_pa"]))
    return found.with_volume(0.0)  # which checks the step


def simulate_references(experiment: Experiment, substeps: int) -> dict[str, Motion]:
    """Simulate the motion of finite elements under each press."""
    particles, model, settings = experiment.particles, experiment.model, experiment.settings
    return {
        name: spring_motion.reference_motion(particles, model, press, settings, substeps)
        for name, press in experiment.presses.items()
    }


def save_references(references: dict[str, Motion], path: str | Path) -> None:
    """Write all motions to one file."""
    arrays: dict[str, Any] = {}
    for name, (x, v) in references.items():
        arrays |= {f"{name}_x": x, f"{name}_v": v}
    with write_whole(path) as part, open(part, "wb") as file:
        np.savez(file, **arrays)


def load_references(path: str | Path) -> dict[str, Motion]:
    """Read the motions that ``save_references`` wrote."""
    with np.load(path) as file:
        return {name: (file[f"{name}_x"], file[f"{name}_v"]) for name in FACES}
