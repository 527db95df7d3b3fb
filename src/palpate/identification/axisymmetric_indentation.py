"""Force over depth of a rigid ball on a bonded slab or a half-space, with any law and finite strains: in seconds.

Contact is exact at the nodes of the surface. Each state is the one at which the next node just touches: its depth is an
unknown, and which nodes touch is known. With sticking, a node keeps the place on the ball at which it has touched,
without an error of the step. Newton's method eliminates the constraints and includes the curvature of the ball. The
equations are banded, as rings of nodes are neighbours. Lengths are over the radius of the ball, forces over Young's
modulus times its square.
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
"""Ratio of radii of rings, quadrilaterals along a ring; finer ones change the force by less than 0.15 %, and that of
a ball that sticks by 0.4 %."""
FINE_RADII = 1.3
"""Radius of what is meshed finely, over the ball's."""
START, CORE = 0.15, 2.5
"""Radius of the first contact over the ball's, below which Hertz holds, and over the innermost ring."""
TOLERANCE, OVERLAP = 1e-11, 1e-7
"""Energy that Newton's method would still gain over that of the press, and gap of touching nodes, that end it."""
ITERATIONS, HALVINGS = 14, 5
"""Most steps of Newton's method, and of halving one that squeezes an element flat."""
FARTHEST, STEP = 0.8, 0.15
"""Increase of depth to the next node's state, over the depth, above which it is not looked for: near the ball's equator
no node comes to touch. And the first step of depth that is taken instead, over the depth."""
SHORTEST = 1e-3
"""Least step where the next node's state is not reached at once, over the largest depth."""
DOUBT = 1e-3
"""Overlap of nodes that should not touch, over the radius, at which a state is refused."""


@dataclass(frozen=True, eq=False)
class IndentationCurve:
    """Force over depth at k states, of which the last is as deep as asked for, or deeper.

    depth, force : (k,); limit : force over depth ** 1.5 at small depths
    """

    depth: np.ndarray
    force: np.ndarray
    limit: float

    def at(self, depth: np.ndarray) -> np.ndarray:
        """Interpolate the force at depths up to the last: depth ** 1.5 times a smooth function of the root of depth."""
        roots = np.sqrt(np.concatenate([[0.0], self.depth]))
        log_factors = np.log(np.concatenate([[self.limit], self.force / self.depth**1.5]))
        return np.exp(CubicSpline(roots, log_factors)(np.sqrt(depth))) * np.asarray(depth) ** 1.5


def hertz(poisson: float, sticks: bool = False) -> float:
    """Return the force of a ball on a half-space over depth ** 1.5 at small depths (Hertz 1881; sticking: Spence 1968).

    It is over Young's modulus and the root of the radius. With sticking, each increment of the force is that of a flat
    punch that sticks. The punch's pressure is the Abel transform of cos(β ln (1 + t)/(1 − t)) with 2 π β = ln(3 − 4 ν),
    and the ball meets the surface that the punch has moved outside of the contact.
    """
    without_friction = 4.0 / (3.0 * (1.0 - poisson**2))
    if not sticks:
        return without_friction
    punch_ratio = (1.0 - poisson) * np.log(3.0 - 4.0 * poisson) / (1.0 - 2.0 * poisson)
    beta = np.log(3.0 - 4.0 * poisson) / (2.0 * np.pi)

    def pressure(t: float) -> float:
        return float(np.cos(beta * np.log((1.0 + t) / (1.0 - t))))

    def moved_outside(t: float) -> float:
        displacement = (np.arcsin(t) - t * np.sqrt(1.0 - t * t)) / (2.0 * t**3) if t > 1e-3 else 1.0 / 3.0
        return pressure(t) * displacement

    mean_moved = 2.0 / np.pi * punch_ratio * quad(moved_outside, 0.0, 1.0)[0] / quad(pressure, 0.0, 1.0)[0]
    return without_friction * punch_ratio * float(np.sqrt(2.0 - 4.0 * mean_moved))


@numba.njit(cache=True, error_model="numpy")
def _assemble(matrices, quads, axes, has_axes, fixed, prescribed, band, right_sides):
    """Assemble element ``matrices`` (m, 18, 18) into a banded matrix, and known displacements into two right sides.

    band : (2 n, b + 1), the result, of which row j has the matrix's column j from its diagonal down
    right_sides : (2 n, 2), from which the stiffness times ``prescribed`` is subtracted
    has_axes : (n,) whether a node's two equations are along the rows of ``axes`` (n, 2, 2) rather than r and z
    fixed : (2 n,) which displacements are known; prescribed : (2 n, 2) these, of both right sides, zero elsewhere
    """
    for e in range(len(quads)):
        matrix = matrices[e]
        for a in range(NODES):
            node = quads[e, a]
            if has_axes[node]:
                for c in range(2 * NODES):
                    along_r, along_z = matrix[2 * a, c], matrix[2 * a + 1, c]
                    matrix[2 * a, c] = axes[node, 0, 0] * along_r + axes[node, 0, 1] * along_z
                    matrix[2 * a + 1, c] = axes[node, 1, 0] * along_r + axes[node, 1, 1] * along_z
                for c in range(2 * NODES):
                    along_r, along_z = matrix[c, 2 * a], matrix[c, 2 * a + 1]
                    matrix[c, 2 * a] = axes[node, 0, 0] * along_r + axes[node, 0, 1] * along_z
                    matrix[c, 2 * a + 1] = axes[node, 1, 0] * along_r + axes[node, 1, 1] * along_z
        for a in range(2 * NODES):
            i = 2 * quads[e, a // 2] + a % 2
            for c in range(2 * NODES):
                j = 2 * quads[e, c // 2] + c % 2
                if fixed[j]:
                    if not fixed[i]:
                        right_sides[i, 0] -= matrix[a, c] * prescribed[j, 0]
                        right_sides[i, 1] -= matrix[a, c] * prescribed[j, 1]
                elif i >= j and not fixed[i]:
                    band[j, i - j] += matrix[a, c]
    for i in range(len(fixed)):
        if fixed[i]:
            band[i, 0] = 1.0
            right_sides[i] = prescribed[i]


class BallOnSlab:
    """A rigid ball of radius 1 that is pressed into a slab of Young's modulus 1, whose section is meshed for it.

    law, poisson, thickness : of the slab, infinite for a half-space
    sticks : whether what touches keeps its place on the ball, or slides without friction
    ratio, angles, far : of the mesh, as ``slab_section`` takes them
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
        # the last state, and where on the ball nodes stick, from its centre
        self._x, self._depth, self._force = self.section.nodes.copy(), 0.0, 0.0
        self._places = np.zeros((count, 2))

    def curve(self, deepest: float) -> IndentationCurve:
        """Press from a small depth to ``deepest`` or beyond; NotConverged where that depth is not reached."""
        if not 0.0 < deepest < self._thickness:
            raise InputError(f"the depth is {deepest:g} radii; give less than the thickness, {self._thickness:g}.")
        radii = self.section.nodes[self.section.surface, 0]
        touching_count = int(np.searchsorted(radii, self._first * (1.0 - 1e-9)))
        touching_count += touching_count % 2  # so that the next node is a corner of an element
        depth, states = float(radii[touching_count] ** 2), []
        touching, next_node = self._touching(touching_count)
        if self._sticks:
            self._begin_sticking(touching, next_node, depth)
        else:
            self._solve(touching, next_node, depth)
        while True:
            states.append((self._depth, self._force))
            if self._depth >= deepest:
                depths, forces = np.array(states).T
                return IndentationCurve(depths, forces, hertz(self._poisson, self._sticks))
            # slipping goes from corner to corner of elements, where states are most exact, sticking from node to node
            for _ in range(2 if self._sticks else 1):
                touching_count += 1 if self._sticks else 2
                self._places[next_node] = self._x[next_node] - self._centre(self._depth)
                touching, next_node = self._touching(touching_count)
                if not self._advance(touching, next_node, deepest):
                    break

    def _touching(self, count: int) -> tuple[np.ndarray, int]:
        """Return the ``count`` nodes of the surface that are nearest to the axis, and the next one outward."""
        if count + 3 > len(self.section.surface):
            raise NotConverged("the ball touches all of the surface", [float("nan")])
        return self.section.surface[:count], int(self.section.surface[count])

    @staticmethod
    def _centre(depth: float) -> np.ndarray:
        return np.array([0.0, 1.0 - depth])

    def _advance(self, touching: np.ndarray, next_node: int, deepest: float) -> bool:
        """Press on to the state at which the node ``next_node`` just touches; return whether it was reached.

        Where Newton's method does not reach it at once, depth rises in steps, halved where they fail, to ``deepest``.
        """
        depth_step = 0.0
        while True:
            x, depth = self._x, self._depth
            try:
                self._solve(touching, next_node, depth, FARTHEST * depth)
                self._check_deeper(depth)
                return True
            except NotConverged:
                self._x, self._depth = x, depth
            depth_step = depth_step or STEP * depth
            while True:
                try:
                    self._solve(touching, None, min(depth + depth_step, deepest))
                    self._check_deeper(depth)
                    break
                except NotConverged:
                    self._x, self._depth, depth_step = x, depth, 0.5 * depth_step
                    if depth_step < SHORTEST * deepest:
                        raise
            if self._depth == deepest:
                return False

    def _check_deeper(self, before: float) -> None:
        """Raise NotConverged where the state is not deeper than ``before``, or a node overlaps the ball."""
        gaps = np.linalg.norm(self._x[self.section.surface] - self._centre(self._depth), axis=1) - 1.0
        if not (self._depth > before and gaps.min() > -DOUBT and self._force > 0.0):
            raise NotConverged(f"no equilibrium of the ball beyond a depth of {before:.3g} radii", [float(gaps.min())])

    def _solve(self, touching: np.ndarray, next_node: int | None, depth: float, farthest: float = np.inf) -> None:
        """Find the equilibrium with the nodes ``touching`` on the ball by Newton's method, and make it the last state.

        next_node : the node that just touches, without a force, by which the depth is found; None: ``depth`` is given
        farthest : largest change of depth by the first step; beyond it, or where the depth falls, NotConverged
        In the loop ``deeper`` is a step's change of depth, and ``gap`` the largest distance of nodes from their places.
        """
        x, depth_is_free = self._x.copy(), next_node is not None
        depth = self._depth if depth_is_free and self._depth else depth
        history: list[float] = []
        for _ in range(ITERATIONS):
            step, step_per_depth, gain, force, gap = self._newton_step(x, touching, depth)
            deeper = 0.0
            if depth_is_free:
                from_ball = x[next_node] - self._centre(depth)
                length = float(np.linalg.norm(from_ball))
                normal = from_ball / length
                deeper = -(length - 1.0 + normal @ step[next_node]) / (normal @ step_per_depth[next_node] + normal[1])
                gap = max(gap, abs(length - 1.0))
                if not history and np.isfinite(farthest) and not 0.0 < deeper < farthest:
                    break
            residual = abs(gain) / max(force * depth, 1e-300)
            history.append(residual)
            if residual <= TOLERANCE and gap <= OVERLAP:
                self._x, self._depth, self._force = x, depth, force
                return
            step = step + deeper * step_per_depth
            fraction = 1.0
            for _ in range(HALVINGS):
                if self.elements.least_volume(x + fraction * step) > 0.0:
                    break
                fraction *= 0.5
            else:
                break
            x, depth = x + fraction * step, depth + fraction * deeper
            if not np.isfinite(x).all():
                break
        raise NotConverged(f"no equilibrium of the ball at a depth of {depth:.3g} radii", history)

    def _newton_step(
        self, x: np.ndarray, touching: np.ndarray, depth: float
    ) -> tuple[np.ndarray, np.ndarray, float, float, float]:
        """Return a step of Newton's method at positions ``x`` (n, 2) with the ball at ``depth``.

        The five results are the step (n, 2), its change per unit of depth (n, 2), the energy that it gains apart from
        contact, the force on the ball, and the largest distance of a touching node from its place on the ball.
        """
        _, gradient, _ = self.elements.linearise(x)
        centre = self._centre(depth)
        from_centre = x[touching] - centre
        lengths = np.linalg.norm(from_centre, axis=1)
        normals = from_centre / lengths[:, None]
        # last axis of prescribed steps and sides: 0 for the step, 1 for its change per unit of depth
        fixed, prescribed = self._held.copy(), np.zeros((len(x), 2, 2))
        sides = np.stack([-gradient, np.zeros_like(x)], axis=2)
        axes, has_axes = np.zeros((len(x), 2, 2)), np.zeros(len(x), dtype=bool)
        if self._sticks:
            fixed[touching] = True
            prescribed[touching, :, 0] = centre + self._places[touching] - x[touching]
            prescribed[touching, 1, 1] = -1.0
            prescribed[self._held] = 0.0
            force, gap = -gradient[touching, 1].sum(), np.abs(prescribed[touching, :, 0]).max()
        else:
            # equations of touching nodes are along the ball's normal, where the step is known, and its tangent
            has_axes[touching] = touching > 0  # the node on the axis moves along it
            tangents = np.stack([-normals[:, 1], normals[:, 0]], axis=1)
            axes[touching, 0], axes[touching, 1] = normals, tangents
            pull, shear = (gradient[touching] * normals).sum(axis=1), (gradient[touching] * tangents).sum(axis=1)
            fixed[touching, 0] = True
            prescribed[touching, 0, 0], prescribed[touching, 0, 1] = 1.0 - lengths, -normals[:, 1]
            sides[touching, 1, 0], sides[touching, 1, 1] = -shear, pull / lengths * tangents[:, 1]
            on_axis = touching == 0
            fixed[touching[on_axis]] = True
            prescribed[touching[on_axis]] = [[0.0, 0.0], [-(1.0 - lengths[on_axis][0]), -1.0]] if on_axis.any() else 0.0
            force, gap = -(pull * normals[:, 1]).sum(), np.abs(1.0 - lengths).max()
        unbalanced = np.where(fixed, 0.0, sides[..., 0])
        self._band[:] = 0.0
        equations = sides.reshape(-1, 2).copy()
        _assemble(
            self.elements.matrices, self.section.quads, axes, has_axes, fixed.ravel(), prescribed.reshape(-1, 2),
            self._band, equations,
        )  # fmt: skip
        if not self._sticks:  # the ball's curvature
            off_axis = touching > 0
            self._band[2 * touching[off_axis] + 1, 0] -= (pull / lengths)[off_axis]
        steps = self._solve_banded(equations).reshape(-1, 2, 2)
        gain = float((unbalanced * steps[..., 0]).sum())
        steps[has_axes] = np.einsum("nij,nik->njk", axes[has_axes], steps[has_axes])
        return steps[..., 0], steps[..., 1], gain, float(force), float(gap)

    def _solve_banded(self, right: np.ndarray) -> np.ndarray:
        """Solve the assembled equations for ``right`` (2 n, 2), by Cholesky, or by LU where they are indefinite."""
        try:
            factor = cholesky_banded(self._band.T, lower=True, check_finite=False)
            return cho_solve_banded((factor, True), right, check_finite=False)
        except LinAlgError:
            below = self._band.shape[1] - 1
            diagonals = np.zeros((2 * below + 1, len(self._band)))
            diagonals[below:] = self._band.T
            for offset in range(1, below + 1):
                diagonals[below - offset, offset:] = self._band[:-offset, offset]
            return solve_banded((below, below), diagonals, right, check_finite=False)

    def _begin_sticking(self, touching: np.ndarray, next_node: int, depth: float) -> None:
        """Find the first state with sticking; less deep states are smaller copies of it.

        So each node, at radius r at rest, had moved outward by C r² when it touched. The secant rule finds the C
        (last of ``factors``) for which ``next_node``, which just touches at ``depth``, has moved by C r², too.
        """
        at_rest, factors, misses = self.section.nodes, [0.0], []
        for _ in range(12):
            radii = at_rest[touching, 0] + factors[-1] * at_rest[touching, 0] ** 2
            self._places[touching] = np.stack([radii, -np.sqrt(1.0 - radii**2)], axis=1)
            self._solve(touching, next_node, depth)
            misses.append((self._x[next_node, 0] - at_rest[next_node, 0]) / at_rest[next_node, 0] ** 2 - factors[-1])
            if abs(misses[-1]) <= 1e-5:
                return
            slope = (misses[-1] - misses[-2]) / (factors[-1] - factors[-2]) if len(factors) > 1 else -1.0
            factors.append(factors[-1] - misses[-1] / slope)
        raise NotConverged("the first contact with sticking is not found", misses)
