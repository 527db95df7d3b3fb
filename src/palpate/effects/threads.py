"""Threads: sutures between two points of the surface, which are tied, are tightened over time, and have no push."""

import numpy as np

from palpate.bodies.mesh import corner_normals
from palpate.bodies.particles import Particles
from palpate.effects import effect, settings
from palpate.effects.effect import Effect, Shape
from palpate.effects.patch_load import OFF, SAME_S, nearest_on_surface, ramp
from palpate.errors import InputError

THICK = 0.004
"""Radius of a thread in pictures, in sizes of the body."""


def make(particles: Particles, options: list[settings.Thread], elastic: Effect | None) -> "Threads":
    """Make all threads of a scene.

    The ends of each are the surface points at rest nearest to its ``ends_m`` (2, 3) [m], anywhere in a triangle, so
    that they are the same on all meshes of one shape. Raises InputError for ends off the surface or at one place.
    """
    rows = []
    for i, thread in enumerate(options):
        place, points = f"{particles.name}: threads[{i}].ends_m", np.array(thread.ends_m, dtype=float)
        corners, shares, away = nearest_on_surface(particles, points)
        if (largest := away.max()) > OFF * particles.size:
            raise InputError(f"{place} has a point {largest:.3g} m from the surface; give two points on it, in metres.")
        rest = np.einsum("ea,eai->ei", shares, particles.nodes[corners])
        length = float(np.linalg.norm(rest[1] - rest[0]))
        if length <= 1e-9 * particles.size:
            raise InputError(f"{place} are both nearest to one point of the surface; give them farther apart.")
        final = float(thread.tightened_to * length if thread.length_m is None else thread.length_m)
        rows.append((corners.ravel(), (shares * [[-1.0], [1.0]]).ravel(), final))
    columns = np.array([[entry.stiffness_n_m, entry.start_s, entry.tighten_s] for entry in options], dtype=float)
    nodes, weights, finals = (np.array(entry) for entry in zip(*rows, strict=True))
    return Threads(particles, nodes, weights, finals, columns)


class Threads(
    effect.Corrections, effect.Following, effect.Time, effect.Driven, effect.Relaxation, effect.Observation,
    effect.Drawn,
):  # fmt: skip
    """Threads of length l whose ends are d apart, with E = Σ ½ k max(d − l, 0)², which is convex, and C¹ at d = l.

    A thread acts from its start, when its length l is the distance of its ends (that at rest for a start at 0); then l
    goes to its final length. Tightening does work: the tension at the end of a step times the decrease of l. An end is
    anywhere in a triangle, and its force is divided among the three nodes, so that forces and moments balance.

    nodes : (k, 6) corners of the triangle of the first end and of the second one; weights : (k, 6), so that the second
    end less the first is Σ weights x; finals : (k,) [m]; columns : (k, 3) stiffness [N/m], start [s], tightening [s]
    Until ``at`` is called, all are tied and just taut at rest: explicit integrators choose their steps for that state.
    """

    def __init__(
        self, particles: Particles, nodes: np.ndarray, weights: np.ndarray, finals: np.ndarray, columns: np.ndarray
    ):
        self._own = self._nodes = nodes
        self._weights, self._finals = weights, finals
        self._stiffness, self._start, self._tighten = columns.T
        self._tied = self._last = self._lengths = self._distances(particles.nodes)
        self._multipliers = np.zeros(len(nodes))
        self._before, self.work_j, self._thick = np.full(len(nodes), np.inf), 0.0, THICK * particles.size

    def at(self, t: float) -> None:
        since = t - self._start
        share = np.array([ramp(*each) for each in zip(since, self._tighten, strict=True)])
        lengths = self._tied + share * (self._finals - self._tied)
        self._lengths = np.where(since > SAME_S, lengths, np.inf)

    def follow(self, leaders: np.ndarray) -> None:
        self._nodes = leaders[self._own]

    def tensions(self, x: np.ndarray) -> np.ndarray:
        """Return the tension of each thread (k,) [N] at ``x`` (n, 3) [m]."""
        return self._stiffness * np.maximum(self._distances(x) - self._lengths, 0.0)

    def energy(self, x: np.ndarray) -> float:
        return self._energy(self._distances(x), self._lengths)

    def _energy(self, distances: np.ndarray, lengths: np.ndarray) -> float:
        return 0.5 * float(self._stiffness @ np.maximum(distances - lengths, 0.0) ** 2)

    def add_force(self, x: np.ndarray, v: np.ndarray, force: np.ndarray) -> None:
        pulls = self._pulls(x)
        for k in np.flatnonzero(pulls.any(axis=1)):
            np.add.at(force, self._nodes[k], -np.outer(self._weights[k], pulls[k]))

    def touching(self, x: np.ndarray, definite: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return blocks w wᵀ ⊗ (k n nᵀ + T/d (I − n nᵀ)) of taut threads along n, of tension T; semidefinite."""
        distances = self._distances(x)
        taut = np.flatnonzero(distances >= self._lengths)
        vectors, d, k = self._vectors(x)[taut], distances[taut], self._stiffness[taut]
        directions = vectors / np.maximum(d, 1e-300)[:, None]
        along = np.einsum("ti,tj->tij", directions, directions)
        # both ends at one place: a thread of no length resists all directions alike
        across = np.where(d > 0.0, 1.0 - self._lengths[taut] / np.maximum(d, 1e-300), 1.0)
        at_ends = k[:, None, None] * (across[:, None, None] * (np.eye(3) - along) + along)
        nodes, weights = self._nodes[taut], self._weights[taut]
        blocks = np.einsum("ta,tb,tij->tabij", weights, weights, at_ends)
        return np.repeat(nodes, 6, axis=1).ravel(), np.tile(nodes, (1, 6)).ravel(), blocks.reshape(-1, 3, 3)

    def correct(self, x: np.ndarray, inverse: np.ndarray, h: float, first: bool) -> None:
        """Correct each thread by an inequality of compliance 1/k (Macklin, Müller, Chentanez 2016)."""
        if first:
            self._multipliers = np.zeros(len(self._nodes))
        for k in np.flatnonzero(np.isfinite(self._lengths)):
            nodes, weights = self._nodes[k], self._weights[k]
            ends_apart = weights @ x[nodes]
            d, compliance = max(float(np.linalg.norm(ends_apart)), 1e-300), 1.0 / (self._stiffness[k] * h**2)
            # the triangles of both ends may share nodes, whose weights count together
            mobility = weights @ ((nodes[:, None] == nodes) * inverse[nodes]) @ weights
            change = (d - self._lengths[k] - compliance * self._multipliers[k]) / (mobility + compliance)
            change = max(change, -self._multipliers[k])  # no push
            self._multipliers[k] += change
            np.add.at(x, nodes, -change / d * np.outer(inverse[nodes] * weights, ends_apart))

    def end(self, x: np.ndarray) -> None:
        """End an implicit step, whose work is the tension at its end times the decrease of the length."""
        tied = np.isfinite(self._lengths)
        shorter = np.where(np.isfinite(self._before), self._before, self._tied)[tied] - self._lengths[tied]
        self.work_j += float(self.tensions(x)[tied] @ shorter)
        self._accept(x)

    def relax(self, x: np.ndarray, h: float) -> None:
        """End an explicit step, which shortens threads before nodes move: its work is the energy that this adds."""
        self.work_j += self._energy(self._last, self._lengths) - self._energy(self._last, self._before)
        self._accept(x)

    def _accept(self, x: np.ndarray) -> None:
        """Store distances and lengths at the end of a step, ``x`` (n, 3) [m]; the former are lengths of untied ones."""
        self._before, self._last = self._lengths, self._distances(x)
        self._tied = np.where(np.isfinite(self._lengths), self._tied, self._last)

    def observe(self, x: np.ndarray) -> dict[str, float]:
        """Return the force of each thread on its first end, ``thread_0_force_x_n`` …, whose norm is the tension."""
        row: dict[str, float] = {}
        for number, pull in enumerate(self._pulls(x)):
            row |= {f"thread_{number}_force_{letter}_n": float(pull[axis]) for axis, letter in enumerate("xyz")}
        return row

    def drawn(self, x: np.ndarray) -> list[Shape]:
        """Return each thread as a rod between its ends, which lie on the surface, loose or taut."""
        corners = x[self._nodes].reshape(-1, 2, 3, 3)
        up = corner_normals(corners)
        up *= self._thick / np.maximum(np.linalg.norm(up, axis=2, keepdims=True), 1e-300)
        ends = np.einsum("kea,keai->kei", np.abs(self._weights).reshape(-1, 2, 3), corners) + up
        none = np.empty((0, 3), dtype=np.int64)
        return [Shape(f"thread_{i}", "capsule", self._thick, points, none) for i, points in enumerate(ends)]

    def _vectors(self, x: np.ndarray) -> np.ndarray:
        """Return the vectors from first to second ends (k, 3) [m]."""
        return np.einsum("ka,kai->ki", self._weights, x[self._nodes])

    def _distances(self, x: np.ndarray) -> np.ndarray:
        return np.linalg.norm(self._vectors(x), axis=1)

    def _pulls(self, x: np.ndarray) -> np.ndarray:
        """Return the force on each first end (k, 3) [N]; none where both ends are at one place."""
        vectors = self._vectors(x)
        return (self.tensions(x) / np.maximum(np.linalg.norm(vectors, axis=1), 1e-300))[:, None] * vectors
