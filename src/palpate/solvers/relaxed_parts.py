"""What XPBD, projective dynamics and vertex block descent have in common: the parts of a system that they relax.

They step corotational elements or a sheet's triangles, its bending or bed, loads, and Rayleigh damping: its part of the
mass exactly, as a larger inertia, and its part of the stiffness for each element's strain. Contact is projected at the
end of each step.
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
    """Triangles of a sheet in the form of tetrahedra, whose last corner is the first again, with a gradient of zero.

    F then lacks its third column; kernels with the argument ``flat`` fill in that of the rotation, which has no stress.
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
    """Springs of constant stiffness, the same along x, y and z, with what relaxations use of ``BedSprings``.

    couples : (m, k) nodes; roots : (m, c, k) [√(N/m)], rows r such that the energy is ½ Σ |r u|², u (k, 3) of the nodes
    scalar : (n, n) [N/m] the stiffness; rest : (n, 3) [m]
    """

    couples: np.ndarray
    roots: np.ndarray
    scalar: sparse.csr_array
    rest: np.ndarray


def bending_springs(bending: Bending, rest: np.ndarray) -> LinearSprings:
    """Return the springs with the bending energy of a sheet; rest : (n, 3) [m], its nodes at rest."""
    roots = np.sqrt(bending.weights)[:, None] * bending.cotangents
    rows = sparse.csr_array(
        (roots.ravel(), bending.couples.ravel(), np.arange(0, roots.size + 1, 4)), shape=(len(roots), len(rest))
    )
    return LinearSprings(bending.couples, roots[:, None], (rows.T @ rows).tocsr(), rest)


class RelaxedParts:
    """The parts of a ``system`` that ``method`` steps; InputError for an effect that it has no part for.

    elements : of the elastic law; springs : of constant stiffness, or None
    cords : effects that pull between points, as threads do
    pushes : forces (n, 3) [N] of contact at the end of the last step
    inverse_masses : (n,) [1/kg], 0 where a node is held or tied to another; still : (n,) bool, those nodes
    mass_rate, stiffness_time : α [1/s] and β [s] of Rayleigh damping; β damps the elements alone
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
        self.springs: BedSprings | LinearSprings | None = None
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
            if isinstance(effect, BedSprings):
                self.springs = effect
                self._elastic.append(effect)
            elif isinstance(effect, Bending):
                self.springs = bending_springs(effect, system.particles.nodes)
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
        """Return the forces (n, 3) [N] of elements and springs, also on held nodes."""
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

        x : relaxed under the forces that contact had at the end of the last step

        Contact is projected from the positions without those forces, each node against its own inertia, and its new
        forces are those of the projection. Where they equal the old ones all forces balance. Without them a body would
        come to rest between the positions of its elements and those of the projection, at a distance that grows with
        the step. Raises NotConverged for a state that is not finite.
        """
        system = self.system
        load = system.outer_force(start, v) if system.loaded else None
        self._check(x, v)
        x = x - h**2 * self.inverse_masses[:, None] * self.pushes
        v, unpushed = (x - start) / h, x.copy()
        system.project(start, x, v, h)
        self.pushes = (system.masses / h**2)[:, None] * (x - unpushed)
        if load is not None:
            system.add_work(load, x - start)
        for cord in self.cords:
            cord.end(x)
        self._check(x, v)
        return x, v

    def _check(self, *arrays: np.ndarray) -> None:
        if not all(np.isfinite(each).all() for each in arrays):
            raise NotConverged(f"{self._method} is not finite any more; take shorter steps or more iterations", [])
