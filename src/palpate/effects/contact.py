"""Contact with rigid spheres and floors, by a penalty on depth."""

import numba
import numpy as np

from palpate.bodies.particles import Particles


def make(particles: Particles, settings: dict, elastic) -> "Contact":
    """Contact of every node with ``settings["instruments"]``, at ``settings["stiffness_n_m"]`` [N/m] a node.

    An instrument is ``{kind: sphere, center_m: (3,), radius_m}``, which nodes stay out of, or ``{kind: floor,
    axis: x|y|z, height_m}``, above which they stay.
    """
    shapes = np.array([_shape(instrument) for instrument in settings["instruments"]])
    return Contact(len(particles.nodes), settings["stiffness_n_m"], shapes)


class Contact:
    """E = ½ k Σ d² over the nodes' depths d in the instruments, frictionless; C¹, as d starts from 0.

    Traps: a body of weight W sinks in by about W/k over the nodes it lies on, and finer meshes have more nodes, thus
    stiffer contact. At rest nothing may touch, so ``stiffness_bound`` (n,) [N/m] tells explicit integrators what a
    node can meet: four times k, as a bounce gives back up to three times the speed at a step of 2 √(m/k), but at
    most 1.1 times it up to √(m/k). At the very centre of a sphere, where d has a tip, the force points to +z.
    """

    def __init__(self, n_nodes: int, stiffness: float, shapes: np.ndarray):
        self.couples = np.arange(n_nodes)[:, None]
        self.stiffness_bound = np.full(n_nodes, 4.0 * stiffness * len(shapes))
        self._stiffness, self._shapes = stiffness, shapes

    def energy(self, x: np.ndarray) -> float:
        """Penalty energy [J] at positions ``x`` (n, 3) [m]."""
        return _energy(x, self._stiffness, self._shapes)

    def add_force(self, x: np.ndarray, v: np.ndarray, force: np.ndarray) -> None:
        """Add k d along the outward normal to ``force`` (n, 3) [N]."""
        _add_force(x, self._stiffness, self._shapes, force)

    def add_stiffness(self, x: np.ndarray, definite: bool, slots: np.ndarray, values: np.ndarray) -> None:
        """Add k (n nᵀ − d/r (I − n nᵀ)) for each node inside [N/m]; ``definite`` drops the second, negative part."""
        _add_stiffness(x, self._stiffness, self._shapes, definite, slots, values)


def _shape(instrument: dict) -> list[float]:
    """A row for the kernels: a sphere's centre, radius and 1, or a floor's normal, height and 0."""
    if instrument["kind"] == "sphere":
        return [*instrument["center_m"], instrument["radius_m"], 1.0]
    return [*(float(axis == instrument["axis"]) for axis in "xyz"), instrument["height_m"], 0.0]


@numba.njit(cache=True, error_model="numpy")
def _depth(point, shape, normal):
    """How deep ``point`` is, and the curvature 1/r of the surface through it; its outward normal into ``normal``."""
    if shape[4] == 0.0:
        normal[:] = shape[:3]
        return shape[3] - (point[0] * normal[0] + point[1] * normal[1] + point[2] * normal[2]), 0.0
    for i in range(3):
        normal[i] = point[i] - shape[i]
    r = np.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2)
    depth = shape[3] - r
    if r < 1e-9 * shape[3]:
        normal[0], normal[1], normal[2] = 0.0, 0.0, 1.0
        r = 1e-9 * shape[3]
    else:
        for i in range(3):
            normal[i] /= r
    return depth, 1.0 / r


@numba.njit(cache=True)
def _energy(x, stiffness, shapes):
    normal, total = np.empty(3), 0.0
    for node in range(len(x)):
        for shape in shapes:
            depth, _ = _depth(x[node], shape, normal)
            if depth > 0.0:
                total += 0.5 * stiffness * depth * depth
    return total


@numba.njit(cache=True)
def _add_force(x, stiffness, shapes, force):
    normal = np.empty(3)
    for node in range(len(x)):
        for shape in shapes:
            depth, _ = _depth(x[node], shape, normal)
            if depth > 0.0:
                for i in range(3):
                    force[node, i] += stiffness * depth * normal[i]


@numba.njit(cache=True)
def _add_stiffness(x, stiffness, shapes, definite, slots, values):
    normal = np.empty(3)
    for node in range(len(x)):
        for shape in shapes:
            depth, curvature = _depth(x[node], shape, normal)
            if depth > 0.0:
                k = slots[node, 0, 0]
                across = 0.0 if definite else -depth * curvature
                for i in range(3):
                    values[k, i, i] += stiffness * across
                    for j in range(3):
                        values[k, i, j] += stiffness * (1.0 - across) * normal[i] * normal[j]
