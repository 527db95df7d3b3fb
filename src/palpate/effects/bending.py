"""Bending stiffness of a sheet: a quadratic energy over its inner edges."""

import numba
import numpy as np

from palpate.bodies.particles import Particles
from palpate.bodies.surfaces.tetrahedralize import label_shells
from palpate.effects.effect import Effect, Energy, Stiffness
from palpate.errors import InputError

FLAT = 1e-9
"""A rest state counts as flat if its distance from a plane is below this fraction of its size."""


def make(particles: Particles, settings: object, elastic: Effect | None = None) -> "Bending":
    """Make the bending of sheets; InputError for one that is not flat at rest."""
    labels = label_shells(particles.triangles, len(particles.nodes))
    if not all(_flat(particles.nodes[np.unique(particles.triangles[labels == label])]) for label in np.unique(labels)):
        raise InputError(
            f"{particles.name}: effect bending needs a sheet that is flat at rest, and this one is not; "
            "leave the effect out, or give a flat body of kind sheet."
        )
    return Bending(particles)


def _flat(points: np.ndarray) -> bool:
    """Return whether points (k, 3) [m] are in one plane."""
    centred = points - points.mean(axis=0)
    normal = np.linalg.svd(centred, full_matrices=False)[2][2]
    return bool(np.abs(centred @ normal).max() <= FLAT * np.ptp(points, axis=0).max())


class Bending(Energy, Stiffness):
    """Bending with E = ½ Σ c ‖Σ K x‖² over inner edges, c and K constant (Bergou et al. 2006; Wardetzky et al. 2007).

    K (4,) are the papers' cotangents around an edge; they vanish for affine x, and on a flat sheet Σ K x = a : ∇²x
    exactly for a quadratic x, with a symmetric a. The weight is c = D (A₀ + A₁) / (a : a), with the flexural stiffness
    D = E t³/(12 (1 − ν²)). On sheets of rectangular cells with mirrored diagonals the three kinds of edges measure
    x_uu, x_vv and x_uv, so the sum is the plate's ½ D ∫ ‖∇²x‖², equal in every direction. For a sheet rolled onto a
    cylinder of curvature κ it is ½ D κ² times its area, less the share of the rims, which have no hinge.
    Traps: the weight of the papers, 3 D / (A₀ + A₁), gives 3 to 4.5 times that, depending on the direction of the
    cylinder, and does not converge. A narrow strip is stiffer than a beam by 1/(1 − ν²), as transverse curvature does
    not relax it. Uneven stretch costs energy too, but little in a thin sheet.
    """

    def __init__(self, particles: Particles):
        material = particles.material
        stiffness = material.young_pa * particles.thickness_m**3 / (12.0 * (1.0 - material.poisson**2))
        self.couples = hinges(particles.triangles)
        corners = particles.nodes[self.couples]
        self.cotangents, areas = _stencils(corners)
        arms = corners - corners[:, :1]
        moments = 0.5 * np.einsum("ha,hai,haj->hij", self.cotangents, arms, arms)
        self.weights = stiffness * areas / (moments**2).sum(axis=(1, 2))

    def energy(self, x: np.ndarray) -> float:
        return _energy(x, self.couples, self.cotangents, self.weights)

    def add_force(self, x: np.ndarray, v: np.ndarray, force: np.ndarray) -> None:
        _add_force(x, self.couples, self.cotangents, self.weights, force)

    def add_stiffness(self, x: np.ndarray, definite: bool, slots: np.ndarray, values: np.ndarray) -> None:
        """Add the Hessian's blocks [N/m], which are constant and positive semidefinite."""
        _add_stiffness(self.cotangents, self.weights, slots, values)


def hinges(triangles: np.ndarray) -> np.ndarray:
    """Find the inner edges, (h, 4): both ends, then the opposite corner of each triangle."""
    ends = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    opposite = triangles[:, [2, 0, 1]].reshape(-1)
    edges, inverse, count = np.unique(np.sort(ends, axis=1), axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(inverse, kind="stable")
    first = (np.cumsum(count) - count)[count == 2]
    return np.column_stack([edges[count == 2], opposite[order[first]], opposite[order[first + 1]]])


def _stencils(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Compute K (h, 4) and A₀ + A₁ (h,) [m²] of hinges with ``corners`` (h, 4, 3) [m]."""
    a, b, c, d = corners.transpose(1, 0, 2)
    a_c, a_d, b_c, b_d = _cotangent(a, b, c), _cotangent(a, b, d), _cotangent(b, a, c), _cotangent(b, a, d)
    stencils = np.stack([b_c + b_d, a_c + a_d, -a_c - b_c, -a_d - b_d], axis=1)
    doubles = np.linalg.norm(np.cross(b - a, c - a), axis=1) + np.linalg.norm(np.cross(b - a, d - a), axis=1)
    return stencils, 0.5 * doubles


def _cotangent(corner: np.ndarray, one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Compute the cotangents (h,) of the angles at ``corner``."""
    first, second = one - corner, other - corner
    return np.einsum("hi,hi->h", first, second) / np.linalg.norm(np.cross(first, second), axis=1)


@numba.njit(cache=True)
def _energy(x, couples, cotangents, weights):
    """Return the bending energy [J] at ``x`` (n, 3) [m] of hinges h, each of four nodes ``couples[h]``."""
    total = 0.0
    for h in range(len(couples)):
        for i in range(3):
            # relative to the first corner, as K sums to zero: no cancellation far from the origin
            bend = 0.0
            for a in range(1, 4):
                bend += cotangents[h, a] * (x[couples[h, a], i] - x[couples[h, 0], i])
            total += 0.5 * weights[h] * bend * bend
    return total


@numba.njit(cache=True)
def _add_force(x, couples, cotangents, weights, force):
    for h in range(len(couples)):
        for i in range(3):
            bend = 0.0
            for a in range(1, 4):
                bend += cotangents[h, a] * (x[couples[h, a], i] - x[couples[h, 0], i])
            for a in range(4):
                force[couples[h, a], i] -= weights[h] * cotangents[h, a] * bend


@numba.njit(cache=True)
def _add_stiffness(cotangents, weights, slots, values):
    for h in range(len(cotangents)):
        for a in range(4):
            for b in range(4):
                entry = weights[h] * cotangents[h, a] * cotangents[h, b]
                for i in range(3):
                    values[slots[h, a, b], i, i] += entry
