"""An organ that is pressed at some contacts: references of its motion, settings of its springs, and other masses."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy import sparse
from scipy.sparse.linalg import eigsh

from palpate.bodies.body import Body
from palpate.bodies.contacts import kept_contacts
from palpate.bodies.particles import Particles, particles_of
from palpate.bodies.refinement import finer
from palpate.effects.linear_elements import LinearElements
from palpate.effects.patch_load import nodal_load
from palpate.errors import InputError
from palpate.models.springs.fitness import Fitness, Range, step_limit, volume_stiffness
from palpate.models.springs.spring_motion import KeyPoints, Press, Settings, SpringModel, reference_motion, spring_model
from palpate.solvers.equilibrium import Equilibrium
from palpate.studies.organ_springs.settings import Settings as OrganSettings
from palpate.table_declaration import Table


class Reference(NamedTuple):
    """The motion that models are compared with: the limit of short steps, extrapolated from two lengths of steps.

    positions [m], velocities [m/s] : of all key points at the end of each frame, both (frames, p, 3)
    error : RMSE of the shorter steps over the peak, which the limit's own error is below
    """

    positions: np.ndarray
    velocities: np.ndarray
    error: float


RADIUS_M, PEAK_OF_SIZE, DAMPING_RATIO = 0.02, 0.05, 0.1
"""Radius [m] of the disc that is pressed; linear displacement of a press over the longest side; and damping of each
spring, relative to critical damping of its two nodes."""
YOUNG_OF_BODY = 0.3, 3
"""Least and largest modulus of a node in searches, over the body's."""
OF_LIMIT = 0.8
"""Time step of springs over the longest stable one."""


@dataclass(frozen=True, eq=False)
class Organ:
    """A body and its presses, one at each of ``contacts``; springs are fitted to the first ``fitted`` of them.

    body : of two levels: springs are on the coarse one, the reference is on the other
    model : the springs; keys : the free nodes of the coarse surface; compared : (k,) numbers of those that fits compare
    forces : (contacts, 3) [N]; limits : of the moduli; settings : the config's block organ_springs
    """

    body: Body
    model: SpringModel
    contacts: np.ndarray
    fitted: int
    forces: np.ndarray
    keys: KeyPoints
    compared: np.ndarray
    limits: Range
    settings: OrganSettings

    def particles(self, level: int) -> Particles:
        """Return the particles of a level; their masses are those of the CT if the body has one."""
        return particles_of(self.body, level, surface=False)

    def press(self, number: int, level: int) -> Press:
        """Return the press at a contact, given by its number, as forces on the nodes of a level."""
        contact = int(self.contacts[number])
        load = nodal_load(self.body, level, contact, self.forces[number], RADIUS_M)
        nodes = np.flatnonzero(load.any(axis=1))
        return Press(f"at node {contact} of {self.body.name}", nodes, load[nodes], self.settings.rise_s)

    def in_steps(self, steps: int, volume_n_m: float = 0.0) -> Settings:
        """Return the settings of a motion with ``steps`` steps a frame; volume_n_m : stiffness of the volume force."""
        frames, keys = self.settings.frames, self.keys
        step = self.settings.duration_s / (frames * steps)
        return Settings(step, frames * steps, DAMPING_RATIO, keys, volume_n_m, every=steps)

    def spring_settings(self, volume_force: bool) -> Settings:
        """Return the settings of springs, with or without volume force, in steps that are stable for the stiffest."""
        volume_n_m = volume_stiffness(self.model, self.particles(0).material) if volume_force else 0.0
        frame_steps = self.in_steps(1, volume_n_m)
        limit = OF_LIMIT * step_limit(self.particles(0), self.model, frame_steps, self.limits.high_pa)
        return self.in_steps(int(np.ceil(frame_steps.step_s / limit)), volume_n_m)

    def fitnesses(self, settings: Settings, references: list[Reference]) -> list[Fitness]:
        """Return the fitness functions of the fitted presses, which compare the key points ``compared`` only."""
        reduced = replace(settings, keys=KeyPoints(self.keys.corners[self.compared], self.keys.shares[self.compared]))
        return [
            Fitness(self.model, self.press(i, 0), reduced, x[:, self.compared], v[:, self.compared])
            for i, (x, v, _) in enumerate(references[: self.fitted])
        ]


def organ(body: Body, settings: OrganSettings) -> Organ:
    """Choose contacts, forces and key points of a body; InputError if it has too few contacts or no anchors.

    Each force moves the coarse body by PEAK_OF_SIZE of its size in linear elasticity. The fitted contacts are the first
    of those that lie farthest from each other, so that no tested one is beside all of them.
    """
    body = body.up_to(1) if len(body.levels) > 1 else finer(body)
    if body.bed is not None or not len(body.anchors[0]):
        raise InputError(f"organ_springs: {body.name} is not held by anchors, which springs need; give it anchors.")
    fitted, count = settings.fitted, settings.fitted + settings.tested
    fitted_contacts, all_contacts = kept_contacts(body, fitted), kept_contacts(body, count)
    if len(all_contacts) < count:
        raise InputError(
            f"organ_springs: {count} contacts are asked for and {len(all_contacts)} of {body.name} can be pressed; "
            "lower fitted or tested."
        )
    contacts = np.concatenate([fitted_contacts, np.setdiff1d(all_contacts, fitted_contacts)])
    particles = particles_of(body, 0, surface=False)
    free = np.setdiff1d(body.coarse.surface, particles.held)
    compared = np.unique(np.linspace(0, len(free) - 1, settings.key_points).round().astype(int))
    least, most = YOUNG_OF_BODY
    young = particles.material.young_pa
    # key points are nodes, with all weight on the first of four corners; nodes have the same numbers on every level
    keys = KeyPoints(np.repeat(free[:, None], 4, axis=1), np.tile([1.0, 0.0, 0.0, 0.0], (len(free), 1)))
    limits = Range(least * young, most * young)
    forces = _forces(body, contacts)
    return Organ(body, spring_model(particles), contacts, fitted, forces, keys, compared, limits, settings)


def _forces(body: Body, contacts: np.ndarray) -> np.ndarray:
    """Return inward forces (contacts, 3) [N] whose linear displacements are PEAK_OF_SIZE of the body's size at most."""
    respond, peak = Equilibrium(body, 0).linear_solver(), PEAK_OF_SIZE * body.fine.size
    forces = []
    for contact in contacts:
        direction = -body.fine.normals[contact]
        moved = respond(nodal_load(body, 0, int(contact), direction, RADIUS_M))
        forces.append(direction * peak / np.linalg.norm(moved, axis=1).max())
    return np.array(forces)


def references(pressed: Organ) -> list[Reference]:
    """Simulate the motion of linear elements on the finer level under each press, extrapolated to short steps.

    Backward Euler is of first order: the limit is twice the motion in half steps less that in whole steps.
    """
    particles, settings = pressed.particles(1), pressed.in_steps(1)
    rest, substeps = pressed.keys.of(pressed.body.coarse.nodes), pressed.settings.reference_steps
    limits = []
    for contact in range(len(pressed.contacts)):
        press = pressed.press(contact, 1)
        whole, half = (reference_motion(particles, pressed.model, press, settings, n * substeps) for n in (1, 2))
        positions, velocities = (2.0 * fine - coarse for fine, coarse in zip(half, whole, strict=True))
        limits.append(Reference(positions, velocities, deviation(half[0], positions, rest)))
    return limits


def deviation(motion: np.ndarray, wanted: np.ndarray, rest: np.ndarray) -> float:
    """Return the RMSE of a motion (f, p, 3) [m] over frames and points / the largest displacement of ``wanted``."""
    rmse = np.sqrt(((motion - wanted) ** 2).sum(axis=2).mean())
    return float(rmse / np.linalg.norm(wanted - rest, axis=2).max())


MODES = 3
"""Slowest modes whose frequencies are compared."""

MASS_MOTION = Table(
    "mass_motion",
    "What the masses of an organ's nodes change in its slowest modes and in its motion under the fitted presses.",
    """
    body from_ct masses: a body, whether it has a CT, and own, uniform or mean masses
    total_kg least_node_of_uniform most_node_of_uniform: total mass [kg], and single nodes over those of uniform density
    frequency_hz change_of_frequency: of the slowest mode [Hz], and the largest relative change of three modes
    change_of_motion: RMSE against the motion of own masses / peak
    """,
)


def mass_motion(pressed: Organ) -> pd.DataFrame:
    """Compute the rows of mass_motion.csv: coarse finite elements with each choice of masses, pressed and swinging.

    Masses are the body's own, those of density_kg_m3 everywhere (uniform), and the own total spread evenly (mean).
    """
    own, uniform = pressed.particles(0), replace(pressed, body=replace(pressed.body, densities=None)).particles(0)
    even = replace(own, masses=uniform.masses * (own.masses.sum() / uniform.masses.sum()))
    rest, settings = pressed.keys.of(pressed.body.coarse.nodes), pressed.in_steps(1)
    presses = [pressed.press(i, 0) for i in range(pressed.fitted)]

    def motions(particles: Particles) -> list[np.ndarray]:
        return [reference_motion(particles, pressed.model, press, settings, 1)[0] for press in presses]

    rows, own_hz, own_motions = [], frequencies_hz(own), motions(own)
    for name, particles in {"own": own, "uniform": uniform, "mean": even}.items():
        hz = frequencies_hz(particles)
        changes = [deviation(x, y, rest) for x, y in zip(motions(particles), own_motions, strict=True)]
        of_uniform = particles.masses / uniform.masses
        mass_columns = particles.masses.sum(), float(of_uniform.min()), float(of_uniform.max())
        deviations = float(np.abs(hz / own_hz - 1.0).max()), float(np.mean(changes))
        rows.append((pressed.body.name, pressed.body.densities is not None, name, *mass_columns, hz[0], *deviations))
    return MASS_MOTION.frame(rows)


def frequencies_hz(particles: Particles) -> np.ndarray:
    """Compute the lowest MODES frequencies ω/2π [Hz] of K φ = ω² M φ at rest: stiffness and masses of free nodes."""
    free = np.repeat(np.isin(np.arange(len(particles.nodes)), particles.held, invert=True), 3)
    stiffness = LinearElements(particles, particles.tissue).stiffness(particles.nodes).tocsr()[free][:, free]
    masses = sparse.diags_array(np.repeat(particles.masses, 3)[free]).tocsc()
    start = np.random.default_rng(0).normal(size=masses.shape[0])  # fixed, so that results repeat
    squares = eigsh(stiffness.tocsc(), MODES, masses, sigma=0.0, v0=start, return_eigenvectors=False)
    return np.sqrt(np.sort(squares)) / (2.0 * np.pi)
