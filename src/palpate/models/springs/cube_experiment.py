"""Paper 2's experiment: its cube of 120 nodes, 377 tetrahedra, 590 edges; three presses, and references."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import Delaunay

from palpate.bodies.material import Material
from palpate.bodies.mesh import EDGES, TetMesh
from palpate.bodies.mesh_quality import dihedral_angles
from palpate.bodies.particles import Particles, solid_particles
from palpate.errors import InputError
from palpate.files import write_whole
from palpate.models.springs import spring_motion
from palpate.models.springs.fitness import Fitness, Range, step_limit, volume_stiffness
from palpate.models.springs.spring_motion import Press, Settings, SpringModel

Motion = tuple[np.ndarray, np.ndarray]
"""Positions [m] and velocities [m/s] of the key points after each step, both (steps, p, 3)."""

TETRAHEDRA = 377
FACES = {"top": (2, 1), "left": (0, 0), "front": (1, 0)}
"""Pressed faces: axis of the normal, and whether it is at the upper end; x to the right, y backward, z up."""
SEED, JITTER = 87, 0.3


@dataclass(frozen=True, eq=False)
class Experiment:
    """The presses that springs are fitted to, and the settings of their motion."""

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
        settings, stiffest_pa = replace(self.settings, volume_n_m=stiffness_n_m), self.limits.high_pa
        limit = step_limit(self.particles, self.model, settings, stiffest_pa)
        if settings.step_s > limit:
            raise InputError(
                f"springs.step_s is {settings.step_s:g} s, and springs of {stiffest_pa:g} Pa are stable up to "
                f"{limit:.3g} s only; take a shorter step, or lower springs.young_pa."
            )
        return replace(self, settings=settings)

    def volume_n_m(self) -> float:
        """Return the stiffness [N/m] at which the springs have the bulk modulus of the material."""
        return volume_stiffness(self.model, self.particles.material)

    def fitness(self, press: str, references: dict[str, Motion]) -> Fitness:
        """Return the fitness of one press against its reference."""
        return Fitness(self.model, self.presses[press], self.settings, *references[press])


def experiment(asked: Any, poisson: float) -> Experiment:
    """Return paper 2's experiment with the cube of the config, whose reference has this Poisson ratio.

    asked : the config's block ``springs``
    InputError if a key point is outside the cube, or the step is too long.
    """
    mesh = paper_cube(asked.side_m)
    material = Material(asked.material.young_pa, poisson, asked.material.density_kg_m3)
    particles = solid_particles(mesh, np.flatnonzero(mesh.nodes[:, 2] == 0.0), material, "paper 2's cube")
    presses = {}
    for face in FACES:
        node, inward = middle(mesh, face)
        presses[face] = Press(face, node, asked.force_n * inward, asked.rise_s)
    keys = spring_motion.key_points(mesh.nodes, mesh.tetrahedra, np.array(asked.key_points_m, dtype=float))
    steps = round(asked.duration_s / asked.step_s)
    settings = Settings(asked.step_s, steps, asked.damping_ratio, keys)
    model = spring_motion.spring_model(particles)
    cube = Experiment(particles, model, presses, settings, Range(*asked.young_pa))
    return cube.with_volume(0.0)  # which checks the step


def simulate_references(experiment: Experiment, substeps: int) -> dict[str, Motion]:
    """Return the motion of finite elements under each press, in arrays contiguous as those read back are."""
    particles, model, settings = experiment.particles, experiment.model, experiment.settings
    motions = {}
    for name, press in experiment.presses.items():
        x, v = spring_motion.reference_motion(particles, model, press, settings, substeps)
        motions[name] = np.ascontiguousarray(x), np.ascontiguousarray(v)
    return motions


def save_references(references: dict[str, Motion], path: str | Path) -> None:
    """Write all motions to one file."""
    arrays: dict[str, Any] = {name: np.stack(motion) for name, motion in references.items()}
    with write_whole(path) as part, open(part, "wb") as file:
        np.savez(file, **arrays)


def load_references(path: str | Path) -> dict[str, Motion]:
    """Read the motions that ``save_references`` wrote."""
    with np.load(path) as file:
        return {name: tuple(file[name]) for name in FACES}


def paper_cube(side_m: float) -> TetMesh:
    """Build the cube [0, side_m]³ with the paper's counts, and a node in the middle of each face.

    The paper does not give the positions of its nodes. By Euler's formula its counts leave 96 nodes on the surface and
    24 inside, five less than a lattice of four cells per edge. So: that lattice without five nodes and with random
    displacements, its Delaunay tetrahedra, which are about 400, and then edge removals (3-2 flips), the one that most
    improves the worst angle first, until 377 are left. ``SEED`` is the one of the first 330 whose smallest angle is
    largest, 12.8°.
    """
    points = _points(SEED)
    tetrahedra = Delaunay(points).simplices.astype(np.int64)
    volumes = TetMesh(points, tetrahedra).volumes
    tetrahedra[volumes < 0.0] = tetrahedra[volumes < 0.0][:, [0, 2, 1, 3]]
    tetrahedra = tetrahedra[np.abs(volumes) > 1e-9]  # Delaunay's triangulation has flat ones on a face
    while len(tetrahedra) > TETRAHEDRA:
        tetrahedra = _remove_edge(points, tetrahedra)
    return TetMesh(side_m * points, tetrahedra)


def middle(mesh: TetMesh, face: str) -> tuple[int, np.ndarray]:
    """Find the node nearest to the middle of a face of a cube, one of ``FACES``, and its inward normal (3,)."""
    axis, upper = FACES[face]
    lowest, highest = mesh.nodes.min(axis=0), mesh.nodes.max(axis=0)
    point, inward = 0.5 * (lowest + highest), np.zeros(3)
    point[axis] = highest[axis] if upper else lowest[axis]
    inward[axis] = -1.0 if upper else 1.0
    return int(np.argmin(np.linalg.norm(mesh.nodes - point, axis=1))), inward


def _points(seed: int) -> np.ndarray:
    """Return random nodes in the unit cube; those of faces stay in them, those of edges and face middles are fixed."""
    rng = np.random.default_rng(seed)
    grid = np.stack(np.meshgrid(*[np.arange(5) / 4.0] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    outer = (grid == 0.0) | (grid == 1.0)  # coordinates that put a node on a face
    faces = (outer.sum(axis=1) == 1) & ((grid == 0.5).sum(axis=1) < 2)
    inside = ~outer.any(axis=1)
    # not on the three pressed faces
    dropped = [rng.choice(np.flatnonzero(faces & (grid[:, axis] == end))) for axis, end in ((2, 0.0), (1, 1.0))]
    dropped += rng.choice(np.flatnonzero(inside), 3, replace=False).tolist()
    move = np.where(outer | ~(faces | inside)[:, None], 0.0, rng.uniform(-JITTER, JITTER, grid.shape) / 4.0)
    return np.delete(grid + move, dropped, axis=0)


def _remove_edge(points: np.ndarray, tetrahedra: np.ndarray) -> np.ndarray:
    """Return ``tetrahedra`` with three around an edge replaced by two, where the least dihedral angle grows most."""
    least_angles = dihedral_angles(TetMesh(points, tetrahedra)).min(axis=1)
    ends = np.sort(tetrahedra[:, EDGES].reshape(-1, 2), axis=1)
    edges, number, count = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    best_gain, chosen = -np.inf, (np.empty(0, dtype=np.int64), np.empty((0, 4), dtype=np.int64))
    for edge in np.flatnonzero(count == 3):  # each edge with three tetrahedra around it
        removed = np.flatnonzero(number.ravel() == edge) // len(EDGES)
        ring = np.setdiff1d(tetrahedra[removed], edges[edge])  # the three nodes around it
        if len(ring) > 3:  # on the surface
            continue
        added = np.array([[*ring, edges[edge][0]], [*ring[::-1], edges[edge][1]]])
        volumes = TetMesh(points, added).volumes
        if volumes[0] < 0.0:
            added, volumes = added[:, [1, 0, 2, 3]], -volumes
        if volumes.min() <= 0.0:
            continue
        gain = dihedral_angles(TetMesh(points, added)).min() - least_angles[removed].min()
        if gain > best_gain:
            best_gain, chosen = gain, (removed, added)
    removed, added = chosen
    return np.concatenate([np.delete(tetrahedra, removed, axis=0), added])
