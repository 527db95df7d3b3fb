"""The particles and effects of a scene as one system: sums of forces, energies and matrices, and the stable step."""

import math
from collections.abc import Callable, Mapping, Sequence
from time import perf_counter
from typing import Any, Protocol

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import eigsh

from palpate.bodies.particles import Particles
from palpate.effects import effect as hooks
from palpate.effects.effect import Damping, Effect, Hook, Projection, offers
from palpate.errors import InputError
from palpate.linalg.block_pattern import gather, hold, shared_pattern

Calls = Sequence[tuple[str, Callable]]
"""Names of effects, each with one function of it."""


class Integrator(Protocol):
    """A solver that steps a system in time; with ``renew`` it goes on when masses and pattern have changed."""

    @property
    def limit_s(self) -> float:
        """The longest stable step [s]."""

    def step(self, x: np.ndarray, v: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray]:
        """Return positions (n, 3) [m] and velocities [m/s] after a step of ``h`` [s]; NotConverged if there is none."""


class System:
    """The particles that an integrator moves, and the effects that act on them.

    It calls only the hooks that the given effects offer, so that an effect which a scene does not name costs nothing.

    effects : name → effect, the elastic one first
    seconds : name → time spent in each effect so far
    leaders : (n,) the node that each one moves with, None where none are tied
    loaded, bounded : whether an effect is a load, and whether one limits the steps of a search

    Raises InputError for an effect that lacks a part of a hook.
    """

    def __init__(self, particles: Particles, effects: Mapping[str, Effect]):
        for name, effect in effects.items():
            if lack := hooks.incomplete(effect):
                raise InputError(f"effect {name} has {lack}; see palpate/effects/effect.py.")
        self.particles, self.masses, self.effects = particles, particles.masses, effects
        elastic_name, self.elastic = next(iter(effects.items()))
        self.seconds = dict.fromkeys(effects, 0.0)
        self.free = np.ones(len(particles.nodes), dtype=bool)
        for _, anchor in self.offering(hooks.FixedNodes):
            self.free[anchor.fixed] = False
        self._fixed = np.flatnonzero(~self.free)
        self.leaders: np.ndarray | None = None
        forces = self.offering(hooks.Force)
        self._energies = [(n, e.energy) for n, e in self.offering(hooks.Energy)]
        self._potential = [(n, e.add_force) for n, e in self.offering(hooks.Energy)]
        self._forces = [(n, e.add_force) for n, e in forces]
        self._explicit = [(n, e.add_force) for n, e in forces if not offers(e, hooks.Projection)]
        self._loads = [(n, e.add_force) for n, e in forces if hooks.is_load(e)]
        self._timed_effects = [e.at for _, e in self.offering(hooks.Time)]
        self._projections = [(n, e.project) for n, e in self.offering(hooks.Projection)]
        self._relaxations = [(n, e.relax) for n, e in self.offering(hooks.Relaxation)]
        self._begins = [(n, e.begin) for n, e in self.offering(hooks.StepBegin)]
        self._ends = [(n, e.end) for n, e in self.offering(hooks.StepEnd)]
        self._driven = [e for _, e in self.offering(hooks.Driven)]
        self._limits = [(n, e.limit) for n, e in self.offering(hooks.StepLimit)]
        self._unbounded = {n for n, _ in self._limits}
        self.loaded, self.bounded = bool(self._loads), bool(self._limits)
        touching = self.offering(hooks.Touching)
        self._touching = [(n, e.touching) for n, e in touching]
        self._explicit_touching = [(n, e.touching) for n, e in touching if not offers(e, hooks.Projection)]
        self._goals = [(elastic_name, self.elastic.goals)] if offers(self.elastic, hooks.Goals) else []
        self.time, self._load_work = 0.0, 0.0
        for _, follower in self.offering(hooks.HeldNodes):
            follower.hold(self._fixed)
        self._lay_out([e.couples for _, e in self.offering(hooks.Couples)])

    def _lay_out(self, couples: list[np.ndarray]) -> None:
        """Make the block pattern of all ``couples``, and store the places of each effect's blocks in it."""
        self.pattern = shared_pattern(couples, len(self.particles.nodes))
        slots = dict(zip((n for n, _ in self.offering(hooks.Couples)), self.pattern.slots, strict=True))
        damped = self.offering(hooks.Damping)
        self._stiff = [(n, e.add_stiffness, slots[n]) for n, e in self.offering(hooks.Stiffness)]
        self._damped = [(n, e.add_damping, slots[n]) for n, e in damped]
        self._explicit_damped = [(n, e.add_damping, slots[n]) for n, e in damped if not offers(e, hooks.Projection)]

    @property
    def inverse_masses(self) -> np.ndarray:
        """One over the mass (n,) [1/kg] of each node; 0 where it is held."""
        return np.divide(1.0, self.masses, out=np.zeros_like(self.masses), where=self.free & (self.masses > 0.0))

    def offering(self, hook: type[Hook]) -> list[tuple[str, Hook]]:
        """Return the names and objects of the effects that offer ``hook``."""
        return [(name, effect) for name, effect in self.effects.items() if offers(effect, hook)]

    def followed(self, x: np.ndarray) -> np.ndarray:
        """Return ``x`` (n, 3) [m] with each tied node at the place of its leader; here no node is tied."""
        return x

    def energies(self, x: np.ndarray) -> dict[str, float]:
        """Return the potential energy [J] of each effect that has one."""
        at = self.followed(x)
        return {name: self._timed(name, energy, at) for name, energy in self._energies}

    def energy(self, x: np.ndarray) -> float:
        """Return the potential energy [J]."""
        return sum(self.energies(x).values())

    def force(self, x: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return all nodal forces (n, 3) [N]; zero where a node is held."""
        return self._sum(self._forces, x, v)

    def explicit_force(self, x: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return the forces (n, 3) [N] of the effects without a projection."""
        return self._sum(self._explicit, x, v)

    def potential_force(self, x: np.ndarray) -> np.ndarray:
        """Return minus the gradient of the energy (n, 3) [N]; zero where a node is held."""
        return self._sum(self._potential, x, np.zeros_like(x))

    def outer_force(self, x: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return the loads (n, 3) [N], whose work comes from outside."""
        return self._sum(self._loads, x, v)

    def magnitude(self, x: np.ndarray, most: float = np.inf) -> float:
        """Return the sum over effects of the norm [N] of their forces on free nodes: the scale of residuals.

        Damping is left out. The force of an effect with a ``limit`` can grow without bound: up to ``most`` [N] counts.
        """
        still, total = np.zeros_like(x), 0.0
        for force in [*self._potential, *self._loads]:
            norm = float(np.linalg.norm(self._sum([force], x, still)))
            total += min(norm, most) if force[0] in self._unbounded else norm
        return total

    def _sum(self, calls: Calls, x: np.ndarray, v: np.ndarray) -> np.ndarray:
        force, x, v = np.zeros_like(x), self.followed(x), self.followed(v)
        for name, add in calls:
            self._timed(name, add, x, v, force)
        self.balance(force)
        return force

    def balance(self, force: np.ndarray) -> None:
        """Set ``force`` (n, 3) [N] to zero at held nodes, in place."""
        force[self._fixed] = 0.0

    def stiffness(self, x: np.ndarray, definite: bool) -> sparse.bsr_array | None:
        """Return the Hessian of the energy (3n, 3n) [N/m] on the shared pattern; None if no effect has one."""
        return self._assemble(self._stiff, x, definite)

    def damping(self, x: np.ndarray, explicit: bool = False) -> sparse.bsr_array | None:
        """Return the damping matrix (3n, 3n) [N s/m] on the shared pattern; None if no effect damps.

        ``explicit`` selects the effects of ``explicit_force``.
        """
        return self._assemble(self._explicit_damped if explicit else self._damped, x)

    def _assemble(
        self, calls: Sequence[tuple[str, Callable, np.ndarray]], x: np.ndarray, *definite: bool
    ) -> sparse.bsr_array | None:
        if not calls:
            return None
        at, values = self.followed(x), np.zeros((len(self.pattern.indices), 3, 3))
        for name, add, slots in calls:
            self._timed(name, add, at, *definite, slots, values)
        return self.pattern.matrix(values)

    def touching(self, x: np.ndarray, definite: bool) -> sparse.bsr_array | None:
        """Return the Hessian (3n, 3n) [N/m] of effects with a changing pattern, such as contact; None without one."""
        return self._touched(self._touching, x, definite)

    def _touched(self, calls: Calls, x: np.ndarray, definite: bool) -> sparse.bsr_array | None:
        parts = [self._timed(name, call, self.followed(x), definite) for name, call in calls]
        return gather(parts, len(x)) if any(len(rows) for rows, _, _ in parts) else None

    def explicit_stiffness(self, x: np.ndarray) -> list[sparse.bsr_array]:
        """Return the terms of the positive semidefinite Hessian (3n, 3n) [N/m] of ``explicit_force``."""
        parts = self.stiffness(x, definite=True), self._touched(self._explicit_touching, x, definite=True)
        return [part for part in parts if part is not None]

    def limit(self, x: np.ndarray, direction: np.ndarray) -> float:
        """Return the fraction of ``direction`` (n, 3) [m], at most 1, by which the nodes may move from ``x``."""
        x, direction = self.followed(x), self.followed(direction)
        return min(self._timed(name, call, x, direction) for name, call in self._limits)

    def begin(self, x: np.ndarray, h: float) -> np.ndarray:
        """Begin a step of ``h`` [s] at ``x`` (n, 3) [m] that ends at the present time.

        Returns the positions from which the search begins: ``x``, but for nodes that an obstacle or a hook displaces.
        """
        x = self.followed(x)
        for name, call in self._begins:
            displaced = self._timed(name, call, x, h)
            if self._limits and name not in self._unbounded:  # displaced nodes stop before they touch anything
                displaced = x + self.limit(x, displaced - x) * (displaced - x)
            x = displaced
        return x

    def end(self, x: np.ndarray) -> None:
        """Tell effects that an implicit step, or a part of one, is accepted and ends at ``x`` (n, 3) [m]."""
        self._change(self._ends, self.followed(x))

    def add_work(self, load: np.ndarray, motion: np.ndarray) -> None:
        """Add the work of a ``load`` (n, 3) [N] over a ``motion`` (n, 3) [m] of the nodes to ``work_j``."""
        self._load_work += float(np.vdot(load, motion))

    @property
    def work_j(self) -> float:
        """The work [J] that loads and moved obstacles have done so far."""
        return self._load_work + sum(effect.work_j for effect in self._driven)

    def hold(self, matrix: sparse.bsr_array) -> None:
        """Replace the rows and columns of held nodes by those of the identity, in place."""
        if len(self._fixed):
            hold(matrix.indptr, matrix.indices, matrix.data, ~self.free)

    def goals(self, x: np.ndarray, out: np.ndarray) -> None:
        """Write the goal positions of the elastic effect to ``out`` (n, 3) [m]."""
        self._change(self._goals, x, out)

    def at(self, t: float) -> None:
        """Set the time ``t`` [s] at the end of the next step."""
        self.time = t
        for set_time in self._timed_effects:
            set_time(t)

    def project(self, start: np.ndarray, x: np.ndarray, v: np.ndarray, h: float) -> None:
        """Apply the projections of effects at the end of an explicit step from ``start``, in place."""
        self._change(self._projections, self.followed(start), x, v, h)

    def relax(self, x: np.ndarray, h: float) -> None:
        """Update the inner variables of effects after an accepted step."""
        self._change(self._relaxations, x, h)

    def _change(self, calls: Calls, *arguments: Any) -> None:
        for name, change in calls:
            self._timed(name, change, *arguments)

    def _timed(self, name: str, call: Callable, *arguments: Any) -> Any:
        start = perf_counter()
        result = call(*arguments)
        self.seconds[name] += perf_counter() - start
        return result


DENSE_UNKNOWNS = 120
"""Up to this number of unknowns all eigenvalues are computed, as the iterative method needs more unknowns."""


def stable_step(system: System, taken: float = 0.0) -> float:
    """Return the longest stable step of symplectic Euler [s]; infinite without stiffness and damping.

    It is the h with h² λ_K + 2 h λ_C = 4 − ``taken``, where λ_K and λ_C are the largest eigenvalues of M⁻¹K and M⁻¹C
    at rest. In each step a mode of frequency² a and damping rate c is multiplied by the roots of
    z² − (2 − hc − h²a) z + (1 − hc), which are in the unit circle up to h² a + 2 h c = 4; without damping that is
    h = 2 sqrt(m/k) (paper 3). In a mode of the whole body a and c are means over it, a ≤ λ_K and c ≤ λ_C, so the
    condition is sufficient. A decay of velocities by a projection at the step's end reduces 4 to 2 in the worst case.

    taken : α of goal positions, 0 without them
    """
    rest, free = system.particles.nodes, system.free
    scale = 1.0 / np.sqrt(np.repeat(system.masses[free], 3))
    unknowns = np.repeat(free, 3)
    damping = system.damping(rest, explicit=True)
    a = _largest(system.explicit_stiffness(rest), unknowns, scale)
    c = _largest([] if damping is None else [damping], unknowns, scale)
    if a + c == 0.0:
        return math.inf
    decays = any(offers(effect, Damping) for _, effect in system.offering(Projection))
    right_side = (2.0 if decays else 4.0) - taken
    return right_side / (c + math.sqrt(c * c + right_side * a))  # the root without cancellation, also for a = 0


def _largest(parts: list[sparse.bsr_array], unknowns: np.ndarray, scale: np.ndarray) -> float:
    """Return the largest eigenvalue of M⁻¹ Σ ``parts`` on the ``unknowns`` (3n,) bool; ``scale`` is M^(−1/2)."""
    if not parts or not len(scale):
        return 0.0
    matrix = sum(parts[1:], parts[0]).tocsr()[unknowns][:, unknowns]
    matrix = (sparse.diags_array(scale) @ matrix @ sparse.diags_array(scale)).tocsr()
    if not matrix.data.any():
        return 0.0
    if len(scale) <= DENSE_UNKNOWNS:
        return float(np.linalg.eigvalsh(matrix.toarray())[-1])
    # a fixed start, so that the result is reproducible; not all ones: a translation has no stiffness
    start = np.random.default_rng(0).normal(size=len(scale))
    return float(eigsh(matrix, k=1, which="LA", v0=start, tol=1e-5, return_eigenvectors=False)[0])
