"""Hooks: patches of the surface that are grasped and moved, or pulled by a force, and let go."""

from dataclasses import replace
from itertools import combinations
from typing import NamedTuple

import numpy as np

from palpate.bodies.mesh import area_normals, components, corner_normals
from palpate.bodies.particles import Particles
from palpate.bodies.surface_quadrature import near_ball
from palpate.effects import effect, settings
from palpate.effects.effect import Effect, Shape, Stiffness, offers
from palpate.effects.patch_load import SAME_S, Patch, containing, course, load_point, patch_shares
from palpate.errors import InputError
from palpate.linalg.block_pattern import shared_pattern

GRIP = 1e4
"""Stiffness by which a hook grasps a node, over the elastic stiffness of the node while all others are fixed. So the
node is behind the hook by a ten-thousandth of the displacement by its force alone."""
ALIKE = 0.5
"""Least cosine between the normals of the grasped triangles and of their middle: leaves out the far side of a thin body
and the lips of a cut."""
ABOVE = 0.004
"""Height of a hook over the surface in pictures, in sizes of the body."""


def make(particles: Particles, options: list[settings.Hook], elastic: Effect | None) -> "Hooks":
    """Make all hooks of a scene.

    Raises InputError for one off the surface, wider than the body, on held nodes, or on nodes of another hook.
    """
    stiffness = _nodal_stiffness(particles, elastic)
    hooks = [_hook(particles, i, hook, stiffness) for i, hook in enumerate(options)]
    for (i, a), (j, b) in combinations(enumerate(hooks), 2):
        begin, end = max(a.times.start, b.times.start), min(a.times.end, b.times.end)
        if isinstance(a, MovedPatch) and isinstance(b, MovedPatch) and begin < end and _meet(particles, a, b, begin):
            raise InputError(
                f"{particles.name}: hooks[{i}] and hooks[{j}] hold the same nodes from {begin:g} s on; move one, "
                "or let one start when the other has let go, or when a blade has passed between them."
            )
    return Hooks(particles, hooks)


def _meet(particles: Particles, a: "MovedPatch", b: "MovedPatch", t: float) -> bool:
    """Return whether two hooks have a node in common at ``t`` [s]; nodes of lips that are still closed are one node."""
    ties = particles.ties
    leaders = np.arange(len(particles.nodes)) if ties is None else ties.leaders(t)
    return bool(np.isin(leaders[a.nodes], leaders[b.nodes]).any())


def _hook(
    particles: Particles, number: int, options: settings.Hook, stiffness: np.ndarray
) -> "MovedPatch | PulledPatch":
    """Return hook ``number``: pulled if ``options`` have a force, or moved; stiffness : of ``_nodal_stiffness``."""
    place, radius = f"{particles.name}: hooks[{number}]", float(options.radius_m)
    times = Times(options.start_s, options.pull_s, options.hold_s, options.release_s)
    facet, weights = load_point(particles, particles.held, place, options)
    skin, at_point, normal = _skin_at(particles, facet, weights)
    corners, disc = particles.nodes[skin], Patch(weights @ particles.nodes[facet], normal, radius)
    in_disc = (np.linalg.norm(corners - disc.center_m, axis=2) <= radius).all(axis=1)
    node = int(facet[weights.argmax()])
    grasped = _joined(skin[in_disc | at_point], node)
    if options.force_n is not None:
        side = replace(particles, triangles=_joined(skin[near_ball(corners, disc.center_m, radius) | at_point], node))
        return PulledPatch(times, grasped, *patch_shares(side, disc), np.array(options.force_n, dtype=float), particles)
    nodes = np.unique(grasped)
    if np.isin(nodes, particles.held).any():
        raise InputError(
            f"{place} grasps nodes that are held; move it away from the anchors, or give it less radius_m."
        )
    return MovedPatch(times, grasped, nodes, GRIP * stiffness[nodes], np.array(options.shift_m, dtype=float), particles)


def _skin_at(particles: Particles, facet: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the triangles (t, 3) that face as a facet does, which of them contain a point of it, and the normal there.

    weights : barycentric coordinates (3,) of the point in the facet
    At a cut, whose nodes are double, the triangles are those of the facet's side, without the lips.
    """
    normals = area_normals(particles.nodes, particles.triangles)
    outward = corner_normals(particles.nodes[facet])
    facing = normals @ outward > ALIKE * np.linalg.norm(normals, axis=1) * np.linalg.norm(outward)
    skin = particles.triangles[facing]
    at_point = containing(skin, facet, weights)
    normal = normals[facing][at_point].sum(axis=0)
    return skin, at_point, normal / np.linalg.norm(normal)


def _joined(triangles: np.ndarray, node: int) -> np.ndarray:
    """Return those of ``triangles`` (t, 3) that are connected to a node by others, so none on the far side of a cut."""
    pieces = components(triangles[:, [0, 1, 1, 2]].reshape(-1, 2), int(triangles.max(initial=node)) + 1)
    return triangles[pieces[triangles[:, 0]] == pieces[node]]


def _nodal_stiffness(particles: Particles, elastic: Effect | None) -> np.ndarray:
    """Return the elastic stiffness (n,) [N/m] of each node at rest while all others are fixed; 0 without elements."""
    if elastic is None or not offers(elastic, Stiffness):
        return np.zeros(len(particles.nodes))
    pattern = shared_pattern([elastic.couples], len(particles.nodes))
    values = np.zeros((len(pattern.indices), 3, 3))
    elastic.add_stiffness(particles.nodes, True, pattern.slots[0], values)
    return np.trace(values[pattern.diagonal], axis1=1, axis2=2) / 3.0


class Times(NamedTuple):
    """When a hook grasps, and how long it pulls, holds and goes back before it lets go [s]."""

    start: float
    pull: float
    hold: float
    release: float

    @property
    def end(self) -> float:
        """When it lets go [s]."""
        return self.start + self.pull + self.hold + self.release

    def course(self, t: float) -> float:
        """Return the factor of shift or force at ``t`` [s]; without a release it is constant until the hook lets go."""
        return course(t - self.start, self.pull, self.hold, self.release or np.inf) if self.grasps(t) else 0.0

    def grasps(self, t: float) -> bool:
        """Return whether the hook holds the body in a step that ends at ``t`` [s]."""
        return t - self.start > SAME_S and t <= self.end + SAME_S


class _Hook:
    """A hook that grasps ``triangles`` (t, 3) and ``nodes`` (k,) of a body.

    led : the nodes that these move with, each once; masses : of those [kg]
    since, t : start and end of the step [s]; force : (3,) [N] on the body at the end of the last step
    """

    def __init__(self, times: Times, triangles: np.ndarray, nodes: np.ndarray, particles: Particles):
        self.times, self.triangles, self.nodes = times, triangles, nodes
        self.t, self.since, self.force, self._all = 0.0, 0.0, np.zeros(3), particles.masses
        self.follow(np.arange(len(particles.nodes)))

    def follow(self, leaders: np.ndarray) -> None:
        """Act on the leader of each node, of ``leaders`` (n,), instead of on the node."""
        self.led, self._first, self._of = np.unique(leaders[self.nodes], return_index=True, return_inverse=True)
        self.masses = np.bincount(leaders, self._all, minlength=len(leaders))[self.led]

    @property
    def grasps(self) -> bool:
        return self.times.grasps(self.t)

    @property
    def gain(self) -> float:
        """The increase of the factor of shift or force in the step."""
        return self.times.course(self.t) - self.times.course(self.since)


class MovedPatch(_Hook):
    """A patch each of whose nodes moves by shift · course(t) from where it was at the start.

    stiffness : (k,) [N/m] of the grip; shift : (3,) [m]
    """

    def __init__(
        self, times: Times, triangles: np.ndarray, nodes: np.ndarray, stiffness: np.ndarray, shift: np.ndarray,
        particles: Particles,
    ):  # fmt: skip
        super().__init__(times, triangles, nodes, particles)
        self.stiffness, self._shift, self._origin = stiffness, shift, particles.nodes[nodes]

    def _lag(self, x: np.ndarray) -> np.ndarray:
        """Return the vectors (k, 3) [m] from the nodes to where the hook has them."""
        return self._origin + self.times.course(self.t) * self._shift - x[self.nodes]

    def energy(self, x: np.ndarray) -> float:
        return 0.5 * float(self.stiffness @ np.square(self._lag(x)).sum(axis=1))

    def add_force(self, x: np.ndarray, force: np.ndarray) -> None:
        force[self.nodes] += self.stiffness[:, None] * self._lag(x)

    def begin(self, start: np.ndarray, x: np.ndarray, h: float) -> None:
        """Move the nodes in ``x`` (n, 3) [m], in place, by the hook's shift in a step of ``h`` [s] from ``start``."""
        self.since = self.t - h
        if self.since <= self.times.start + SAME_S:
            self._origin = start[self.nodes].copy()
        if self.grasps:
            x[self.nodes] += self.gain * self._shift

    def end(self, x: np.ndarray) -> float:
        """Return the work [J] of the hook in an implicit step that ends at ``x`` (n, 3) [m]."""
        return self._work((self.stiffness[:, None] * self._lag(x)).sum(axis=0))

    def project(self, start: np.ndarray, x: np.ndarray, v: np.ndarray, h: float) -> float:
        """Move the nodes at the end of an explicit step, in place; return the work [J]."""
        self.begin(start, start.copy(), h)
        lag = self._lag(x)[self._first]
        if self.grasps:
            x[self.led] += lag
            v[self.led] = (x[self.led] - start[self.led]) / h
        return self._work((self.masses[:, None] * lag).sum(axis=0) / h**2)

    def _work(self, force: np.ndarray) -> float:
        self.force = force if self.grasps else np.zeros(3)
        return float(self.force @ self._shift) * self.gain


class PulledPatch(_Hook):
    """A patch under force · course(t), a dead load [N] with the ``shares`` (k,) of ``patch_shares``."""

    def __init__(
        self, times: Times, triangles: np.ndarray, nodes: np.ndarray, shares: np.ndarray, pull: np.ndarray,
        particles: Particles,
    ):  # fmt: skip
        super().__init__(times, triangles, nodes, particles)
        self._shares, self._pull, self._rest, self._moved = shares, pull, particles.nodes[nodes], np.zeros(3)

    def hold(self, fixed: np.ndarray) -> None:
        """Set the shares of ``fixed`` nodes to zero, as their supports take them."""
        self._shares = np.where(np.isin(self.nodes, fixed), 0.0, self._shares)

    def _loads(self) -> np.ndarray:
        return self.times.course(self.t) * np.outer(self._shares, self._pull)

    def _mean(self, x: np.ndarray) -> np.ndarray:
        """Return the mean displacement (3,) [m] of the patch, on which the force does work."""
        return self._shares @ (x[self.nodes] - self._rest)

    def energy(self, x: np.ndarray) -> float:
        return -float(np.vdot(self._loads(), x[self.nodes] - self._rest))

    def add_force(self, x: np.ndarray, force: np.ndarray) -> None:
        force[self.nodes] += self._loads()

    def begin(self, start: np.ndarray, x: np.ndarray, h: float) -> None:
        self.since, self._moved = self.t - h, self._mean(start)

    def end(self, x: np.ndarray) -> float:
        """Return the change [J] of the potential −force · displacement by that of the force in the step."""
        self.force = self._loads().sum(axis=0)
        return -float(self._pull @ self._moved) * self.gain

    def project(self, start: np.ndarray, x: np.ndarray, v: np.ndarray, h: float) -> float:
        self.begin(start, start, h)
        faster = np.zeros((len(self.led), 3))
        np.add.at(faster, self._of, h * self._loads())
        faster /= self.masses[:, None]
        v[self.led] += faster
        x[self.led] += h * faster
        return self.end(x)


class Hooks(
    effect.Energy, effect.Stiffness, effect.Time, effect.HeldNodes, effect.Following, effect.StepBegin, effect.Driven,
    effect.Projection, effect.Observation, effect.Drawn,
):  # fmt: skip
    """All hooks of a scene: E = Σ ½ GRIP k |x − x_hook|² over moved nodes − Σ force · displacement of pulled patches.

    Explicit integrators put moved nodes exactly where hooks are. The work of a shift is that against the force at the
    end of a step. The potential of a force f counts as energy, as that of weight does, so that its work is the change
    −∫ displacement · df. Until ``at`` is called nothing is grasped.
    """

    def __init__(self, particles: Particles, hooks: list[MovedPatch | PulledPatch]):
        self.hooks, self.work_j, self._above = hooks, 0.0, ABOVE * particles.size
        self._moved = [hook for hook in hooks if isinstance(hook, MovedPatch)]
        self.couples = np.concatenate([np.empty(0, dtype=np.int64), *(hook.nodes for hook in self._moved)])[:, None]

    def at(self, t: float) -> None:
        for hook in self.hooks:
            hook.t = t

    def hold(self, fixed: np.ndarray) -> None:
        for hook in self.hooks:
            if isinstance(hook, PulledPatch):
                hook.hold(fixed)

    def follow(self, leaders: np.ndarray) -> None:
        for hook in self.hooks:
            hook.follow(leaders)

    def energy(self, x: np.ndarray) -> float:
        return sum(hook.energy(x) for hook in self.hooks if hook.grasps)

    def add_force(self, x: np.ndarray, v: np.ndarray, force: np.ndarray) -> None:
        for hook in self.hooks:
            if hook.grasps:
                hook.add_force(x, force)

    def add_stiffness(self, x: np.ndarray, definite: bool, slots: np.ndarray, values: np.ndarray) -> None:
        held = [hook.stiffness * hook.grasps for hook in self._moved]
        for axis in range(3):
            np.add.at(values[:, axis, axis], slots.ravel(), np.concatenate([np.empty(0), *held]))

    def begin(self, x: np.ndarray, h: float) -> np.ndarray:
        carried = x.copy()
        for hook in self.hooks:
            hook.begin(x, carried, h)
        return carried

    def end(self, x: np.ndarray) -> None:
        self.work_j += sum(hook.end(x) for hook in self.hooks)

    def project(self, start: np.ndarray, x: np.ndarray, v: np.ndarray, h: float) -> None:
        self.work_j += sum(hook.project(start, x, v, h) for hook in self.hooks)

    def observe(self, x: np.ndarray) -> dict[str, float]:
        """Return the mean place of each patch, ``hook_0_x_m`` …, and the force on its hook, ``hook_0_force_x_n`` …"""
        row = {}
        for number, hook in enumerate(self.hooks):
            for axis, letter in enumerate("xyz"):
                row[f"hook_{number}_{letter}_m"] = float(x[hook.nodes, axis].mean())
                row[f"hook_{number}_force_{letter}_n"] = -float(hook.force[axis])
        return row

    def drawn(self, x: np.ndarray) -> list[Shape]:
        """Return each patch a little above the surface, shrunk to a point while it is not grasped."""
        shapes = []
        for number, hook in enumerate(self.hooks):
            corners = x[hook.triangles]
            normal = area_normals(x, hook.triangles).sum(axis=0)
            points = corners.reshape(-1, 3) + self._above * normal / max(float(np.linalg.norm(normal)), 1e-300)
            points = points if hook.grasps else np.repeat(points.mean(axis=0)[None], len(points), axis=0)
            shapes.append(Shape(f"hook_{number}", "mesh", 0.0, points, np.arange(len(points)).reshape(-1, 3)))
        return shapes
