"""Spring network to be calibrated: point masses, the key points at which it is compared, and the press."""

from dataclasses import dataclass

import numpy as np

from palpate.bodies.particles import Particles
from palpate.effects.springs import rest_lengths, sum_around_edges
from palpate.errors import InputError

TOLERANCE = 1e-9
"""Tolerance of a negative barycentric coordinate, for points on the mesh's surface up to rounding."""


@dataclass(frozen=True, eq=False)
class SpringModel:
    """Point masses on the edges of tetrahedra, without the springs' stiffness (paper 2, eq. 1–5).

    nodes : (n, 3) [m]; tetrahedra : (m, 4); held : (k,) fixed nodes
    pairs : (s, 2) ends of the springs; rest_m : (s,) [m]; masses : (n,) [kg]
    weights : (s,) ΣV/l² [m], so that a spring between moduli E₁ and E₂ has k = ½ (E₁ + E₂) · weight (eq. 5); volumes of
        a stiffer region count as many times as it is stiffer than the body's own material
    """

    nodes: np.ndarray
    tetrahedra: np.ndarray
    pairs: np.ndarray
    rest_m: np.ndarray
    weights: np.ndarray
    masses: np.ndarray
    held: np.ndarray


def spring_model(particles: Particles) -> SpringModel:
    """Build the network of a solid's tetrahedra."""
    pairs, around = sum_around_edges(particles, particles.tissue.young_pa / particles.material.young_pa)
    rest = rest_lengths(particles.nodes, pairs)
    held = np.array(particles.held)
    return SpringModel(particles.nodes, particles.tetrahedra, pairs, rest, around / rest**2, particles.masses, held)


@dataclass(frozen=True, eq=False)
class KeyPoints:
    """p points that move with the mesh: each is Σ ``shares`` (p, 4) times the nodes ``corners`` (p, 4)."""

    corners: np.ndarray
    shares: np.ndarray

    def of(self, values: np.ndarray) -> np.ndarray:
        """Interpolate nodal ``values`` (…, n, 3) to (…, p, 3)."""
        return np.einsum("pc,...pci->...pi", self.shares, values[..., self.corners, :])


def key_points(nodes: np.ndarray, tetrahedra: np.ndarray, points_m: np.ndarray, place: str) -> KeyPoints:
    """Locate ``points_m`` (p, 3) [m] in a mesh; raise InputError, naming ``place``, for one outside it."""
    origin = nodes[tetrahedra[:, 0]]
    edges = np.swapaxes(nodes[tetrahedra[:, 1:]] - origin[:, None], 1, 2)
    corners, shares = [], []
    for number, point in enumerate(np.asarray(points_m, dtype=float).reshape(-1, 3)):
        local = np.linalg.solve(edges, (point - origin)[:, :, None])[:, :, 0]
        inside = np.column_stack([1.0 - local.sum(axis=1), local])
        best = int(np.argmax(inside.min(axis=1)))
        if not inside[best].min() >= -TOLERANCE:  # a NaN is outside, too
            low, high = nodes.min(axis=0), nodes.max(axis=0)
            raise InputError(
                f"{place}[{number}] is {point.tolist()}, which is outside the mesh; "
                f"give a point in it, in metres, its nodes being from {low.tolist()} to {high.tolist()}."
            )
        corners.append(tetrahedra[best])
        shares.append(inside[best])
    if not corners:
        raise InputError(f"{place} is empty; give at least one point [x, y, z] in metres.")
    return KeyPoints(np.array(corners), np.array(shares))


@dataclass(frozen=True, eq=False)
class Press:
    """A load that rises over ``rise_s`` [s] as 3q² − 2q³ and is constant afterwards.

    force_n : (3,) [N] on the number ``node``, or (k, 3) on ``node`` (k,), each once
    """

    name: str
    node: int | np.ndarray
    force_n: np.ndarray
    rise_s: float

    def pattern(self, nodes: int) -> np.ndarray:
        """Return the force on each of so many nodes once it has risen, (nodes, 3) [N]."""
        load = np.zeros((nodes, 3))
        load[self.node] = self.force_n
        return load

    def factors(self, step_s: float, steps: int) -> np.ndarray:
        """Compute the fraction of the force at the end of each step, (steps,) from 0 to 1, for explicit steps."""
        q = np.clip(step_s * np.arange(1, steps + 1) / self.rise_s, 0.0, 1.0)
        return q * q * (3.0 - 2.0 * q)
