"""Press a rigid ball into a cube and compare the force with Hertz's, on finer and finer meshes.

`make bench` runs this in the project's folder. The exit code is 1 if the error does not fall with every refinement, or
the last one is above a tenth.
"""

import os
import sys
from itertools import pairwise

from palpate.run.job import kernel_cache

os.environ["NUMBA_CACHE_DIR"] = str(kernel_cache())  # read when numba is imported

import numpy as np

from palpate.bodies.body import nest
from palpate.bodies.material import Material
from palpate.bodies.mesh import TetMesh
from palpate.bodies.particles import Particles, particles_of
from palpate.bodies.simple_shapes import box
from palpate.effects.settings import Ball, Contact
from palpate.scenes.run_scene import run
from palpate.scenes.settings import Scene

RADIUS, PATCH = 1.0, 0.05
"""Of the ball, and of what it touches at its deepest [m]: strains are small, and a ball as good as a parabola."""
DEPTHS = np.array([0.25, 0.5, 1.0]) * PATCH**2 / RADIUS
RUBBER = Material(5000.0, 0.3, 1.0)
REST = 1000.0
"""Seconds from depth to depth: so long that inertia is nothing."""


def axis(cells: float, far: float, growth: float) -> np.ndarray:
    """Coordinates from 0 on: ``cells`` to PATCH, even up to 1.5 of it, then growing cells up to ``far`` of it."""
    found, step = [0.0], PATCH / cells
    while found[-1] < far * PATCH:
        step *= growth if found[-1] > 1.5 * PATCH - 1e-9 else 1.0
        found.append(found[-1] + step)
    return np.array(found)


def cushion(cells: float, far: float, growth: float) -> Particles:
    """A cube, its top's middle at the origin, fine there, and held at the bottom."""
    half = axis(cells, far, growth)
    n = len(half) - 1
    both = np.concatenate([-half[:0:-1], half])
    even = box([2 * n, 2 * n, n], [2 * n, 2 * n, n])
    i, j, k = np.rint(even.nodes).astype(int).T
    nodes = np.stack([both[i], both[j], -half[n - k]], axis=1)
    body = nest("cushion", TetMesh(nodes, even.tetrahedra), 0, np.flatnonzero(k == 0), RUBBER)
    return particles_of(body, 0, False)


def pressed(cells: float, far: float, growth: float, gap: float) -> np.ndarray:
    """The forces at DEPTHS in parts of Hertz's, F = 4/3 E* √R d^1.5, with a gap of ``gap`` of the deepest."""
    gap_m = gap * DEPTHS[-1]
    start = 1.5 * gap_m
    ball = Ball(
        name="ball",
        center_m=[0.0, 0.0, RADIUS + start],
        radius_m=RADIUS,
        times_s=[REST * i for i in range(len(DEPTHS) + 1)],
        shifts_m=[[0.0, 0.0, 0.0], *([0.0, 0.0, -start - depth] for depth in DEPTHS)],
    )
    contact = Contact(gap_m=gap_m, instruments=[ball])
    scene = Scene(body="hertz", step_s=REST, duration_s=REST * len(DEPTHS), contact=contact)
    force = run(scene, cushion(cells, far, growth)).motion.observed["ball_force_z_n"].to_numpy()
    return force / (4.0 / 3.0 * RUBBER.young_pa / (1.0 - RUBBER.poisson**2) * np.sqrt(RADIUS) * DEPTHS**1.5)


def main() -> None:
    errors = []
    for cells in (1, 2, 4):
        parts = pressed(cells, 60.0, 1.6, 0.01)
        errors.append(abs(parts[-1] - 1.0))
        print(f"{cells} cells to the rim: {', '.join(f'{part:.3f}' for part in parts)} of Hertz's force", flush=True)
    sys.exit(int(errors[-1] > 0.1 or any(b >= a for a, b in pairwise(errors))))


if __name__ == "__main__":
    main()
