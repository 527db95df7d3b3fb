"""Contact as an effect: bodies and instruments that never go through each other, with friction if asked for."""

from itertools import pairwise

import numpy as np
import pandas as pd

from palpate.bodies.particles import Particles
from palpate.bodies.surfaces.tetrahedralize import label_shells
from palpate.collision.contact import barrier
from palpate.collision.contact.contact_report import contacts, observed
from palpate.collision.contact.friction import lag
from palpate.collision.contact.initial_clearance import check_apart
from palpate.collision.contact.mass_projection import project
from palpate.collision.contact.moving_obstacles import carry
from palpate.collision.contact.obstacles import Obstacle, obstacle
from palpate.collision.contact.proximity import Near, Proximity
from palpate.errors import InputError, NotConverged

GAP = 1e-3
"""Distance at which surfaces begin to repel each other, in sizes of the smallest piece, if none is given."""
GAPS = 1e-7, 0.1
"""Least and largest of it: below, rounding tells on it, and above it is no longer small against the piece."""
HALVINGS = 8
"""How often an explicit step whose end is not found is cut in two before giving up."""
LEAP = 0.25
"""Way that one step of a search may lead, in sizes of the largest piece: what is farther off is met later."""


def make(particles: Particles, settings: dict, elastic) -> "Contact":
    """Contact of the particles' pieces with each other and with ``settings["instruments"]``, each as of ``obstacle``.

    settings : also ``gap_m`` [m], ``friction`` (Coulomb's coefficient), ``slip_m_s`` [m/s], above which it is at its
        limit, ``self_contact`` (whether a piece can meet itself); all may be left out

    Raises InputError for what ``obstacle`` refuses, and for a gap that does not suit the smallest piece.
    """
    middle, obstacles = particles.nodes.mean(axis=0), []
    for number, entry in enumerate(settings.get("instruments", [])):
        place = f"{particles.name}: contact.instruments[{number}]"
        obstacles.append(obstacle(entry, place, f"{entry['kind']}_{number}", particles.size, middle))
    size, gap = min(_sizes(particles, pieces_of(particles))), settings.get("gap_m")
    least, largest = (part * size for part in GAPS)
    if gap is not None and not least <= gap <= largest:
        raise InputError(
            f"{particles.name}: contact.gap_m is {gap:g}, and the smallest piece is {size:.3g} m long; "
            f"give from {least:.2g} to {largest:.2g}, or leave it out."
        )
    return Contact(particles, obstacles, settings)


class Contact:
    """A barrier that grows beyond bound as surfaces come to touch: E = Σ s g b(d/g), b(q) = −(q − 1)² ln q for q < 1,
    over pairs of a node and a triangle and of two edges at distances d (Li et al. 2020); g is ``gap_m`` and s Young's
    modulus times the nodes' area, so that a body pressed as hard as it is stiff keeps tenths of the gap.

    An implicit integrator takes the barrier as one more energy, and asks for the ``limit`` of each of its steps, so
    that none leads through a surface (Li, Kaufman, Jiang 2021). Explicit ones take ``project``: the step ends where
    ½ |z − x|²_M/h² + E(z) is least. Obstacles move first, and what they would run into goes along (``begin``).

    Friction has the directions and normal forces of the step's beginning, and below ``slip_m_s`` it creeps. Traps:
    surfaces at rest are up to ``gap_m`` apart, so make that small against what is to be resolved; a first touch is
    without friction for one step.
    """

    def __init__(self, particles: Particles, obstacles: list[Obstacle], settings: dict):
        self.obstacles = obstacles
        bodies = pieces_of(particles)
        sizes = _sizes(particles, bodies)
        self.gap_m = settings.get("gap_m") or GAP * min(sizes)
        self._friction, self._slip = settings.get("friction", 0.0), settings.get("slip_m_s", 1e-3)
        self._n, self._masses, self._leap = len(particles.nodes), particles.masses, LEAP * max(sizes)
        self._time, self._lagged, self._checked = 0.0, None, False
        self._before = np.zeros((self._n, 3))
        self._free = np.ones(self._n, dtype=bool)
        self._points = np.vstack([particles.nodes, *(o.points for o in obstacles)])
        starts = self._n + np.cumsum([0, *(len(o.points) for o in obstacles)])
        self._ranges = [slice(a, b) for a, b in pairwise(starts)]
        self._surfaces = bodies + [o.triangles + r.start for o, r in zip(obstacles, self._ranges, strict=True)]
        self.names = [f"{particles.name}_{i}" for i in range(len(bodies))] if len(bodies) > 1 else [particles.name]
        self.names += [o.name for o in obstacles]
        soft = np.arange(len(self.names)) < len(bodies)
        self._able = (soft[:, None] | soft) & ~np.diag(soft & (not settings.get("self_contact", False)))
        self._grounds = np.array([False] * len(bodies) + [o.kind == "floor" for o in obstacles])
        strengths = np.zeros(len(self._points))
        strengths[: self._n] = particles.material.young_pa * particles.areas
        self._radii = np.array([0.0] * len(bodies) + [o.radius_m for o in obstacles])
        self._proximity = Proximity(self._points, self._surfaces, self._radii, self._able, strengths, self.gap_m)
        for o, where in zip(obstacles, self._ranges, strict=True):
            self._proximity.movable[where] = len(o.times_s) > 0
        self._place(0.0)

    def hold(self, fixed: np.ndarray) -> None:
        """Know the nodes (k,) that stay where they are."""
        self._free[fixed] = False
        self._proximity.movable[fixed] = False

    def at(self, t: float) -> None:
        """The step ends at the time ``t`` [s]."""
        self._time = t

    def begin(self, x: np.ndarray, h: float) -> np.ndarray:
        """Move the obstacles over a step of ``h`` [s] that begins at ``x`` (n, 3) [m]; where nodes are then.

        Raises InputError if anything overlaps before the first step, NotConverged where an obstacle is driven into
        what is held, or bodies are between two.
        """
        self._place(self._time - h)
        start = self._all(x).copy()
        if not self._checked:
            check_apart(start, self._surfaces, self.names, self._able, self._grounds, self._near(start))
            self._checked = True
        if self._friction:
            near = self._proximity.look(start, 0.0)
            self._lagged = lag(*near.barrier, start, self._friction, self._slip * h, start)
        self._place(self._time)
        ways = self._all(x) - start
        return carry(self._proximity, start, ways, self._n, self.names) if ways.any() else x

    def energy(self, x: np.ndarray) -> float:
        """Energy [J] of the barrier at ``x`` (n, 3) [m], during a step also of friction; inf where anything touches."""
        points = self._all(x)
        energy = barrier.energy(*self._near(points).barrier, points)
        return energy + self._lagged.energy(points) if self._lagged else energy

    def add_force(self, x: np.ndarray, v: np.ndarray, force: np.ndarray) -> None:
        """Add the forces of contact to ``force`` (n, 3) [N]: minus the energy's gradient."""
        force += self.forces(x)[: self._n]

    def forces(self, x: np.ndarray) -> np.ndarray:
        """Forces [N] on nodes and, behind them, on the obstacles' points, at ``x`` (n, 3) [m]."""
        points, forces = self._all(x), np.zeros_like(self._points)
        barrier.add_force(*self._near(points).barrier, points, forces)
        if self._lagged:
            self._lagged.add_force(points, forces)
        return forces

    def touching(self, x: np.ndarray, definite: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The Hessian's blocks [N/m] between points in contact: rows (k,), columns (k,), (k, 3, 3); obstacles' points
        are numbered behind the nodes."""
        points = self._all(x)
        nodes, blocks = self._near(points).blocks(points, definite)
        if self._lagged:
            more, stiff = self._lagged.blocks(points, definite)
            nodes, blocks = np.vstack([nodes, more]), np.concatenate([blocks, stiff])
        return np.repeat(nodes, 4, axis=1).ravel(), np.tile(nodes, (1, 4)).ravel(), blocks.reshape(-1, 3, 3)

    def limit(self, x: np.ndarray, direction: np.ndarray) -> float:
        """The part of ``direction`` (n, 3) [m] that nodes may go from ``x`` and go through nothing; at most 1."""
        way = float(np.sqrt(np.square(direction).sum(axis=1).max()))
        part = min(1.0, self._leap / way) if way > 0.0 else 1.0
        points = self._all(x)
        ways = np.zeros_like(points)
        ways[: self._n] = part * direction
        return part * self._proximity.look(points, part * way).limit(points, ways)

    def project(self, start: np.ndarray, x: np.ndarray, v: np.ndarray, h: float) -> None:
        """End an explicit step from ``start`` to ``x`` (n, 3) [m] before it goes through anything, in place; velocities
        ``v`` [m/s] change with it. Raises NotConverged if no such end is found, and what ``begin`` raises."""
        self._project(start, x, v, h, HALVINGS)

    def _project(self, start, x, v, h, halvings):
        try:
            begin = self.begin(start, h)
            way = float(np.sqrt(np.square(x - begin).sum(axis=1).max()))
            if way <= self._leap and not len(self._proximity.look(self._all(begin), way).kinds):
                return
            reached = project(self, begin, x, self._free, self._masses / h**2, self._before)
        except NotConverged:
            if not halvings:
                raise
            self._in_two(start, x, v, h / 2, halvings - 1)
            return
        v += (reached - x) / h
        x[:] = reached

    def _in_two(self, start, x, v, half, halvings):
        """The same way at the same speed, with what ends its first half known in the second."""
        end, middle, before = self._time, 0.5 * (start + x), v.copy()
        self._time = end - half
        self._project(start, middle, v, half, halvings)
        x[:] = middle + 0.5 * (x - start) + half * (v - before)
        self._time = end
        self._project(middle, x, v, half, halvings)

    def relax(self, x: np.ndarray, h: float) -> None:
        """End a step: keep the forces on the obstacles, and let friction go."""
        forces = self.forces(x)
        self._before = forces[: self._n]
        self._reactions = [forces[r].sum(axis=0) for r in self._ranges]
        self._lagged = None

    def observe(self, x: np.ndarray) -> dict[str, float]:
        """Of each obstacle, after a step, by column: its place and the force on it, as ``observed`` has them."""
        return observed(self.obstacles, [self._points[r] for r in self._ranges], self._reactions)

    def contacts(self, x: np.ndarray) -> pd.DataFrame:
        """One row a contact at ``x`` (n, 3) [m], as ``touch.contacts`` has it."""
        points = self._all(x)
        return contacts(self._near(points), points, self.names, self._radii)

    def _near(self, points: np.ndarray) -> Near:
        return self._proximity.look(points, 0.0)

    def _place(self, t: float) -> None:
        for thing, where in zip(self.obstacles, self._ranges, strict=True):
            self._points[where] = thing.at(t)

    def _all(self, x: np.ndarray) -> np.ndarray:
        self._points[: self._n] = x
        return self._points


def pieces_of(particles: Particles) -> list[np.ndarray]:
    """The triangles (m, 3) of each piece that the particles fall into, in the order of their first triangles.

    The surfaces around a body and around what is hollow in it are of one piece, as its tetrahedra join them.
    """
    cells = np.vstack([particles.triangles, particles.tetrahedra[:, :3], particles.tetrahedra[:, 1:]])
    labels = label_shells(cells, len(particles.nodes))[: len(particles.triangles)]
    return [particles.triangles[labels == label] for label in dict.fromkeys(labels.tolist())]


def _sizes(particles: Particles, pieces: list[np.ndarray]) -> list[float]:
    """The longest side of each piece's box [m]: how far they are apart has no part in it."""
    return [float(np.ptp(particles.nodes[piece.ravel()], axis=0).max()) for piece in pieces]
