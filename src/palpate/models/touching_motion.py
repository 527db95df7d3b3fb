"""Integrate a body that an instrument touches in few coordinates, faster than life: x = X + Φ q with exact contact.

BDF2, but backward Euler in steps in which the instrument's path bends. Each step is a minimisation by BFGS, which knows
contact's own second derivatives.
"""

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import NamedTuple

import numba
import numpy as np
import pandas as pd

from palpate.bodies.body import Body
from palpate.collision.contact.instrument_contact import InstrumentContact, Rubbing, Tools, gaps_of, press, stiffness
from palpate.effects.effect import FixedNodes, Instrumented, Proportional, offers
from palpate.effects.linear_elements import LinearElements
from palpate.errors import InputError, NotConverged
from palpate.models import strokes
from palpate.models.contact_modes.reduced_contact import Cells, cell_stresses
from palpate.models.reduced_body import check_same
from palpate.models.stroke_modes import StrokeModes, learn
from palpate.solvers.system import System

REACH_M = 0.006
"""Distance from an instrument at which points may come to touch it within a step."""
STRAY = 0.1
"""Of its radius, by which nothing that a motion is believed of is inside an instrument."""
TOGETHER = 32
"""Cells of which forces are computed at once."""
MISSED_RESIDUAL = 0.03
"""Relative residual of what modes lack."""
ITERATIONS = 60
"""Of a search, after which it counts as not found."""
PASSES = 2
"""Searches of a step with friction: with directions and forces of its beginning, then with those of the first's end."""
LEAST_ENERGY = 0.01
"""Of the largest elastic energy so far: what is left of a search is compared with no less."""
FAINTEST_J = 1e-9
"""As much, before anything has moved."""
COURSE = 240
"""Places of a course at which it may meet what is held, beside its corners."""
LATTICE = np.array([[i, j, 4 - i - j] for i in range(5) for j in range(5 - i)]) / 4.0
"""Places on a triangle, barycentric (15, 3)."""
ROUNDING = 1e-13
"""Of the function, relative."""


@numba.njit(cache=True, error_model="numpy")
def elastic_of(q, body):
    """Return the elastic energy [J] and its gradient (r,), block by block of cells, which stay in the cache."""
    slopes, volumes, mu, lam, rest, shape, measure, volume, f, p, energies, accepted = body
    pull = np.dot(rest, q)
    energy = 0.5 * np.dot(pull, q)
    for b in range(len(slopes)):
        cells = slopes[b], volumes[b], mu[b], lam[b]
        energy += cell_stresses(q, *cells, shape, measure, volume, f, p, energies, accepted)
        pull += np.dot(p.ravel(), slopes[b])
    return energy, pull


@numba.njit(cache=True, error_model="numpy")
def touched_by(q, touch, rubbing, force):
    """Write the forces (c, 3) [N] on the points; return their places (c, 3) [m] and the energy [J]."""
    rows, places, stiff, tools = touch
    points = (places.ravel() + np.dot(rows, q)).reshape(-1, 3)
    return points, press(points, stiff, tools, rubbing, force)


@numba.njit(cache=True, error_model="numpy")
def improve(hessian, step, turn):
    """Improve the ``hessian`` (r, r) in place by damped BFGS (Powell 1978; Nocedal and Wright 2006, 18.2).

    turn : by how much ``step`` has turned the gradient
    """
    bent = np.dot(hessian, step)
    along, across = np.dot(step, bent), np.dot(step, turn)
    if across < 0.2 * along:
        mix = 0.8 * along / (along - across)
        turn = mix * turn + (1.0 - mix) * bent
        across = np.dot(step, turn)
    if not across > 1e-300:
        return
    for i in range(len(step)):
        a, b = turn[i] / across, bent[i] / along
        for j in range(len(step)):
            hessian[i, j] += a * turn[j] - b * bent[j]


@numba.njit(cache=True, error_model="numpy", fastmath=True)
def solved(lower, right):
    """Return the solution (r,) with a positive definite matrix, ``lower`` (r, r) being its Cholesky factor."""
    found = right.copy()
    for i in range(len(found)):
        known = 0.0
        for j in range(i):
            known += lower[i, j] * found[j]
        found[i] = (found[i] - known) / lower[i, i]
    for i in range(len(found) - 1, -1, -1):
        found[i] /= lower[i, i]
        for j in range(i):
            found[j] -= found[i] * lower[i, j]
    return found


@numba.njit(cache=True, error_model="numpy")
def minimise(q, inertia, centre, share, outer, hessian, body, touch, rubbing, force, floor, enough, most):
    """Minimise ½ Σ inertia (q − centre)² + share E(q) − outer · q + contact, from ``q`` (r,) on, in place.

    hessian : (r, r), that without contact, which is improved by elastic gradients alone and kept by the caller; the
        second derivatives of contact are added exactly
    body, touch : arguments of ``elastic_of`` and ``touched_by``; force : (c, 3), is written
    It ends where a step would gain less than ``enough``² of the elastic energy, of ``floor`` [J] at least. Returns the
    elastic gradient and energy, and what is left.
    """
    rows, stiff, tools = touch[0], touch[2], touch[3]
    energy, own = elastic_of(q, body)
    away = q - centre
    points, value = touched_by(q, touch, rubbing, force)
    value += 0.5 * np.sum(inertia * away * away) + share * energy - np.dot(outer, q)
    left = np.inf
    for rounds in range(most + 1):
        gradient = inertia * away + share * own - outer - np.dot(force.ravel(), rows)
        whole = hessian.copy()
        chosen = np.flatnonzero((force[:, 0] != 0.0) | (force[:, 1] != 0.0) | (force[:, 2] != 0.0))
        if len(chosen):
            blocks = stiffness(points, stiff, tools, rubbing, chosen)
            near, bent = np.empty((3 * len(chosen), len(q))), np.empty((3 * len(chosen), len(q)))
            for c in range(len(chosen)):
                near[3 * c : 3 * c + 3] = rows[3 * chosen[c] : 3 * chosen[c] + 3]
                bent[3 * c : 3 * c + 3] = np.dot(blocks[c], near[3 * c : 3 * c + 3])
            whole += np.dot(near.T, bent)
        ahead = solved(np.linalg.cholesky(whole), -gradient)
        slope = np.dot(gradient, ahead)
        left = np.sqrt(max(0.0, -slope) / (share * max(energy, floor)))
        if not slope < 0.0 or left <= enough or rounds == most:
            break
        length, found = 1.0, False
        while length > 1e-5:
            reached = q + length * ahead
            lower, pulled = elastic_of(reached, body)
            away = reached - centre
            points, there = touched_by(reached, touch, rubbing, force)
            there += 0.5 * np.sum(inertia * away * away) + share * lower - np.dot(outer, reached)
            if there <= value + 1e-4 * length * slope + ROUNDING * abs(value):
                found = True
                break
            length *= min(0.5, max(0.1, -0.5 * slope * length / (there - value - slope * length)))
        if not found:
            break
        improve(hessian, reached - q, inertia * (reached - q) + share * (pulled - own))
        q[:], own, value, energy = reached, pulled, there, lower
    return own, energy, left


def in_blocks(cells: Cells) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return slopes (b, 9 TOGETHER, r), volumes and moduli (b, TOGETHER) of cells; some at the end have no volume."""
    missing = -len(cells.volumes) % TOGETHER
    slopes = np.pad(cells.slopes, ((0, 0), (0, missing), (0, 0))).reshape(9, -1, TOGETHER, cells.slopes.shape[2])
    blocks = np.ascontiguousarray(slopes.transpose(1, 0, 2, 3)).reshape(slopes.shape[1], 9 * TOGETHER, -1)
    filled = [np.pad(each, (0, missing)).reshape(-1, TOGETHER) for each in cells[1:]]
    return blocks, filled[0], filled[1], filled[2]


def make(system: System, settings: dict) -> "TouchingMotion":
    """Make the integrator with the modes ``settings["touching"]["learnt"]``, or those that ``prepare`` finds.

    InputError as ``prepare``, and for modes of another body.
    """
    (contact, own), asked = _touched(system), settings["touching"]
    body = asked.get("learnt") or prepare(system, asked, until_s=settings["duration_s"])
    check_same(body.body, own)
    return TouchingMotion(system, body, contact.instruments_on(), asked["tolerance"])


def prepare(
    system: System,
    asked: dict,
    shown: np.ndarray | None = None,
    passing: Sequence[Mapping] | None = None,
    until_s: float = 0.0,
) -> StrokeModes:
    """Find the modes that ``asked``, the block ``touching`` of a scene, describes (see ``learn``).

    shown : (s, n, 3) [m] motions of quadratic elements to learn from; those on the path's neighbours if there are none
    passing : blocks contact; points are in reach that their instruments or the scene's pass
    until_s : how long neighbours are followed [s], as a body goes on to move where an instrument has stopped
    InputError for an effect that it does not know, a body that nothing holds, and contact of bodies.
    """
    contact, body = _touched(system)
    own = contact.settings
    near = strokes.neighbours(own) if passing is None else passing
    if shown is None:
        shown = strokes.shown(body, near, rates(system), until_s)
    return learn(system, shown, strokes.points_of(body, [own, *near]), asked)


def rates(system: System) -> dict[str, float]:
    """Return the rates of damping, as the block ``rayleigh`` names them."""
    found = [effect.damping_rates for _, effect in system.offering(Proportional)]
    return {name: sum(each[k] for each in found) for k, name in enumerate(("mass_1_s", "stiffness_s"))}


def _touched(system: System) -> tuple[Instrumented, Body]:
    """Return the contact of the one body there is, and that; errors as ``prepare``."""
    body = system.particles.body
    if not isinstance(system.elastic, LinearElements) or body is None:
        raise InputError(
            "it needs one body of finite elements, as modes of strokes are theirs; choose another integrator."
        )
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
    found[0].instruments_on()  # refuses bodies that touch
    return found[0], body


def held_met(system: System, contact: InstrumentContact) -> tuple[float, str]:
    """Return when an instrument's course first leads into the held surface [s], and its name; ∞ if none does."""
    nodes, faces = system.particles.nodes, system.particles.triangles
    whole = faces[~system.free[faces].any(axis=1)]
    points = np.vstack([nodes[np.unique(faces[~system.free[faces]])], (LATTICE @ nodes[whole]).reshape(-1, 3)])
    corners = np.concatenate([path.times_s for path in contact.paths])
    for t in np.union1d(corners[corners >= 0.0], np.linspace(0.0, corners.max(initial=0.0), COURSE)):
        deepest = gaps_of(points, contact.at(t))[0].min(axis=1, initial=np.inf)
        if deepest.min() < 0.0:
            return float(t), contact.paths[int(deepest.argmin())].obstacle.name
    return math.inf, ""


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

    It needs no positions but those of points near the instruments; ``state`` expands them. NotConverged where a step
    is not found, or an instrument meets what is held.

    Traps: nothing is known of motions that the strokes did not show, so ask for ``doubt``. As BDF2 it may make energy.
    """

    @property
    def limit_s(self) -> float:
        """The longest step [s]: in a longer one an instrument's middle may pass a surface unseen."""
        return min(path.obstacle.crossing_s for path in self.contact.paths)

    def __init__(self, system: System, body: StrokeModes, contact: InstrumentContact, tolerance: float):
        self._system, self.body, self.contact, self._tolerance = system, body, contact, tolerance
        self._alpha, self._beta = rates(system).values()
        scratch = np.empty((9, TOGETHER)), np.empty((9, TOGETHER)), np.empty(TOGETHER), np.empty(TOGETHER, dtype=bool)
        self._body = *in_blocks(body.model.cells), body.model.rest, *body.model.law, *scratch
        # the first nodes of quadratic elements are the corners
        self._corners = body.modes[: len(system.particles.nodes)].reshape(-1, body.count)
        self._rest = body.points.interpolation @ body.motion.rest
        self._meets_s, self._meets = held_met(system, contact)
        self._stiff = body.points.penalty * body.points.areas
        self._masses, still = body.masses, np.zeros(body.count)
        self._now = self._before = _State(still, still, still)
        self._tools = self._tools_before = contact.at(0.0)
        self._length, self._floor, self._energy = 0.0, FAINTEST_J, 0.0
        self._last: tuple[np.ndarray, np.ndarray, np.ndarray, float, float] | None = None
        self._hessian, self._scaled = np.empty((0, 0)), (still, 0.0)
        self._forces, self._near = np.zeros((0, 3)), np.zeros(0, dtype=int)
        self._compile()

    def _compile(self) -> None:
        """Call what a step calls, without a step, as the first call of each takes seconds."""
        one = np.ones(self.body.count)
        none = np.zeros(self.body.count)
        touch = self._touch(self._tools, none)
        rubbing = self._rubbing(touch, none, self._tools, none, self._tools, 1.0)
        minimise(none, one, none, 1.0, none, np.diag(one), self._body, touch, rubbing, self._forces, 1.0, 1.0, 0)

    def step(self, x: np.ndarray, v: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray]:
        """Return positions (n, 3) [m] and velocities [m/s] after a step of ``h`` [s]; errors as ``advance``."""
        self.advance(h)
        return self.state()

    def state(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the positions (n, 3) [m] of all nodes and their velocities [m/s]."""
        nodes = self._system.particles.nodes
        x, v = (self._corners @ np.column_stack([self._now.q, self._now.w])).reshape(-1, 3, 2).transpose(2, 0, 1)
        return nodes + x, v

    def advance(self, h: float) -> None:
        """Make a step of ``h`` [s] that ends at the system's time; NotConverged if it is not found."""
        end, contact, now, earlier = self._system.time, self.contact, self._now, self._before
        if end >= self._meets_s:
            raise NotConverged(f"{self._meets} is driven into held nodes", [])
        second = self._length == h and not contact.bends(end - h, h)
        share, reach = (1.0 / 3.0, 2.0 * h / 3.0) if second else (0.0, h)
        base = now.ahead(earlier, share)
        lag = self._beta / reach
        inertia = self._masses * (1.0 / reach**2 + self._alpha / reach)
        centre = base.q + self._masses / reach * base.w / inertia
        seen, tools = self._tools, contact.at(end)
        start = seen._replace(tips=seen.tips + share * (seen.tips - self._tools_before.tips))
        self._rescale(inertia, 1.0 + lag)
        q = now.q + h * now.w
        touch = self._touch(tools, q)
        rubbing = self._rubbing(touch, now.q, seen, base.q, start, reach)
        for number in range(PASSES):
            if number:
                if not (contact.friction and self._forces.any()):
                    break
                rubbing = self._rubbing(touch, q, tools, base.q, start, reach)
            g, energy = self._found(q, inertia, centre, 1.0 + lag, lag * base.g, touch, rubbing)
        self._tools, self._tools_before = tools, seen
        self._floor, self._energy = max(self._floor, LEAST_ENERGY * energy), energy
        self._last = now.q, earlier.q, base.w, reach, share
        self._before, self._now, self._length = now, _State(q, (q - base.q) / reach, g), h
        before, contact.reactions = contact.reactions, -self._pushes(touch, q, rubbing)
        contact.work_j -= 0.5 * float(np.vdot(before + contact.reactions, tools.tips - seen.tips))

    def energies(self) -> dict[str, float]:
        """Return the kinetic, the elastic and contact's energy [J], by the names of the effects; friction has none."""
        (contact, _), *_ = self._system.offering(Instrumented)
        depths = np.maximum(-self._gaps()[1], 0.0)
        kinetic, pressed = self._masses * self._now.w**2, self._stiff[self._near] * depths**2
        elastic = next(iter(self._system.effects))
        return {"kinetic": 0.5 * float(kinetic.sum()), elastic: self._energy, contact: 0.5 * float(pressed.sum())}

    def contacts(self) -> pd.DataFrame:
        """Tabulate each point inside an instrument, with the columns of ``Contact.contacts``; friction is no part."""
        points, gaps, normals = self._gaps()
        tool, point = np.nonzero(gaps < 0.0)
        ways = (self._tools.tips - self._tools_before.tips) / max(self._length, np.finfo(float).tiny)
        moving = self.body.rows[self._near][point] @ self._now.w - ways[tool]
        names = np.array([path.obstacle.name for path in self.contact.paths], dtype=object)
        columns = {"first": self._system.particles.name, "second": names[tool]}
        for start, values, unit in (
            ("", points[point], "_m"), ("normal_", normals[tool, point], ""), ("velocity_", moving, "_m_s"),
        ):  # fmt: skip
            columns |= {f"{start}{letter}{unit}": values[:, axis] for axis, letter in enumerate("xyz")}
        deep = gaps[tool, point]
        return pd.DataFrame(columns | {"gap_m": deep, "force_n": -self._stiff[self._near][point] * deep})

    def _gaps(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the places (c, 3) [m] of points near tools, and ``gaps_of`` them, at the end of the last step."""
        points = self._rest[self._near] + self.body.rows[self._near] @ self._now.q
        return points, *gaps_of(points, self._tools)

    def _touch(self, tools: Tools, q: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, Tools]:
        """Return rows (3c, r), places at rest (c, 3) [m] and stiffness (c,) [N/m] of points near tools, and these.

        q : (r,), about where the search ends: a point that a deep press has moved is far from where it was at rest
        """
        moved = self._rest + (self.body.rows.reshape(-1, self.body.count) @ q).reshape(-1, 3)
        self._near = np.flatnonzero(gaps_of(moved, tools)[0].min(axis=0) < REACH_M)
        self._forces = np.zeros((len(self._near), 3))
        rows = self.body.rows[self._near].reshape(-1, self.body.count)
        return rows, self._rest[self._near], self._stiff[self._near], tools

    def _rubbing(self, touch: tuple, q: np.ndarray, at: Tools, base: np.ndarray, start: Tools, reach: float) -> Rubbing:
        """Return friction with normals and pressures at ``q`` (r,), of instruments ``at`` a time, in ``reach`` [s].

        It is that against motion from ``base`` (r,) and the instruments at ``start``.
        """
        rows, places, stiff, tools = touch
        seen, begun = ((places.ravel() + rows @ each).reshape(-1, 3) for each in (q, base))
        gaps, normals = gaps_of(seen, at)
        limits = self.contact.friction * stiff * np.maximum(-gaps, 0.0)
        return Rubbing(normals, limits, begun, tools.tips - start.tips, self.contact.slip_m_s * reach)

    def _pushes(self, touch: tuple, q: np.ndarray, rubbing: Rubbing) -> np.ndarray:
        """Return the force (k, 3) [N] of each instrument on the body."""
        found, force = [], np.empty_like(self._forces)
        if len(self.contact.paths) == 1:
            return self._forces.sum(axis=0, keepdims=True)
        for k in range(len(self.contact.paths)):
            alone = Tools(*(each[k : k + 1] for each in touch[3]))
            held = rubbing._replace(
                **{name: getattr(rubbing, name)[k : k + 1] for name in ("normals", "limits", "ways")}
            )
            touched_by(q, (*touch[:3], alone), held, force)
            found.append(force.sum(axis=0))
        return np.array(found)

    def _found(
        self,
        q: np.ndarray,
        inertia: np.ndarray,
        centre: np.ndarray,
        share: float,
        outer: np.ndarray,
        touch: tuple,
        rubbing: Rubbing,
    ) -> tuple[np.ndarray, float]:
        """Minimise from ``q`` on, in place; return the elastic gradient and energy. NotConverged if it is not found."""
        problem, ends = (inertia, centre, share, outer), (self._floor, self._tolerance, ITERATIONS)
        for _ in range(2):
            left = math.inf
            with suppress(np.linalg.LinAlgError):  # of a Hessian that is not positive, or not finite
                g, energy, left = minimise(q, *problem, self._hessian, self._body, touch, rubbing, self._forces, *ends)
            if left <= self._tolerance:
                return g, energy
            self._hessian = np.diag(inertia + share)  # what was learnt misleads: once more without it
        raise NotConverged(
            f"the motion in modes stopped where a step would gain {left:.1e} of its energy's root, above the tolerance "
            f"{self._tolerance:.0e}; take shorter steps",
            [float(left)],
        )

    def _rescale(self, inertia: np.ndarray, share: float) -> None:
        """Keep what was learnt of the elastic Hessian where the length or the order of steps changes."""
        if not len(self._hessian):
            self._hessian = np.diag(inertia + share)
        elif not (self._scaled[1] == share and np.array_equal(self._scaled[0], inertia)):
            bend = self._hessian - np.diag(self._scaled[0])
            self._hessian = np.diag(inertia) + bend * (share / self._scaled[1])
        self._scaled = inertia, share

    def doubt(self) -> float:
        """Return what the modes lack [m], RMS over the surface: what all elements leave of the last step's balance.

        That is answered by (1 + β/a) K at rest, a being 2/3 of a step. Infinite where an instrument is inside of the
        body beyond what it may touch, or the corners of an element are inside out. It grows with the error, and is not
        its size.
        """
        body, elements = self.body, self.body.elements
        assert self._last is not None  # it has stepped
        moved = body.modes @ self._now.q
        gaps, _ = gaps_of((elements.rest + moved)[body.body.fine.surface], self._tools)
        corners = (elements.rest + moved)[body.body.fine.tetrahedra]
        turned = (np.linalg.det(corners[:, 1:] - corners[:, :1]) <= 0.0).any()
        if turned or (gaps.min(axis=1) < -STRAY * self._tools.radii).any():
            return math.inf
        old, older, rate, reach, share = self._last
        here, there, before = (elements.force(each) for each in (moved, body.modes @ old, body.modes @ older))
        lag = self._beta / reach
        inertia = body.motion.masses @ (body.modes @ ((self._now.w - rate) / reach + self._alpha * self._now.w))
        left = (1.0 + lag) * here - lag * (there + share * (there - before)) - inertia
        left += body.points.interpolation[self._near].T @ self._forces
        off = elements.solve(left[:, :, None] / (1.0 + lag), MISSED_RESIDUAL)[body.body.fine.surface]
        return float(np.sqrt(np.mean(np.sum(off**2, axis=1))))
