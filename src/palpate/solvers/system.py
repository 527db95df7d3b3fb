"""Particles and the effects that a scene names: their forces, energies and matrices, each summed and timed."""

from time import perf_counter

import numpy as np
from scipy import sparse

from palpate.bodies.particles import Particles
from palpate.linalg.block_pattern import gather, hold, shared_pattern


class System:
    """What an integrator moves. It holds and calls the given effects only, so what is not named costs nothing.

    effects : name → effect object, the elastic one first
    seconds : name → time spent in each so far
    """

    def __init__(self, particles: Particles, effects: dict[str, object]):
        self.particles, self.masses, self.effects = particles, particles.masses, effects
        self._first, self.elastic = next(iter(effects.items()))
        self.seconds = dict.fromkeys(effects, 0.0)
        self.free = np.ones(len(particles.nodes), dtype=bool)
        for _, effect in self.offering("fixed"):
            self.free[effect.fixed] = False
        self._fixed = np.flatnonzero(~self.free)
        self._energies = self._calls("energy")
        self._forces = self._calls("add_force")
        self._potential = [(n, e.add_force) for n, e in self.offering("energy")]
        self._explicit = self._calls("add_force", without="project")
        self._outer = [(n, e.add_force) for n, e in self.offering("add_force") if getattr(e, "outer", False)]
        self._told, self._projections, self._relaxed = map(self._calls, ("at", "project", "relax"))
        self._begins, self._limits, self._touching = map(self._calls, ("begin", "limit", "touching"))
        self.time = 0.0
        for _, effect in self.offering("hold"):
            effect.hold(self._fixed)
        coupling = self.offering("couples")
        self.pattern = shared_pattern([e.couples for _, e in coupling], len(particles.nodes))
        slots = dict(zip((n for n, _ in coupling), self.pattern.slots, strict=True))
        self._stiff = [(n, e.add_stiffness, slots[n]) for n, e in self.offering("add_stiffness")]
        self._damped = [(n, e.add_damping, slots[n]) for n, e in self.offering("add_damping")]
        self._explicit_damped = [call for call in self._damped if not hasattr(effects[call[0]], "project")]

    def offering(self, method: str) -> list[tuple[str, object]]:
        """Name and object of the effects that have ``method``."""
        return [(name, effect) for name, effect in self.effects.items() if hasattr(effect, method)]

    def _calls(self, method: str, without: str = "") -> list[tuple[str, object]]:
        return [(n, getattr(e, method)) for n, e in self.offering(method) if not (without and hasattr(e, without))]

    def energies(self, x: np.ndarray) -> dict[str, float]:
        """Potential energy [J] of each effect that has one."""
        return {name: self._timed(name, energy, x) for name, energy in self._energies}

    def energy(self, x: np.ndarray) -> float:
        """Potential energy [J]."""
        return sum(self.energies(x).values())

    def force(self, x: np.ndarray, v: np.ndarray) -> np.ndarray:
        """All nodal forces (n, 3) [N]; zero where a node is held."""
        return self._sum(self._forces, x, v)

    def explicit_force(self, x: np.ndarray, v: np.ndarray) -> np.ndarray:
        """The forces (n, 3) [N] of the effects that do not prefer to project."""
        return self._sum(self._explicit, x, v)

    def potential_force(self, x: np.ndarray) -> np.ndarray:
        """Minus the gradient of the energy (n, 3) [N]; zero where a node is held."""
        return self._sum(self._potential, x, np.zeros_like(x))

    def outer_force(self, x: np.ndarray, v: np.ndarray) -> np.ndarray:
        """The loads (n, 3) [N], whose work comes from outside."""
        return self._sum(self._outer, x, v)

    def magnitude(self, x: np.ndarray, most: float = np.inf) -> float:
        """Sum of the norms [N] of each effect's force on still, free nodes: how large the terms of a balance are.

        Of an effect with a ``limit``, whose force can grow beyond bound, no more than ``most`` [N] counts.
        """
        still = np.zeros_like(x)  # so that damping, which may be dear, has no part in it
        total = 0.0
        for call in self._potential + self._outer:
            norm = float(np.linalg.norm(self._sum([call], x, still)))
            total += min(norm, most) if hasattr(self.effects[call[0]], "limit") else norm
        return total

    def _sum(self, calls, x, v) -> np.ndarray:
        force = np.zeros_like(x)
        for name, add in calls:
            self._timed(name, add, x, v, force)
        force[self._fixed] = 0.0
        return force

    def stiffness(self, x: np.ndarray, definite: bool) -> sparse.bsr_array | None:
        """Hessian of the energy (3n, 3n) [N/m] on the shared pattern; None if no effect has any."""
        return self._assemble(self._stiff, x, definite)

    def damping(self, x: np.ndarray, explicit: bool = False) -> sparse.bsr_array | None:
        """Damping matrix (3n, 3n) [N s/m] on the shared pattern, with ``explicit`` that of ``explicit_force``; None if
        no effect damps."""
        return self._assemble(self._explicit_damped if explicit else self._damped, x)

    def _assemble(self, calls, *arguments) -> sparse.bsr_array | None:
        if not calls:
            return None
        values = np.zeros((len(self.pattern.indices), 3, 3))
        for name, add, slots in calls:
            self._timed(name, add, *arguments, slots, values)
        return self.pattern.matrix(values)

    def touching(self, x: np.ndarray, definite: bool) -> sparse.bsr_array | None:
        """The part of the Hessian (3n, 3n) [N/m] among nodes that come and go, such as those in contact; None if no
        effect has any."""
        found = [self._timed(name, call, x, definite) for name, call in self._touching]
        return gather(found, len(x)) if found else None

    @property
    def bounded(self) -> bool:
        """Whether an effect keeps steps from leading through something."""
        return bool(self._limits)

    def limit(self, x: np.ndarray, direction: np.ndarray) -> float:
        """How far along ``direction`` (n, 3) [m] the nodes may go from ``x``, in parts of it; at most 1."""
        return min(self._timed(name, call, x, direction) for name, call in self._limits)

    def begin(self, x: np.ndarray, h: float) -> np.ndarray:
        """Tell the effects that a step of ``h`` [s] to the present time begins at ``x`` (n, 3) [m]; where the search
        for its end may start: elsewhere, if something has been pushed into ``x``."""
        for name, call in self._begins:
            x = self._timed(name, call, x, h)
        return x

    def hold(self, matrix: sparse.bsr_array) -> None:
        """Replace the rows and columns of held nodes by those of the identity, in place."""
        if len(self._fixed):
            hold(matrix.indptr, matrix.indices, matrix.data, ~self.free)

    def goals(self, x: np.ndarray, out: np.ndarray) -> None:
        """Where the elastic effect draws each node, into ``out`` (n, 3) [m]."""
        self._change([(self._first, self.elastic.goals)], x, out)

    def at(self, t: float) -> None:
        """Tell the loads that the step ends at the time ``t`` [s]."""
        self.time = t
        for _, tell in self._told:
            tell(t)

    def project(self, start: np.ndarray, x: np.ndarray, v: np.ndarray, h: float) -> None:
        """What ends an explicit step from ``start``, in place."""
        self._change(self._projections, start, x, v, h)

    def relax(self, x: np.ndarray, h: float) -> None:
        """Let inner variables of effects follow an accepted step."""
        self._change(self._relaxed, x, h)

    def _change(self, calls, *arguments) -> None:
        for name, change in calls:
            self._timed(name, change, *arguments)

    def _timed(self, name, call, *arguments):
        start = perf_counter()
        result = call(*arguments)
        self.seconds[name] += perf_counter() - start
        return result
