"""Contact as an effect: a barrier by which bodies and instruments never intersect, with optional friction."""

from itertools import pairwise

import numpy as np
import pandas as pd
from scipy import sparse

from palpate.bodies.particles import Particles
from palpate.collision.contact import barrier
from palpate.collision.contact.friction import LaggedFriction
from palpate.collision.contact.instrument_contact import InstrumentContact
from palpate.collision.contact.obstacles import (
    Obstacle,
    Overlap,
    displace_nodes,
    first_overlap,
    make_obstacle,
    nodes_of_pieces,
    pieces_of,
)
from palpate.collision.contact.proximity import NearStencils, Proximity
from palpate.collision.contact.push_apart import Movable, start_outside
from palpate.effects import effect, settings
from palpate.errors import InputError, NotConverged
from palpate.linalg.block_pattern import gather, hold
from palpate.linalg.minimiser import Product, minimise_by_newton
from palpate.linalg.multigrid import Factor

TOLERANCE = 1e-8
"""Relative residual at which a projection has converged."""
MAX_ITERATIONS = 40
"""Iterations of Newton's method: where one obstacle after another stops them, it is better to halve the step."""


def project(contact: "Contact", start: np.ndarray, target: np.ndarray, inertia: np.ndarray) -> np.ndarray:
    """Return the z (n, 3) [m] of least ½ Σ inertia |z − target|² + E(z), reached without intersection from ``start``.

    E : the energy of ``contact``; inertia : (n,) [N/m], mass over squared step
    Held nodes stay. One of three initial guesses has the forces of the last step, which saves half of the iterations.
    Raises NotConverged if the minimum is not found.
    """
    free = contact._free[:, None]
    target = np.where(free, target, start)
    problem = _Problem(contact, target, inertia)
    displacement = target - start
    guess = displacement + np.where(free, contact._last_forces / inertia[:, None], 0.0)
    starts = [start, *(start + contact.limit(start, motion) * motion for motion in (displacement, guess))]
    start = min(starts, key=problem.energy)
    scale = float(np.linalg.norm(inertia[:, None] * displacement)) + float(np.linalg.norm(problem.force(start)))
    return minimise_by_newton(problem, start, scale, TOLERANCE, MAX_ITERATIONS).x if scale > 0.0 else start


class _Problem:
    """The energy that ``project`` minimises, as a ``minimiser.Problem``."""

    def __init__(self, contact: "Contact", target: np.ndarray, inertia: np.ndarray):
        self._contact, self._target, self._free, self._inertia = contact, target, contact._free, inertia[:, None]

    def energy(self, z: np.ndarray) -> float:
        away = z - self._target
        return 0.5 * float(np.vdot(self._inertia * away, away)) + self._contact.energy(z)

    def force(self, z: np.ndarray) -> np.ndarray:
        force = -self._inertia * (z - self._target)
        self._contact.add_force(z, np.zeros_like(z), force)
        return np.where(self._free[:, None], force, 0.0)

    def limit(self, z: np.ndarray, direction: np.ndarray) -> float:
        return self._contact.limit(z, direction)

    def linearise(self, z: np.ndarray, definite: bool) -> tuple[Product, Product]:
        matrix = self._matrix(z, definite)
        return lambda p: (matrix @ p.ravel()).reshape(p.shape), Factor(matrix).solve

    def _matrix(self, z: np.ndarray, definite: bool) -> sparse.bsr_array:
        alone = np.arange(len(z))
        masses = alone, alone, self._inertia[:, :, None] * np.eye(3)
        matrix = gather([masses, self._contact.touching(z, definite)], len(z))
        hold(matrix.indptr, matrix.indices, matrix.data, ~self._free)
        return matrix


GAP = 1e-3
"""Distance at which surfaces begin to repel each other, relative to the size of the smallest piece; the default."""
GAPS = 1e-7, 0.1
"""Least and largest relative gap: below, rounding matters, and above it is no longer small against the piece."""
HALVINGS = 8
"""Number of times that an explicit step is halved, if its projection fails, before giving up."""
MAX_TRAVEL = 0.25
"""Longest motion in one step of a search, in sizes of the largest piece, which bounds how far near pairs are sought."""


def make(particles: Particles, contact: settings.Contact, elastic: effect.Effect | None) -> "Contact":
    """Make the contact of the particles' pieces with each other and with the instruments.

    Raises InputError for what ``make_obstacle`` and ``Contact`` refuse.
    """
    middle, obstacles = particles.nodes.mean(axis=0), []
    for number, tool in enumerate(contact.instruments):
        place = f"{particles.name}: contact.instruments[{number}]"
        obstacles.append(make_obstacle(tool, place, f"{tool.kind}_{number}", particles.size, middle))
    return Contact(particles, obstacles, contact)


class Contact(
    effect.Energy, effect.Time, effect.HeldNodes, effect.Placement, effect.StepBegin, effect.Driven, effect.StepLimit,
    effect.Touching, effect.Instrumented, effect.Surface, effect.Projection, effect.Relaxation, effect.Observation,
    effect.Contacts,
):  # fmt: skip
    """Barrier contact with optional friction, for implicit and explicit integrators.

    E = Σ s g b(d/g), b(q) = −(q − 1)² ln q for q < 1, over pairs of a node and a triangle and of two edges at
    distances d (Li et al. 2020); g is ``gap_m`` and s Young's modulus times the nodes' area, so that a body pressed as
    hard as it is stiff keeps tenths of the gap.

    An implicit integrator adds the barrier to its energy, and asks for the ``limit`` of each of its steps, so
    that none passes through a surface (Li, Kaufman, Jiang 2021). Explicit ones use ``project``: the step ends where
    ½ |z − x|²_M/h² + E(z) is least. Obstacles move first, and nodes in their path move along (``begin``).

    Friction uses the directions and normal forces at the step's beginning, and creeps below ``slip_m_s``. Traps:
    surfaces at rest are up to ``gap_m`` apart, so make that small against the resolution; a first touch has no
    friction for one step.

    Raises InputError for a gap that does not suit the smallest piece.
    """

    def __init__(self, particles: Particles, obstacles: list[Obstacle], options: settings.Contact):
        self.obstacles: list[Obstacle] = obstacles
        bodies = pieces_of(particles)
        sizes = [float(np.ptp(particles.nodes[piece.ravel()], axis=0).max()) for piece in bodies]
        size, gap = min(sizes), options.gap_m
        least, largest = (fraction * size for fraction in GAPS)
        if gap is not None and not least <= gap <= largest:
            raise InputError(
                f"{particles.name}: contact.gap_m is {gap:g}, and the smallest piece is {size:.3g} m long; "
                f"give from {least:.2g} to {largest:.2g}, or leave it out."
            )
        self.gap_m = gap or GAP * size
        self._friction, self._slip = options.friction, options.slip_m_s
        self._n, self._max_travel = len(particles.nodes), MAX_TRAVEL * max(sizes)
        self._time, self._checked, self.work_j = 0.0, False, 0.0
        self._together = nodes_of_pieces(particles) if options.push_out else []
        self._lagged: LaggedFriction | None = None
        self.settings = options
        self._instruments: InstrumentContact | None = None
        self._last_forces = np.zeros((self._n, 3))
        self._free = np.ones(self._n, dtype=bool)
        self._points = np.vstack([particles.nodes, *(o.points for o in obstacles)])
        starts = self._n + np.cumsum([0, *(len(o.points) for o in obstacles)])
        self._ranges = [slice(a, b) for a, b in pairwise(starts)]
        self._surfaces = bodies + [o.triangles + r.start for o, r in zip(obstacles, self._ranges, strict=True)]
        self.names = [f"{particles.name}_{i}" for i in range(len(bodies))] if len(bodies) > 1 else [particles.name]
        self.names += [o.name for o in obstacles]
        is_body = np.arange(len(self.names)) < len(bodies)
        self._can_touch = (is_body[:, None] | is_body) & ~np.diag(is_body & (not options.self_contact))
        self._is_floor = np.array([False] * len(bodies) + [o.kind == "floor" for o in obstacles])
        self._radii = np.array([0.0] * len(bodies) + [o.radius_m for o in obstacles])
        self._began, self._lasts = self._points.copy(), np.inf
        self._take(particles)
        self._move_obstacles(0.0)

    def resurface(self, particles: Particles) -> None:
        bodies = pieces_of(particles)
        self._surfaces[: len(bodies)] = bodies
        self._take(particles)

    def _take(self, particles: Particles) -> None:
        """Take the masses of ``particles``, and make the search for near pairs of the present surfaces."""
        self._masses, rest = particles.masses, self._points.copy()
        rest[: self._n] = particles.nodes
        strengths = np.zeros(len(rest))
        strengths[: self._n] = particles.nodal_young_pa() * particles.areas
        self._proximity = Proximity(rest, self._surfaces, self._radii, self._can_touch, strengths, self.gap_m)
        for obstacle, points in zip(self.obstacles, self._ranges, strict=True):
            self._proximity.movable[points] = len(obstacle.times_s) > 0
        self._proximity.movable[: self._n] = self._free

    def hold(self, fixed: np.ndarray) -> None:
        self._free[fixed] = False
        self._proximity.movable[fixed] = False

    def place(self, x: np.ndarray) -> np.ndarray:
        """Return the nodes (n, 3) [m] at the start: ``x``, moved out of overlaps if the scene has ``push_out``.

        Raises InputError if overlaps remain.
        """
        if not self._together:
            return x
        parts = (self._together, self._ranges, self._surfaces, self._radii, self._is_floor)
        movable = Movable(*parts, self._masses, self._free, self.gap_m)
        return start_outside(self._all_points(x).copy(), movable, self._overlap, self._proximity, self.names)

    def at(self, t: float) -> None:
        self._time = t

    def begin(self, x: np.ndarray, h: float) -> np.ndarray:
        """Move the obstacles over a step of ``h`` [s] that begins at ``x`` (n, 3) [m]; return the nodes' new positions.

        Raises InputError if anything overlaps before the first step, NotConverged if an obstacle is driven into
        held nodes, or bodies are caught between two obstacles.
        """
        self._move_obstacles(self._time - h)
        start = self._began = self._all_points(x).copy()
        self._lasts = h
        if not self._checked:
            if overlap := self._overlap(start):
                raise InputError(overlap.describe(self.names))
            self._checked = True
        if self._friction:
            near = self._proximity.find_near(start, 0.0)
            self._lagged = LaggedFriction(near.barrier, start, self._friction, self._slip * h, start)
        self._move_obstacles(self._time)
        motion = self._all_points(x) - start
        self._path = motion[self._n :]
        return displace_nodes(self._proximity, start, motion, self._n, self.names) if motion.any() else x

    def end(self, x: np.ndarray) -> None:
        """Add to ``work_j`` the obstacles' motion since ``begin`` against the forces on them now, friction included.

        With the forces at the end, as backward Euler takes all others, no step of a convex energy gains more than that.
        """
        if self._path.any():
            self.work_j -= float(np.vdot(self.forces(x)[self._n :], self._path))

    def energy(self, x: np.ndarray) -> float:
        """Return the energy [J] of the barrier at ``x`` (n, 3) [m], and that of friction during a step.

        It is infinite where surfaces touch.
        """
        points = self._all_points(x)
        energy = barrier.energy(*self._near(points).barrier, points)
        return energy + self._lagged.energy(points) if self._lagged else energy

    def add_force(self, x: np.ndarray, v: np.ndarray, force: np.ndarray) -> None:
        force += self.forces(x)[: self._n]

    def forces(self, x: np.ndarray) -> np.ndarray:
        """Compute forces [N] on the nodes, followed by those on the obstacles' points, at ``x`` (n, 3) [m]."""
        points, forces = self._all_points(x), np.zeros_like(self._points)
        barrier.add_force(*self._near(points).barrier, points, forces)
        if self._lagged:
            self._lagged.add_force(points, forces)
        return forces

    def touching(self, x: np.ndarray, definite: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Compute the Hessian's blocks [N/m] between points in contact: rows (k,), columns (k,), (k, 3, 3).

        The obstacles' points are numbered after the nodes.
        """
        points = self._all_points(x)
        nodes, blocks = self._near(points).blocks(points, definite)
        if self._lagged:
            friction_nodes, friction_blocks = self._lagged.blocks(points, definite)
            nodes, blocks = np.vstack([nodes, friction_nodes]), np.concatenate([blocks, friction_blocks])
        return np.repeat(nodes, 4, axis=1).ravel(), np.tile(nodes, (1, 4)).ravel(), blocks.reshape(-1, 3, 3)

    def instruments_on(self) -> InstrumentContact:
        """Return the contact with the instruments alone, whose steps the caller then makes.

        InputError if bodies can touch each other or themselves, if there are no instruments, or one touches at rest.
        """
        bodies = len(self.names) - len(self.obstacles)
        if bodies > 1 or self._can_touch[:bodies, :bodies].any():
            raise InputError("bodies that touch each other or themselves have no such modes; choose backward_euler.")
        if not self.obstacles:
            raise InputError("contact has no instruments; give it one, or choose another integrator.")
        if overlap := self._overlap(self._points):
            raise InputError(overlap.describe(self.names))
        self._instruments = InstrumentContact(self.obstacles, self._friction, self._slip)
        return self._instruments

    def limit(self, x: np.ndarray, direction: np.ndarray) -> float:
        travel = float(np.sqrt(np.square(direction).sum(axis=1).max()))
        fraction = min(1.0, self._max_travel / travel) if travel > 0.0 else 1.0
        points = self._all_points(x)
        motion = np.zeros_like(points)
        motion[: self._n] = fraction * direction
        return fraction * self._proximity.find_near(points, fraction * travel).limit(points, motion)

    def project(self, start: np.ndarray, x: np.ndarray, v: np.ndarray, h: float) -> None:
        """End an explicit step from ``start`` to ``x`` (n, 3) [m] before it intersects, changing ``x`` and ``v`` [m/s].

        Raises NotConverged if no such end is found, and whatever ``begin`` raises.
        """
        self._project(start, x, v, h, HALVINGS)

    def _project(self, start, x, v, h, halvings):
        """Do what ``project`` does, in two halves where no end is found, with up to so many ``halvings``."""
        try:
            begin = self.begin(start, h)
            travel = float(np.sqrt(np.square(x - begin).sum(axis=1).max()))
            if travel <= self._max_travel and not len(self._proximity.find_near(self._all_points(begin), travel).kinds):
                return
            projected = project(self, begin, x, self._masses / h**2)
        except NotConverged:
            if not halvings:
                raise
            self._halve_step(start, x, v, h / 2, halvings - 1)
            return
        self.end(projected)
        v += (projected - x) / h
        x[:] = projected

    def _halve_step(self, start, x, v, half, halvings):
        """Take the step in two halves, the second from where contact has let the first one end."""
        end, middle, before = self._time, 0.5 * (start + x), v.copy()
        self._time = end - half
        self._project(start, middle, v, half, halvings)
        x[:] = middle + 0.5 * (x - start) + half * (v - before)
        self._time = end
        self._project(middle, x, v, half, halvings)

    def relax(self, x: np.ndarray, h: float) -> None:
        """End a step: store the forces on the obstacles, and reset friction."""
        if self._instruments is not None:
            self._reactions, self.work_j = list(self._instruments.reactions), self._instruments.work_j
            self._began, self._lasts = self._points.copy(), h
            self._move_obstacles(self._time)
            self._all_points(x)
            return
        forces = self.forces(x)
        self._last_forces = forces[: self._n]
        self._reactions = [forces[r].sum(axis=0) for r in self._ranges]
        self._lagged = None

    def observe(self, x: np.ndarray) -> dict[str, float]:
        """Return each obstacle's mean point, ``<name>_x_m`` …, and the force on it, ``<name>_force_x_n`` …

        If ``instruments_on`` was called, also the mean force over the step, ``<name>_mean_force_x_n`` …
        """
        row = {}
        for obstacle, where, force in zip(self.obstacles, self._ranges, self._reactions, strict=True):
            for axis, letter in enumerate("xyz"):
                row[f"{obstacle.name}_{letter}_m"] = float(self._points[where, axis].mean())
                row[f"{obstacle.name}_force_{letter}_n"] = float(force[axis])
        if self._instruments is not None:
            for obstacle, mean in zip(self.obstacles, self._instruments.means, strict=True):
                row |= {
                    f"{obstacle.name}_mean_force_{letter}_n": float(mean[axis]) for axis, letter in enumerate("xyz")
                }
        return row

    def contacts(self, x: np.ndarray) -> pd.DataFrame:
        """Return a table with a row for each pair in contact at ``x`` (n, 3) [m].

        first, second : names of the surfaces, in the order of ``names``; x_m, y_m, z_m : midway between them;
        normal_x … : from the second to the first; gap_m : their clearance, which a barrier keeps positive;
        velocity_x_m_s … : of the first relative to the second there, mean over the step; force_n : along the normal
        """
        points = self._all_points(x)
        near, velocities = self._near(points), (points - self._began) / self._lasts
        active = LaggedFriction(near.barrier, points, 1.0, 1.0, points)
        sides, normals = near.pieces[active.rows], active.normals
        ends = np.einsum("ki,kij->kj", np.maximum(active.weights, 0.0), points[active.nodes])
        others = -np.einsum("ki,kij->kj", np.minimum(active.weights, 0.0), points[active.nodes])
        distance = np.linalg.norm(ends - others, axis=1)
        middle = 0.5 * (ends + others) + 0.5 * (self._radii[sides[:, 1]] - self._radii[sides[:, 0]])[:, None] * normals
        sign = np.where(sides[:, 0] <= sides[:, 1], 1.0, -1.0)[:, None]
        normals = sign * normals
        relative = sign * np.einsum("ki,kij->kj", active.weights, velocities[active.nodes])
        sides = np.sort(sides, axis=1).T
        columns = {side: [self.names[i] for i in row] for side, row in zip(("first", "second"), sides, strict=True)}
        for start, values, unit in (("", middle, "_m"), ("normal_", normals, ""), ("velocity_", relative, "_m_s")):
            columns |= {f"{start}{letter}{unit}": values[:, axis] for axis, letter in enumerate("xyz")}
        return pd.DataFrame(columns | {"gap_m": distance - near.offsets[active.rows], "force_n": active.forces})

    def _overlap(self, points: np.ndarray) -> Overlap | None:
        return first_overlap(points, self._surfaces, self._can_touch, self._is_floor, self._near(points))

    def _near(self, points: np.ndarray) -> NearStencils:
        return self._proximity.find_near(points, 0.0)

    def _move_obstacles(self, t: float) -> None:
        for obstacle, where in zip(self.obstacles, self._ranges, strict=True):
            self._points[where] = obstacle.at(t)

    def _all_points(self, x: np.ndarray) -> np.ndarray:
        self._points[: self._n] = x
        return self._points
