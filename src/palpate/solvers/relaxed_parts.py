"""The parts of a system that methods relax one by one (elements, springs, loads, damping), and how contact joins.

XPBD, projective dynamics and vertex block descent step the scene's own law: corotational elements or a sheet's
triangles, its bending or bed, its loads, and Rayleigh's damping: that by mass as a larger inertia, exactly, that by
stiffness for each element's strain.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from palpate.effects.bed import BedSprings
from palpate.effects.bending import Bending
from palpate.effects.effect import (
    Corrections,
    Damping,
    Energy,
    Force,
    Projection,
    Proportional,
    Stiffness,
    is_load,
    offers,
)
from palpate.effects.gravity import Gravity
from palpate.effects.linear_elements import LinearElements
from palpate.effects.triangles import Triangles
from palpate.errors import InputError, NotConverged
from palpate.solvers.system import System


class FlatElements:
    """Triangles of a sheet, written as tetrahedra whose last corner is the first again, with a gradient of zero.

    F then lacks its third column; kernels that are told ``flat`` take that of the rotation, so that it bears nothing.
    tetrahedra : (m, 4); gradients : (m, 4, 3) [1/m]; volumes : (m,) [m³]; moduli : μ and λ in plane stress, two (m,)
    Trap: the energy's peak at a collapsed triangle is not smoothed, as that of ``Triangles`` is.
    """

    def __init__(self, triangles: Triangles):
        count = len(triangles.couples)
        self.tetrahedra = np.ascontiguousarray(np.column_stack([triangles.couples, triangles.couples[:, 0]]))
        self.gradients = np.zeros((count, 4, 3))
        self.gradients[:, :3, :2] = triangles.gradients
        self.volumes = triangles.volumes
        mu, lam = triangles.moduli
        self.moduli = np.full(count, mu), np.full(count, lam)


@dataclass(frozen=True, eq=False)
class LinearSprings:
    """Springs of constant stiffness, the same along x, y and z.

    couples : (m, k) nodes; roots : (m, c, k) [√(N/m)], whose products with displacements have half the energy's squares
    scalar : (n, n) [N/m] the stiffness; rest : (n, 3) [m]
    """

    couples: np.ndarray
    roots: np.ndarray
    scalar: sparse.csr_array
    rest: np.ndarray


def springs_of(effect: BedSprings | Bending, rest: np.ndarray) -> LinearSprings:
    """Return the springs of a bed, or those by which a sheet resists bending; rest : (n, 3) [m]."""
    if isinstance(effect, BedSprings):
        return LinearSprings(effect.couples, effect.roots, effect.scalar, effect.rest)
    roots = np.sqrt(effect.weights)[:, None] * effect.cotangents
    rows = sparse.csr_array(
        (roots.ravel(), effect.couples.ravel(), np.arange(0, roots.size + 1, 4)), shape=(len(roots), len(rest))
    )
    return LinearSprings(effect.couples, roots[:, None], (rows.T @ rows).tocsr(), rest)


class RelaxedParts:
    """The parts of a ``system``, which ``method`` steps, as far as it likes; InputError for an effect that it cannot.

    elements, springs : of the law, and those of constant stiffness or None
    cords : what pulls between points, as threads do
    pushes : forces (n, 3) [N] of contact at the end of the last step
    inverse_masses : (n,) [1/kg], 0 where a node is held or moves with another, and still : (n,) bool, where
    mass_rate, stiffness_time : Rayleigh's α [1/s] and β [s]; β damps the elements alone
    """

    limit_s = math.inf

    def __init__(self, system: System, method: str):
        self.system, self._method = system, method
        elastic = system.elastic
        if isinstance(elastic, LinearElements) and elastic.law[0] is None:
            elastic = elastic if system.leaders is None else elastic.between(system.leaders)
            self.elements: LinearElements | FlatElements = elastic
        elif isinstance(elastic, Triangles):
            self.elements = FlatElements(elastic)
        else:
            name = next(iter(system.effects))
            raise InputError(f"{method} steps corotational elements or triangles, and the elastic effect is {name}.")
        self.springs: LinearSprings | None = None
        self._elastic: list[Energy] = [elastic]
        self._outer: list[Force] = []
        self.cords: list[Corrections] = []
        self.mass_rate = self.stiffness_time = 0.0
        for name, effect in list(system.effects.items())[1:]:
            unknown = InputError(f"{method} has no part for the effect {name}; leave it out, or take backward_euler.")
            # XPBD takes what moves nodes at the end of a step for an outer force in the next: long steps then diverge
            if method == "xpbd" and offers(effect, Projection) and offers(effect, Stiffness):
                raise unknown
            if offers(effect, Projection) or not offers(effect, Force):
                continue
            if isinstance(effect, BedSprings | Bending):
                self.springs = springs_of(effect, system.particles.nodes)
                self._elastic.append(effect)
            elif offers(effect, Proportional):
                self.mass_rate += effect.damping_rates[0]
                self.stiffness_time += effect.damping_rates[1]
            elif isinstance(effect, Gravity) or (
                is_load(effect) and not offers(effect, Stiffness) and not offers(effect, Damping)
            ):
                self._outer.append(effect)
            elif offers(effect, Corrections) and method != "vertex_block_descent":
                self._elastic.append(effect)
                self.cords.append(effect)
            else:
                raise unknown
        self.pushes = np.zeros((len(system.masses), 3))
        self.inverse_masses = system.inverse_masses
        self.still = self.inverse_masses == 0.0

    def energy(self, x: np.ndarray) -> float:
        """Return the energy [J] of elements and springs."""
        return sum(effect.energy(x) for effect in self._elastic)

    def force(self, x: np.ndarray) -> np.ndarray:
        """Return their forces (n, 3) [N], on held nodes, too."""
        force = np.zeros_like(x)
        for effect in self._elastic:
            effect.add_force(x, x, force)
        return force

    @property
    def flat(self) -> bool:
        return isinstance(self.elements, FlatElements)

    def outer(self, x: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return weight and loads (n, 3) [N]; zero where a node is still."""
        force = np.zeros_like(x)
        for effect in self._outer:
            effect.add_force(x, v, force)
        self.system.balance(force)
        return force

    def end(self, start: np.ndarray, x: np.ndarray, v: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray]:
        """Return positions (n, 3) [m] and velocities [m/s] after a step of ``h`` [s] from ``start`` to ``x``.

        x : relaxed under the forces that contact had when the last step ended. Contact sees the nodes without these,
        each alone against its own inertia, and its new forces are what it then moves them by: where the old are the
        new, all forces balance. Without this a body would come to rest between where its elements and where contact
        put it, as far from both as the step is long. Raises NotConverged for a state that is not finite.
        """
        system = self.system
        load = system.outer_force(start, v) if system.loaded else None
        self._check(x, v)
        x = x - h**2 * self.inverse_masses[:, None] * self.pushes
        v, alone = (x - start) / h, x.copy()
        system.project(start, x, v, h)
        self.pushes = (system.masses / h**2)[:, None] * (x - alone)
        if load is not None:
            system.add_work(load, x - start)
        for cord in self.cords:
            cord.end(x)
        self._check(x, v)
        return x, v

    def _check(self, *found: np.ndarray) -> None:
        if not all(np.isfinite(each).all() for each in found):
            raise NotConverged(f"{self._method} is not finite any more; take shorter steps or more iterations", [])
