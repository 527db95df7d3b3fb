"""A system of nodes some of which are tied to others until a cut passes, and the steps of a body while it is cut.

Positions and velocities are always those of all nodes. A tied node has those of its leader, which has the masses,
forces and stiffnesses of both; its own unknown is left out of equations as that of a held node is. So the end of a tie
changes no position, velocity or history, and the energy is the same before and after, to the bit.
"""

import warnings
from collections.abc import Callable, Mapping
from dataclasses import replace
from time import perf_counter

import numpy as np
from scipy import sparse

from palpate.bodies.mesh import components
from palpate.bodies.particles import Particles
from palpate.effects import effect as hooks
from palpate.effects.effect import Effect, offers
from palpate.linalg.block_pattern import gather, hold
from palpate.solvers.system import Integrator, System

SAME_TIME = 1e-9
"""Fraction of a step by which a tie may end too early, as times of steps are rounded."""


class TiedSystem(System):
    """A ``System`` of particles with ``ties``."""

    leaders: np.ndarray

    def __init__(self, particles: Particles, effects: Mapping[str, Effect]):
        super().__init__(particles, effects)
        self.leaders = np.arange(len(particles.nodes))
        self._tied = np.empty(0, dtype=np.int64)

    def tie(self, leaders: np.ndarray) -> None:
        """Let each node move with the one in ``leaders`` (n,); a leader is its own."""
        particles = self.particles
        self.leaders, self._tied = leaders, np.flatnonzero(leaders != np.arange(len(leaders)))
        self._still = ~self.free
        self._still[self._tied] = True
        self.masses = np.bincount(leaders, particles.masses, minlength=len(leaders))
        self._lay_out([leaders[effect.couples] for _, effect in self.offering(hooks.Couples)])
        for _, follower in self.offering(hooks.Following):
            follower.follow(leaders)
        assert particles.ties is not None
        for _, effect in self.offering(hooks.Surface):
            # contact needs a mass at each node: that of a tied one is its own
            masses = np.where(self.masses > 0.0, self.masses, particles.masses)
            effect.resurface(replace(particles, triangles=particles.ties.surface(leaders), masses=masses))

    def let_go(self, x: np.ndarray, leaders: np.ndarray) -> None:
        """End all ties but those to ``leaders`` (n,), at positions ``x`` (n, 3) [m].

        The energy that contact gains, as the edges of open lips can touch, counts as work.
        """
        of_contact = [effect.energy for _, effect in self.offering(hooks.Surface) if offers(effect, hooks.Energy)]
        before = sum(energy(self.followed(x)) for energy in of_contact)
        self.tie(leaders)
        self._load_work += sum(energy(self.followed(x)) for energy in of_contact) - before

    def followed(self, x: np.ndarray) -> np.ndarray:
        return x[self.leaders]

    def balance(self, force: np.ndarray) -> None:
        np.add.at(force, self.leaders[self._tied], force[self._tied])
        force[self._still] = 0.0

    def touching(self, x: np.ndarray, definite: bool) -> sparse.bsr_array | None:
        matrix = super().touching(x, definite)
        if matrix is None:
            return None
        # a sum of sparse matrices leaves blocks of zeros out, and ``hold`` needs the diagonal
        return matrix + gather([(self._tied, self._tied, np.tile(np.eye(3), (len(self._tied), 1, 1)))], len(x))

    def hold(self, matrix: sparse.bsr_array) -> None:
        hold(matrix.indptr, matrix.indices, matrix.data, self._still)

    def project(self, start: np.ndarray, x: np.ndarray, v: np.ndarray, h: float) -> None:
        x[:], v[:] = self.followed(x), self.followed(v)
        super().project(start, x, v, h)


class TiedSteps:
    """The steps of an integrator, with the ties that a cut ends during a step ended at its start.

    make : makes the integrator anew after each change, unless it has ``renew``, by which it keeps its history
    limit_s : the longest stable step [s] when all ties have ended; with ties, no frequency is higher

    Warns if the cut will free a piece that nothing holds, and no weight lets it fall.
    """

    _untying: hooks.Untying | None

    def __init__(self, system: TiedSystem, integrator: Integrator, make: Callable[[], Integrator]):
        self._system, self._integrator, self._make = system, integrator, make
        self.limit_s = integrator.limit_s
        untying = system.offering(hooks.Untying)
        self._name, self._untying = untying[0] if untying else ("", None)
        self._left = np.empty(0) if self._untying is None else self._untying.changes_s
        assert system.particles.ties is not None
        system.tie(system.particles.ties.leaders())
        self._renew()
        if self._untying is not None and not system.offering(hooks.Weight):
            _warn_of_loose_pieces(system)

    def step(self, x: np.ndarray, v: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray]:
        now = self._system.time - h * (1.0 - SAME_TIME)
        if self._untying is not None and len(self._left) and self._left[0] <= now:
            start = perf_counter()
            self._left = self._left[np.searchsorted(self._left, now, side="right") :]
            self._system.let_go(x, self._untying.leaders(now))
            self._renew()
            self._system.seconds[self._name] += perf_counter() - start
        return self._followed(self._integrator.step(x, v, h))

    def _renew(self) -> None:
        if hasattr(self._integrator, "renew"):
            self._integrator.renew()
        else:
            self._integrator = self._make()

    def _followed(self, state: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """Put tied nodes where their leaders are, in place, so that the integrator's history agrees."""
        for each in state:
            each[:] = self._system.followed(each)
        return state


def _warn_of_loose_pieces(system: TiedSystem) -> None:
    """Warn if a cut frees pieces that nothing holds, of a body that is held."""
    body = system.particles
    piece = components(body.tetrahedra[:, [0, 1, 0, 2, 0, 3]].reshape(-1, 2), len(body.nodes))
    masses, held = np.bincount(piece, body.masses), np.bincount(piece, ~system.free)
    share = masses[held == 0].sum() / masses.sum()
    if 0.0 < share < 1.0:
        warnings.warn(
            f"{body.name}: the cut frees {share:.1%} of the mass, which nothing holds and no gravity moves; give the "
            "scene gravity, or cut less deep.",
            stacklevel=2,
        )
