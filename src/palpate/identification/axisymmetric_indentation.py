"""Force over depth of a rigid ball on a bonded slab or a half-space, with any law and finite strains: in seconds.

The contact is exact at nodes of the surface. The states that are looked for are those at which the next node just
touches, so that its depth is an unknown and no set of nodes has to be searched: with sticking, nodes keep the place on
the ball at which they have touched, without an error of the step. Newton's method has the constraints eliminated, with
the curvature of the ball; equations are banded, as rings of nodes are neighbours. Lengths are over the radius of the
ball, forces over Young's modulus times its square.
"""

from dataclasses import dataclass

import numba
import numpy as np
from scipy.integrate import quad
from scipy.interpolate import CubicSpline
from scipy.linalg import LinAlgError, cho_solve_banded, cholesky_banded, solve_banded

from palpate.effects.law import law_of
from palpate.errors import InputError, NotConverged
from palpate.identification.axisymmetric_elements import NODES, AxisymmetricElements, rings
from palpate.identification.slab_section import Section, slab_section

RATIO, ANGLES = 1.18, 8
"""Of the radii of rings, and quadrilaterals along a ring; finer ones change the force by less than 0.15 %, and that of
a ball that sticks by 0.4 %."""
FINE_RADII = 1.3
"""Radius of what is meshed finely, over the ball's."""
START, CORE = 0.15, 2.5
"""Radius of the first contact over the ball's, below which Hertz holds, and over the innermost ring."""
TOLERANCE, OVERLAP = 1e-11, 1e-7
"""Of the energy that Newton's method would still gain, over that of the press, and of the radius."""
ITERATIONS, HALVINGS = 14, 5
"""Most steps of Newton's method, and of halving one that squeezes an element flat."""
FARTHEST, STEP = 0.8, 0.15
"""Depth to the next node's state, over that so far, above which it is not looked for: near the ball's equator none
comes to touch. The step of depth that is taken instead."""
SHORTEST = 1e-3
"""Least step where the next node's state is not reached at once, over the largest depth."""
DOUBT = 1e-3
"""Overlap of nodes that should not touch, over the radius, at which a state is none."""


@dataclass(frozen=True, eq=False)
class Pressed:
    """A curve of k states.

    depth, force : (k,); contact : (k,) its radius. The last state is as deep as asked for, or deeper.
    limit : force over depth ** 1.5 at small depths
    """

    depth: np.ndarray
    force: np.ndarray
    contact: np.ndarray
    limit: float

    def at(self, depth: np.ndarray) -> np.ndarray:
        """Return forces at depths up to the last: Hertz times a smooth function of the root of depth."""
        known = np.sqrt(np.concatenate([[0.0], self.depth]))
        share = np.log(np.concatenate([[self.limit], self.force / self.depth**1.5]))
        return np.exp(CubicSpline(known, share)(np.sqrt(depth))) * np.asarray(depth) ** 1.5


def hertz(poisson: float, sticks: bool = False) -> float:
    """Return the force of a ball on a half-space over depth ** 1.5 at small depths (Hertz 1881; sticking: Spence 1968).

    With sticking, increments are those of a punch that sticks, whose pressure is the Abel transform of
    cos(β ln (1 + t)/(1 − t)) with 2 π β = ln(3 − 4 ν), and whose surface the ball meets outside of the contact.
    """
    plain = 4.0 / (3.0 * (1.0 - poisson**2))
    if not sticks:
        return plain
    punch = (1.0 - poisson) * np.log(3.0 - 4.0 * poisson) / (1.0 - 2.0 * poisson)
    beta = np.log(3.0 - 4.0 * poisson) / (2.0 * np.pi)

    def wave(t: float) -> float:
        return float(np.cos(beta * np.log((1.0 + t) / (1.0 - t))))

    def met(t: float) -> float:
        return wave(t) * ((np.arcsin(t) - t * np.sqrt(1.0 - t * t)) / (2.0 * t**3) if t > 1e-3 else 1.0 / 3.0)

    share = 2.0 / np.pi * punch * quad(met, 0.0, 1.0)[0] / quad(wave, 0.0, 1.0)[0]
    return plain * punch * float(np.sqrt(2.0 - 4.0 * share))


@numba.njit(cache=True, error_model="numpy")
def _assemble(matrices, quads, turns, turned, fixed, ahead, band, right):
    """Add element matrices to ``band`` (2 n, b + 1), the lower columns, and subtract K ``ahead`` from ``right``.

    turns : (n, 2, 2), rows: the directions of a node's equations, where it is ``turned`` (n,)
    fixed : (2 n,), what is known; ahead : (2 n, 2) by how much it moves, zero elsewhere
    """
    for e in range(len(quads)):
        k = matrices[e]
        for a in range(NODES):
            n = quads[e, a]
            if turned[n]:
                for c in range(2 * NODES):
                    first, second = k[2 * a, c], k[2 * a + 1, c]
                    k[2 * a, c] = turns[n, 0, 0] * first + turns[n, 0, 1] * second
                    k[2 * a + 1, c] = turns[n, 1, 0] * first + turns[n, 1, 1] * second
                for c in range(2 * NODES):
                    first, second = k[c, 2 * a], k[c, 2 * a + 1]
                    k[c, 2 * a] = turns[n, 0, 0] * first + turns[n, 0, 1] * second
                    k[c, 2 * a + 1] = turns[n, 1, 0] * first + turns[n, 1, 1] * second
        for a in range(2 * NODES):
            i = 2 * quads[e, a // 2] + a % 2
            for c in range(2 * NODES):
                j = 2 * quads[e, c // 2] + c % 2
                if fixed[j]:
                    if not fixed[i]:
                        right[i, 0] -= k[a, c] * ahead[j, 0]
                        right[i, 1] -= k[a, c] * ahead[j, 1]
                elif i >= j and not fixed[i]:
                    band[j, i - j] += k[a, c]
    for i in range(len(fixed)):
        if fixed[i]:
            band[i, 0] = 1.0
            right[i] = ahead[i]


class BallOnSlab:
    """A ball and a slab whose section is meshed for it.

    thickness : infinite for a half-space; law, poisson : of the slab; sticks : whether what touches keeps its place
    ratio, angles : of the mesh, see ``slab_section``
    """

    def __init__(
        self,
        law: str,
        poisson: float,
        thickness: float = np.inf,
        sticks: bool = False,
        ratio: float = RATIO,
        angles: int = ANGLES,
        far: float | None = None,
    ):
        if not thickness > 0.0:
            raise InputError(f"thickness is {thickness} radii; give a positive number.")
        self._first = START * min(1.0, thickness)
        self.section: Section = slab_section(thickness, self._first / CORE, ratio, FINE_RADII, angles, far)
        self.elements = AxisymmetricElements(rings(self.section.nodes, self.section.quads), law_of(law), 1.0, poisson)
        self._poisson, self._thickness, self._sticks = poisson, thickness, sticks
        count, quads = len(self.section.nodes), self.section.quads
        self._held = np.zeros((count, 2), dtype=bool)
        self._held[self.section.held] = True
        self._held[self.section.axis, 0] = True
        spread = int((quads.max(axis=1) - quads.min(axis=1)).max())
        self._band = np.zeros((2 * count, 2 * spread + 2))
        self._x, self._depth = self.section.nodes.copy(), 0.0
        self._force, self._places = 0.0, np.zeros((count, 2))
        """Where on the ball nodes stick, from its centre."""

    def curve(self, deepest: float) -> Pressed:
        """Return states from a small depth to ``deepest`` or beyond; NotConverged where that is not reached."""
        if not 0.0 < deepest < self._thickness:
            raise InputError(f"the depth is {deepest:g} radii; give less than the thickness, {self._thickness:g}.")
        radii = self.section.nodes[self.section.surface, 0]
        count = int(np.searchsorted(radii, self._first * (1.0 - 1e-9)))
        count += count % 2  # the next is a corner of an element
        depth, states = float(radii[count] ** 2), []
        touching, after = self._surface(count)
        if self._sticks:
            self._begin(touching, after, depth)
        else:
            self._solve(touching, after, depth)
        while True:
            states.append((self._depth, self._force, self._x[after, 0]))
            if self._depth >= deepest:
                depths, forces, radii = np.array(states).T
                return Pressed(depths, forces, radii, hertz(self._poisson, self._sticks))
            for _ in range(2 if self._sticks else 1):  # states at corners are alike, and most exact
                count += 1 if self._sticks else 2
                self._places[after] = self._x[after] - self._centre(self._depth)
                touching, after = self._surface(count)
                if not self._advance(touching, after, deepest):
                    break

    def _surface(self, count: int) -> tuple[np.ndarray, int]:
        """Return the first ``count`` nodes of the surface, and the next one."""
        if count + 3 > len(self.section.surface):
            raise NotConverged("the ball touches all of the surface", [float("nan")])
        return self.section.surface[:count], int(self.section.surface[count])

    @staticmethod
    def _centre(depth: float) -> np.ndarray:
        return np.array([0.0, 1.0 - depth])

    def _advance(self, touching: np.ndarray, after: int, deepest: float) -> bool:
        """Go on to the state at which node ``after`` touches, and return whether it was reached.

        Where it is beyond ``deepest`` and cannot be reached, that depth is gone to instead.
        """
        step = 0.0
        while True:
            x, depth = self._x, self._depth
            try:
                self._solve(touching, after, depth, FARTHEST * depth)
                self._check(depth)
                return True
            except NotConverged:
                self._x, self._depth = x, depth
            step = step or STEP * depth
            while True:
                try:
                    self._solve(touching, None, min(depth + step, deepest))
                    self._check(depth)
                    break
                except NotConverged:
                    self._x, self._depth, step = x, depth, 0.5 * step
                    if step < SHORTEST * deepest:
                        raise
            if self._depth == deepest:
                return False

    def _check(self, before: float) -> None:
        """Raise NotConverged where a state is no next one: less deep than ``before``, or with overlaps."""
        gaps = np.linalg.norm(self._x[self.section.surface] - self._centre(self._depth), axis=1) - 1.0
        if not (self._depth > before and gaps.min() > -DOUBT and self._force > 0.0):
            raise NotConverged(f"no equilibrium of the ball beyond a depth of {before:.3g} radii", [float(gaps.min())])

    def _solve(self, touching: np.ndarray, after: int | None, depth: float, farthest: float = np.inf) -> None:
        """Find the equilibrium with nodes ``touching`` on the ball, from the last one, and set ``force``.

        after : the node that just touches, without force, which sets the depth; or None, then ``depth`` is known
        farthest : largest change of depth that is believed
        """
        x, moved = self._x.copy(), after is not None
        depth = self._depth if moved and self._depth else depth
        history: list[float] = []
        for _ in range(ITERATIONS):
            change, rate, left, force, gap = self._step(x, touching, depth)
            rise = 0.0
            if moved:
                away = x[after] - self._centre(depth)
                length = float(np.linalg.norm(away))
                normal = away / length
                rise = -(length - 1.0 + normal @ change[after]) / (normal @ rate[after] + normal[1])
                gap = max(gap, abs(length - 1.0))
                if not history and np.isfinite(farthest) and not 0.0 < rise < farthest:
                    break
            left = abs(left) / max(force * depth, 1e-300)
            history.append(left)
            if left <= TOLERANCE and gap <= OVERLAP:
                self._x, self._depth, self._force = x, depth, force
                return
            change = change + rise * rate
            share = 1.0
            for _ in range(HALVINGS):
                if self.elements.least_volume(x + share * change) > 0.0:
                    break
                share *= 0.5
            else:
                break
            x, depth = x + share * change, depth + share * rise
            if not np.isfinite(x).all():
                break
        raise NotConverged(f"no equilibrium of the ball at a depth of {depth:.3g} radii", history)

    def _step(
        self, x: np.ndarray, touching: np.ndarray, depth: float
    ) -> tuple[np.ndarray, np.ndarray, float, float, float]:
        """Return Newton's step (n, 2), its change with each unit of depth (n, 2), and what was left at ``x``:

        the energy that the step gains, apart from contact, the force on the ball, and the largest overlap.
        """
        gradient, _ = self.elements.linearise(x)
        centre = self._centre(depth)
        away = x[touching] - centre
        lengths = np.linalg.norm(away, axis=1)
        normals = away / lengths[:, None]
        fixed, ahead = self._held.copy(), np.zeros((len(x), 2, 2))
        right = np.stack([-gradient, np.zeros_like(x)], axis=2)
        turns, turned = np.zeros((len(x), 2, 2)), np.zeros(len(x), dtype=bool)
        if self._sticks:
            fixed[touching] = True
            ahead[touching, :, 0] = centre + self._places[touching] - x[touching]
            ahead[touching, 1, 1] = -1.0
            ahead[self._held] = 0.0
            force, gap = -gradient[touching, 1].sum(), np.abs(ahead[touching, :, 0]).max()
        else:
            turned[touching] = touching > 0  # the node on the axis moves along it
            tangents = np.stack([-normals[:, 1], normals[:, 0]], axis=1)
            turns[touching, 0], turns[touching, 1] = normals, tangents
            pressed, shear = (gradient[touching] * normals).sum(axis=1), (gradient[touching] * tangents).sum(axis=1)
            fixed[touching, 0] = True
            ahead[touching, 0, 0], ahead[touching, 0, 1] = 1.0 - lengths, -normals[:, 1]
            right[touching, 1, 0], right[touching, 1, 1] = -shear, pressed / lengths * tangents[:, 1]
            first = touching == 0
            fixed[touching[first]] = True
            ahead[touching[first]] = [[0.0, 0.0], [-(1.0 - lengths[first][0]), -1.0]] if first.any() else 0.0
            force, gap = -(pressed * normals[:, 1]).sum(), np.abs(1.0 - lengths).max()
        free = np.where(fixed, 0.0, right[..., 0])
        self._band[:] = 0.0
        side = right.reshape(-1, 2).copy()
        _assemble(
            self.elements.matrices, self.section.quads, turns, turned, fixed.ravel(), ahead.reshape(-1, 2),
            self._band, side,
        )  # fmt: skip
        if not self._sticks:
            on = touching > 0
            self._band[2 * touching[on] + 1, 0] -= (pressed / lengths)[on]
        found = self._solved(side).reshape(-1, 2, 2)
        left = float((free * found[..., 0]).sum())
        found[turned] = np.einsum("nij,nik->njk", turns[turned], found[turned])
        return found[..., 0], found[..., 1], left, float(force), float(gap)

    def _solved(self, right: np.ndarray) -> np.ndarray:
        """Return the solution (2 n, 2) of the equations: by Cholesky, or by LU where a guess is not stable."""
        try:
            factor = cholesky_banded(self._band.T, lower=True, check_finite=False)
            return cho_solve_banded((factor, True), right, check_finite=False)
        except LinAlgError:
            wide = self._band.shape[1] - 1
            whole = np.zeros((2 * wide + 1, len(self._band)))
            whole[wide:] = self._band.T
            for off in range(1, wide + 1):
                whole[wide - off, off:] = self._band[:-off, off]
            return solve_banded((wide, wide), whole, right, check_finite=False)

    def _begin(self, touching: np.ndarray, after: int, depth: float) -> None:
        """Find the first state with sticking, whose past is like itself: nodes have moved by C r² when they touched."""
        rest, sizes, misses = self.section.nodes, [0.0], []
        for _ in range(12):
            across = rest[touching, 0] + sizes[-1] * rest[touching, 0] ** 2
            self._places[touching] = np.stack([across, -np.sqrt(1.0 - across**2)], axis=1)
            self._solve(touching, after, depth)
            misses.append((self._x[after, 0] - rest[after, 0]) / rest[after, 0] ** 2 - sizes[-1])
            if abs(misses[-1]) <= 1e-5:
                return
            slope = (misses[-1] - misses[-2]) / (sizes[-1] - sizes[-2]) if len(sizes) > 1 else -1.0
            sizes.append(sizes[-1] - misses[-1] / slope)
        raise NotConverged("the first contact with sticking is not found", misses)
