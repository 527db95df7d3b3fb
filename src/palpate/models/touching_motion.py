"""Integrate a body that an instrument touches in few coordinates, faster than life: x = X + Φ q with exact contact.

BDF2, but backward Euler in steps in which the instrument's path bends. Each step is a minimisation by BFGS, which knows
contact's own second derivatives.
"""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numba
import numpy as np
from scipy import sparse

from palpate.collision.contact.instrument_contact import (
    SOFT,
    InstrumentContact,
    Rubbing,
    least_gap,
    press,
    stiffen,
)
from palpate.effects.effect import FixedNodes, Instrumented, Proportional, offers
from palpate.effects.linear_elements import LinearElements, energy_and_force
from palpate.errors import InputError, NotConverged
from palpate.linalg.multigrid import Factor
from palpate.models import strokes
from palpate.models.stroke_modes import StrokeModes, belongs, learn, reach_of, stiffness_at_rest
from palpate.solvers.system import System

MARGIN_M = 0.012
"""Distance of an instrument's skin on its path from nodes at rest, within which it may touch them."""
ITERATIONS = 60
"""Of a search, after which it counts as not found."""
PASSES = 2
"""Searches of a step with friction: with directions and forces of its beginning, then with those of the first's end."""
LEAST_ENERGY = 0.01
"""Of the largest elastic energy so far: what is left of a search is compared with no less."""
FAINTEST_J = 1e-9
"""As much, before anything has moved."""
ROUNDING = 1e-13
"""Of the function, relative."""


@numba.njit(cache=True, error_model="numpy")
def elastic_of(q, phi, rest, elements, modulus, law, x, force):
    """Write the positions of the nodes in use into ``x`` (m, 3); return elastic energy [J] and its gradient (r,)."""
    x.reshape(-1)[:] = rest + np.dot(phi, q)
    force[:] = 0.0
    tetrahedra, gradients, volumes, mu, lam = elements
    shape, measure, volume = law
    energy = energy_and_force(x, tetrahedra, gradients, volumes, mu, lam, shape, measure, volume, force)
    pull = np.dot(modulus, q)
    return energy + 0.5 * np.dot(pull, q), pull - np.dot(force.reshape(-1), phi)


@numba.njit(cache=True, error_model="numpy")
def touched_by(x, local, tools, stencils, rubbing, points, pull):
    """Write the contact's points and the forces on them; return its energy [J]."""
    for a in range(len(local)):
        for i in range(3):
            points[a, i] = x[local[a], i]
    points[len(local) :] = tools
    return press(stencils, rubbing, points, pull)


@numba.njit(cache=True, error_model="numpy")
def gathered(pull, local, phi, gradient):
    """Subtract the forces on points from the gradient (r,) in place; return the points (t,) that there is one on."""
    count, touched = 0, np.empty(len(local), np.int64)
    for a in range(len(local)):
        if pull[a, 0] == 0.0 and pull[a, 1] == 0.0 and pull[a, 2] == 0.0:
            continue
        touched[count] = a
        count += 1
        for i in range(3):
            row, f = phi[3 * local[a] + i], pull[a, i]
            for j in range(len(gradient)):
                gradient[j] -= f * row[j]
    return touched[:count]


@numba.njit(cache=True, error_model="numpy")
def improve(inverse, step, turn, bent):
    """Improve the ``inverse`` Hessian (r, r) in place by damped BFGS (Powell 1978; Nocedal and Wright 2006, 18.2).

    turn : by how much ``step`` has turned the gradient; bent : by how much the Hessian had it
    """
    along, across = np.dot(step, bent), np.dot(step, turn)
    if across < 0.2 * along:
        mix = 0.8 * along / (along - across)
        turn = mix * turn + (1.0 - mix) * bent
        across = np.dot(step, turn)
    if not across > 1e-300:
        return
    back = np.dot(inverse, turn)
    grow = (1.0 + np.dot(turn, back) / across) / across
    for i in range(len(step)):
        a, b = grow * step[i] - back[i] / across, step[i] / across
        for j in range(len(step)):
            inverse[i, j] += a * step[j] - b * back[j]


@numba.njit(cache=True, error_model="numpy")
def minimise(
    q, inertia, centre, share, outer, inverse, body, local, tools, stencils, rubbing, work, floor, enough, most
):
    """Minimise ½ Σ inertia (q − centre)² + share E(q) − outer · q + contact, from ``q`` (r,) on, in place.

    inverse : (r, r), that of the Hessian without contact, which is improved by elastic gradients alone and kept by the
        caller. Contact's second derivatives S at few nodes, whose rows of Φ are J, are exact: (P⁻¹ + JᵀSJ)⁻¹ by
        Woodbury's formula, so that an iteration is of order r².
    body : arguments of ``elastic_of``; work : its positions and forces, and those of the contact's points
    It ends where a step would gain less than ``enough``² of the elastic energy, of ``floor`` [J] at least. Returns the
    elastic gradient and energy, and what is left.
    """
    phi, rest, elements, modulus, law = body
    x, force, points, pull = work
    energy, own = elastic_of(q, phi, rest, elements, modulus, law, x, force)
    away = q - centre
    value = 0.5 * np.sum(inertia * away * away) + share * energy - np.dot(outer, q)
    value += touched_by(x, local, tools, stencils, rubbing, points, pull)
    left = np.inf
    for rounds in range(most + 1):
        gradient = inertia * away + share * own - outer
        touched = gathered(pull, local, phi, gradient)
        ahead, held = -np.dot(inverse, gradient), np.zeros(len(q))
        if len(touched):
            place, rows = np.full(len(points), -1), np.empty((3 * len(touched), len(q)))
            for t in range(len(touched)):
                place[touched[t]] = t
                for i in range(3):
                    rows[3 * t + i] = phi[3 * local[touched[t]] + i]
            stiff = stiffen(stencils, rubbing, points, place)
            spread = np.dot(rows, inverse)
            mixed = np.eye(len(stiff)) + np.dot(stiff, np.dot(spread, np.ascontiguousarray(rows.T)))
            ahead -= np.dot(np.linalg.solve(mixed, np.dot(stiff, np.dot(rows, ahead))), spread)
            held = np.dot(np.dot(stiff, np.dot(rows, ahead)), rows)
        slope = np.dot(gradient, ahead)
        left = np.sqrt(max(0.0, -slope) / (share * max(energy, floor)))
        if not slope < 0.0 or left <= enough or rounds == most:
            break
        length, found = 1.0, False
        while length > 1e-5:
            reached = q + length * ahead
            lower, pulled = elastic_of(reached, phi, rest, elements, modulus, law, x, force)
            away = reached - centre
            there = 0.5 * np.sum(inertia * away * away) + share * lower - np.dot(outer, reached)
            there += touched_by(x, local, tools, stencils, rubbing, points, pull)
            if there <= value + 1e-4 * length * slope + ROUNDING * abs(value):
                found = True
                break
            length *= min(0.5, max(0.1, -0.5 * slope * length / (there - value - slope * length)))
        if not found:
            break
        step = reached - q
        # the Hessian without contact times the step, as the direction has solved it
        improve(inverse, step, inertia * step + share * (pulled - own), -length * (gradient + held))
        q[:], own, value, energy = reached, pulled, there, lower
    return own, energy, left


def make(system: System, settings: dict) -> "TouchingMotion":
    """Make the integrator with the modes ``settings["touching"]["learnt"]``, or those that ``prepare`` finds.

    InputError as ``prepare``, and for modes of another body.
    """
    contact, asked = _contact_of(system), settings["touching"]
    body = asked.get("learnt") or prepare(system, asked, until_s=settings["duration_s"])
    if not belongs(body, system):
        raise InputError(f"its modes are not those of {system.particles.name}; prepare them for this body.")
    return TouchingMotion(system, body, contact.instruments_on(body.reach), asked["tolerance"])


def prepare(
    system: System,
    asked: dict,
    shown: np.ndarray | None = None,
    passing: Sequence[Mapping] | None = None,
    until_s: float = 0.0,
) -> StrokeModes:
    """Find the modes that ``asked``, the block ``touching`` of a scene, describes (see ``learn``).

    shown : (s, n, 3) [m] motions to learn from; those of finite elements on the path's neighbours if there are none
    passing : blocks contact; nodes are in reach that their instruments or the scene's pass
    until_s : how long neighbours are followed [s], as a body goes on to move where an instrument has stopped
    InputError for an effect that it does not know, a body that nothing holds, and contact of bodies.
    """
    own = _contact_of(system).settings
    near = strokes.neighbours(own) if passing is None else passing
    if shown is None:
        shown = strokes.shown(system, near, until_s)
    paths = [(strokes.obstacles_of(system, each), strokes.duration_of(each)) for each in (own, *near)]
    return learn(system, np.asarray(shown, dtype=float), reach_of(system, paths, MARGIN_M), asked)


def _contact_of(system: System) -> Instrumented:
    """Return the contact of the one body there is; errors as ``prepare``."""
    if not isinstance(system.elastic, LinearElements):
        raise InputError("it needs finite elements, as modes of strokes are theirs; choose another integrator.")
    for name, effect in list(system.effects.items())[1:]:
        if not (offers(effect, FixedNodes) or offers(effect, Instrumented) or offers(effect, Proportional)):
            raise InputError(
                f"it has modes for instruments, anchors and damping in proportion to mass and stiffness alone, and the "
                f"scene has {name}; leave that out, or choose backward_euler."
            )
    if system.free.all():
        raise InputError("it needs a body that is held, as one that is not drifts out of all modes; hold it.")
    found = [effect for _, effect in system.offering(Instrumented)]
    if len(found) != 1:
        raise InputError("it is for a body that instruments touch; choose bdf2.")
    found[0].instruments_on(np.empty(0, dtype=int))  # refuses bodies that touch
    return found[0]


class _State(NamedTuple):
    """Coordinates q (r,), their rates w (r,) [1/s] and the elastic energy's gradient g (r,) at the end of a step."""

    q: np.ndarray
    w: np.ndarray
    g: np.ndarray

    def ahead(self, before: "_State", share: float) -> "_State":
        """Return this plus ``share`` of the change since ``before``."""
        return _State(*(a + share * (a - b) for a, b in zip(self, before, strict=True)))


class TouchingMotion:
    """M q″ + d (α M q + β g(q))/dt + g(q) = contact, in coordinates of ``body``.

    It needs no positions of other nodes than those of its few elements and those in reach of the instruments;
    ``state`` expands them. NotConverged where a step is not found, or where less of the gap is left than the barrier
    is exact for.

    Traps: nothing is known of motions that the strokes did not show, so ask for ``doubt``. As BDF2 it may make energy.
    """

    @property
    def limit_s(self) -> float:
        """The longest step [s]: in a longer one an instrument's middle may pass a surface unseen."""
        return min(obstacle.crossing_s for obstacle in self.contact.obstacles)

    def __init__(self, system: System, body: StrokeModes, contact: InstrumentContact, tolerance: float):
        self._system, self.body, self.contact, self._tolerance = system, body, contact, tolerance
        rates = [effect.damping_rates for _, effect in system.offering(Proportional)]
        self._alpha, self._beta = (sum(each[k] for each in rates) for k in (0, 1))
        elastic, nodes = system.elastic, system.particles.nodes
        assert isinstance(elastic, LinearElements)  # as ``make`` asks for
        tetrahedra = elastic.tetrahedra[body.elements]
        used = np.unique(np.append(tetrahedra, body.reach))
        place = np.full(len(nodes), -1)
        place[used] = np.arange(len(used))
        moduli = [np.broadcast_to(m, elastic.volumes.shape)[body.elements] for m in elastic.moduli]
        elements = place[tetrahedra], elastic.gradients[body.elements], elastic.volumes[body.elements] * body.weights
        phi = body.modes.reshape(-1, 3, body.count)[used].reshape(-1, body.count)
        few = (*elements, *moduli)
        self._body = phi, nodes[used].ravel(), tuple(np.ascontiguousarray(a) for a in few), body.modulus, elastic.law
        self._local, count = place[body.reach], contact.count
        self._work = (*np.zeros((2, len(used), 3)), *np.zeros((2, count, 3)))
        still = np.zeros(body.count)
        self._now = self._before = _State(still, still, still)
        self._points = self._points_before = np.vstack([nodes[body.reach], contact.at(0.0)])
        self._length, self._floor = 0.0, FAINTEST_J
        self._last: tuple[np.ndarray, np.ndarray, np.ndarray, float, float] | None = None
        self._inverse, self._scaled = np.empty((0, 0)), (still, 0.0)
        self._factors: dict[float, Factor] = {}
        self._compile()

    def _compile(self) -> None:
        """Call what a step calls, without a step, as the first call of each takes seconds."""
        one, rubbing = np.ones(self.body.count), self.contact.rubbing(self._points, self._points, 1.0)
        touching = self._local, self.contact.at(0.0), self.contact.stencils, rubbing, self._work
        minimise(0.0 * one, one, 0.0 * one, 1.0, 0.0 * one, np.diag(one), self._body, *touching, FAINTEST_J, 1.0, 0)
        least_gap(self.contact.stencils, self._points)

    def step(self, x: np.ndarray, v: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray]:
        """Return positions (n, 3) [m] and velocities [m/s] after a step of ``h`` [s]; errors as ``advance``."""
        self.advance(h)
        return self.state()

    def state(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the positions (n, 3) [m] of all nodes and their velocities [m/s]."""
        return self._system.particles.nodes + self.body.expand(self._now.q), self.body.expand(self._now.w)

    def advance(self, h: float) -> None:
        """Make a step of ``h`` [s] that ends at the system's time; NotConverged if it is not found."""
        end, contact, now, before = self._system.time, self.contact, self._now, self._before
        second = self._length == h and not contact.bends(end - h, h)
        share, reach = (1.0 / 3.0, 2.0 * h / 3.0) if second else (0.0, h)
        base = now.ahead(before, share)
        lag = self._beta / reach
        inertia = self.body.masses * (1.0 / reach**2 + self._alpha / reach)
        centre = base.q + self.body.masses / reach * base.w / inertia
        tools, seen = contact.at(end), self._points
        start = seen + share * (seen - self._points_before)
        self._rescale(inertia, 1.0 + lag)
        q, rubbing = now.q + h * now.w, contact.rubbing(seen, start, reach)
        for number in range(PASSES):
            if number:
                if not (contact.coefficient and self._work[3].any()):
                    break
                rubbing = contact.rubbing(self._work[2], start, reach)
            g, energy = self._found(q, inertia, centre, 1.0 + lag, lag * base.g, tools, rubbing)
        self._points, self._points_before = self._work[2].copy(), seen
        self._floor = max(self._floor, LEAST_ENERGY * energy)
        self._last = now.q, before.q, base.w, reach, share
        self._before, self._now, self._length = now, _State(q, (q - base.q) / reach, g), h
        forces = self._work[3]
        contact.reactions = np.array([forces[r].sum(axis=0) for r in contact.ranges])
        contact.work_j -= float(np.vdot(forces[len(self._local) :], tools - seen[len(self._local) :]))

    def _found(
        self,
        q: np.ndarray,
        inertia: np.ndarray,
        centre: np.ndarray,
        share: float,
        outer: np.ndarray,
        tools: np.ndarray,
        rubbing: Rubbing,
    ) -> tuple[np.ndarray, float]:
        """Minimise from ``q`` on, in place; return the elastic gradient and energy. NotConverged if it is not found."""
        problem = inertia, centre, share, outer
        for _ in range(2):
            touching = self._local, tools, self.contact.stencils, rubbing, self._work
            ends = self._floor, self._tolerance, ITERATIONS
            g, energy, left = minimise(q, *problem, self._inverse, self._body, *touching, *ends)
            if left <= self._tolerance:
                break
            self._inverse = np.diag(1.0 / (inertia + share))  # what was learnt misleads: once more without it
        if not left <= self._tolerance:
            raise NotConverged(
                f"the motion in modes stopped where a step would gain {left:.1e} of its energy's root, above the "
                f"tolerance {self._tolerance:.0e}; take shorter steps",
                [float(left)],
            )
        least = least_gap(self.contact.stencils, self._work[2]) if self._work[3].any() else 1.0
        if not least > SOFT:
            raise NotConverged(
                f"an instrument has pressed {least:.2g} of the gap together, and contact in modes is believed above "
                f"{SOFT:g}; change its path, or choose backward_euler",
                [least],
            )
        return g, energy

    def _rescale(self, inertia: np.ndarray, share: float) -> None:
        """Keep what was learnt of the elastic Hessian where the length or the order of steps changes."""
        if not len(self._inverse):
            self._inverse = np.diag(1.0 / (inertia + share))
        elif not (self._scaled[1] == share and np.array_equal(self._scaled[0], inertia)):
            bend = np.linalg.inv(self._inverse) - np.diag(self._scaled[0])
            self._inverse = np.linalg.inv(np.diag(inertia) + bend * (share / self._scaled[1]))
        self._scaled = inertia, share

    def doubt(self) -> float:
        """Return what the modes lack [m], RMS over the surface: what all elements leave of the last step's balance.

        That is answered by (1 + β/a) K + M (1/a² + α/a) at rest, a being 2/3 of a step. Infinite where an instrument is
        inside of the body beyond what it may touch. It grows with the error, and is not its size.
        """
        particles, elastic, body = self._system.particles, self._system.elastic, self.body
        assert isinstance(elastic, LinearElements) and self._last is not None  # it has stepped
        if self.contact.strays(particles.nodes + body.expand(self._now.q), self._system.time):
            return math.inf
        old, older, rate, reach, share = self._last
        here, there, before = (elastic.force(particles.nodes + body.expand(q)) for q in (self._now.q, old, older))
        lag, masses = self._beta / reach, particles.masses[:, None]
        inertia = body.expand((self._now.w - rate) / reach + self._alpha * self._now.w)
        left = (1.0 + lag) * here - lag * (there + share * (there - before)) - masses * inertia
        left[body.reach] += self._work[3][: len(self._local)]
        off = self._factor().solve(np.where(self._system.free[:, None], left, 0.0))
        return float(np.sqrt(np.mean(np.sum(off[np.unique(particles.triangles)] ** 2, axis=1))))

    def _factor(self) -> Factor:
        a = 2.0 * self._length / 3.0
        if a not in self._factors:
            matrix = (1.0 + self._beta / a) * stiffness_at_rest(self._system).tocsr()
            masses = np.repeat(self._system.masses * self._system.free, 3)
            matrix = matrix + sparse.diags_array(masses * (1.0 / a**2 + self._alpha / a))
            self._factors = {a: Factor(matrix.tobsr((3, 3)))}
        return self._factors[a]
