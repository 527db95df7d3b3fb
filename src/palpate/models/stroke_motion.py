"""Integrate a body that an instrument touches in few coordinates, faster than life: x = X + Φ q with exact contact.

A step has two stages, as in ``solvers.touched_motion``. Each is a minimisation by BFGS with contact's own Hessian.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from palpate.bodies.body import Body
from palpate.collision.contact.friction import Rubbing
from palpate.collision.contact.instrument_contact import InstrumentContact, pushes, rubbing_of
from palpate.effects.effect import FixedNodes, Instrumented, Proportional, offers
from palpate.effects.elements import PLAIN_POISSON, largest_poisson
from palpate.effects.instrument import Tools, gaps_of
from palpate.effects.linear_elements import LinearElements
from palpate.effects.settings import Contact, Rayleigh, Stepping, Touching
from palpate.errors import InputError, NotConverged
from palpate.models import strokes
from palpate.models.local_answers import FLAT, RESIDUAL, SOFTER, Dent, carried, numbered, turn_of, turned
from palpate.models.reduced_body import check_same
from palpate.models.stroke_modes import StrokeModes, learn
from palpate.models.touched_search import TOGETHER, minimise, placed
from palpate.setting_types import key
from palpate.solvers.system import System
from palpate.solvers.touched_motion import STAGE

REACH_M = 0.006
"""Distance from an instrument at which points may come to touch it within a step."""
FAR_M, CLOSE_M = 0.012, 0.001
"""The same distance before the dents of a step are known, and after, as their nodes are many unknowns."""
SPARE = 1.25
"""Largest number of nodes of the step before, over those needed now, at which the former are used again."""
STRAY = 0.1
"""Depth inside an instrument, over its radius, beyond which a motion is not believed."""
MISSED_RESIDUAL = 0.03
"""Relative residual of what modes lack."""
Problem = tuple[np.ndarray, np.ndarray, float, np.ndarray, np.ndarray]
Known = tuple[np.ndarray, float, float, np.ndarray]
NOTHING: Known = np.zeros(0), 0.0, math.inf, np.zeros((0, 0))
"""What is known of a point where no search has ended, as ``minimise`` takes it."""
AHEAD = (1.0 - 2.0 * STAGE) / STAGE
"""Share of the first stage's change by which the second stage's base is beyond the first one's end."""
ITERATIONS = 60
"""Most steps of a search."""
PASSES = 2
"""Searches of a stage with friction: with directions and forces of its beginning, then those of the first's end."""
LEAST_ENERGY = 0.01
"""Least energy that a residual is compared with, over the largest elastic energy so far."""
FAINTEST_J = 1e-9
"""The same before anything has moved."""
COURSE = 240
"""Times at which an instrument's course is tested against the held surface, beside its corners."""
LATTICE = np.array([[i, j, 4 - i - j] for i in range(5) for j in range(5 - i)]) / 4.0
"""Places on a triangle, barycentric (15, 3)."""


class Learnt(Touching):
    """Modes that are known already."""

    learnt: Any = key("What ``prepare`` has found")


def make(system: System, stepping: Stepping) -> "TouchingMotion":
    """Return the integrator of a system, with modes that are ``Learnt`` or that ``prepare`` finds.

    InputError as ``prepare``, and for modes of another body.
    """
    (contact, system_body), touching = _touched(system), stepping.touching or Touching()
    learnt = touching.learnt if isinstance(touching, Learnt) else None
    body: StrokeModes = learnt or prepare(system, touching, until_s=stepping.duration_s)
    check_same(body.body, system_body)
    return TouchingMotion(system, body, contact.instruments_on(), touching.tolerance)


def prepare(
    system: System,
    settings: Touching,
    shown: np.ndarray | None = None,
    passing: Sequence[Contact] | None = None,
    until_s: float = 0.0,
) -> StrokeModes:
    """Learn the modes that ``settings``, the block ``touching`` of a scene, describes; see ``learn``.

    shown : (s, n, 3) [m] motions of quadratic elements to learn from; None simulates strokes on the path's neighbours
    passing : other contacts, whose instruments may touch the body too; as strokes need not be like these, dents have
        responses of their own
    until_s : how long neighbours are followed [s], as a body goes on to move where an instrument has stopped
    InputError for an effect that it does not know, a body that nothing holds or that hardly changes its volume, and
    contact of bodies.
    """
    contact, body = _touched(system)
    own = contact.settings
    near = strokes.neighbours(own) if passing is None else passing
    if shown is None:
        shown = strokes.shown(body, near, rates(system), until_s)
    return learn(system, shown, strokes.points_of(body, [own, *near]), settings, anywhere=passing is not None)


def rates(system: System) -> Rayleigh:
    """Return the rates of Rayleigh damping, summed over the effects of a system."""
    of_effects = [effect.damping_rates for _, effect in system.offering(Proportional)]
    return Rayleigh(mass_1_s=sum(each[0] for each in of_effects), stiffness_s=sum(each[1] for each in of_effects))


def _touched(system: System) -> tuple[Instrumented, Body]:
    """Return the contact with instruments and the one body of a system; InputError where strokes do not apply."""
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
    if (poisson := largest_poisson(system.particles.tissue)) > PLAIN_POISSON:
        raise InputError(
            f"Poisson's ratio of {body.name} is {poisson:g}, and its modes are those of elements that lock above "
            f"{PLAIN_POISSON}; choose backward_euler, or a smaller ratio."
        )
    if system.free.all():
        raise InputError("it needs a body that is held, as one that is not drifts out of all modes; hold it.")
    instrumented = [effect for _, effect in system.offering(Instrumented)]
    if len(instrumented) != 1:
        raise InputError("it is for a body that instruments touch; choose bdf2.")
    instrumented[0].instruments_on()  # refuses bodies that touch
    return instrumented[0], body


def held_met(system: System, contact: InstrumentContact) -> tuple[float, str]:
    """Return when an instrument's course first enters the held surface [s], ∞ if none does, and its name."""
    nodes, faces = system.particles.nodes, system.particles.triangles
    held_faces = faces[~system.free[faces].any(axis=1)]
    points = np.vstack([nodes[np.unique(faces[~system.free[faces]])], (LATTICE @ nodes[held_faces]).reshape(-1, 3)])
    corner_times = np.concatenate([each.times_s for each in contact.obstacles])
    for t in np.union1d(corner_times[corner_times >= 0.0], np.linspace(0.0, corner_times.max(initial=0.0), COURSE)):
        least_gaps = gaps_of(points, contact.at(t))[0].min(axis=1, initial=np.inf)
        if least_gaps.min() < 0.0:
            return float(t), contact.obstacles[int(least_gaps.argmin())].name
    return math.inf, ""


class _State(NamedTuple):
    """Coordinates q (r,), rates w (r,) [1/s] and the elastic energy's gradient g (r,), at the end of a stage."""

    q: np.ndarray
    w: np.ndarray
    g: np.ndarray

    def ahead(self, before: "_State", share: float) -> "_State":
        """Return this state plus ``share`` of the change since the state ``before``."""
        return _State(*(a + share * (a - b) for a, b in zip(self, before, strict=True)))


class TouchingMotion:
    """M q″ + d (α M q + β g(q))/dt + g(q) = contact, in coordinates of ``body``.

    Only points near the instruments are placed in a step; ``state`` places all nodes. NotConverged where a step is not
    found, or an instrument meets what is held.
    Traps: nothing is known of motions that the strokes did not show, so ask for ``doubt``. It may make energy.
    """

    @property
    def limit_s(self) -> float:
        """The longest step [s]: in a longer one an instrument's middle may pass a surface unseen."""
        return self.contact.crossing_s

    def __init__(self, system: System, body: StrokeModes, contact: InstrumentContact, tolerance: float):
        self._system, self.body, self.contact, self._tolerance = system, body, contact, tolerance
        damping = rates(system)
        self._alpha, self._beta = damping.mass_1_s, damping.stiffness_s
        self._body = body.model.in_blocks(TOGETHER)
        # the first nodes of quadratic elements are the corners
        self._corners = body.modes[: len(system.particles.nodes)].reshape(-1, body.count)
        self._rest = body.points.interpolation @ body.motion.rest
        near = np.unique(body.points.interpolation.indices)
        self._nodes = body.modes[near].reshape(-1, body.count)
        self._between = body.points.interpolation[:, near].tocsr()
        self._meets_s, self._meets = held_met(system, contact)
        self._stiff = body.points.penalty * body.points.areas
        self._masses, still = body.masses, np.zeros(body.count)
        self._now = self._before = _State(still, still, still)
        self._tools = self._tools_before = contact.at(0.0)
        self._length, self._floor, self._energy = 0.0, FAINTEST_J, 0.0
        self._last: tuple[np.ndarray, np.ndarray, np.ndarray, float, float] | None = None
        self._hessian, self._scaled = np.empty((0, 0)), (still, 0.0)
        self._forces, self._near = np.zeros((0, 3)), np.zeros(0, dtype=int)
        self._dents, self._strayed = [FLAT, FLAT, FLAT], False
        # nodes whose dents a step looks for, and the number of each node in reach among them
        self._kept, self._turn = FLAT.nodes, FLAT.turn
        self._number = np.full(0 if body.local is None else len(body.local.nodes), -1)
        self._still = self._local = np.zeros((0, 0))
        self._compile()

    def _compile(self) -> None:
        """Call all that a step calls without making one, as first calls take seconds to compile."""
        ones = np.ones(self.body.count)
        touch = self._touch(self._tools, 0.0 * ones)
        zeros = np.zeros(len(ones) + len(self._local))
        self._places = placed(zeros, touch)
        self._speeds = np.zeros_like(self._places)
        rubbing = self._rubbing(touch, zeros, self._tools, zeros, self._tools, 1.0)
        least = self._local, np.diag(ones), self._body, touch, rubbing, self._forces, (1.0, 1.0, 0), NOTHING
        minimise(zeros, ones, 0.0 * ones, 1.0, zeros, *least)

    def step(self, x: np.ndarray, v: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray]:
        """Return positions (n, 3) [m] and velocities [m/s] after a step of ``h`` [s]; errors as ``advance``."""
        self.advance(h)
        return self.state()

    def state(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the positions (n, 3) [m] of all nodes and their velocities [m/s]."""
        nodes = self._system.particles.nodes
        x, v = (self._corners @ np.column_stack([self._now.q, self._now.w])).reshape(-1, 3, 2).transpose(2, 0, 1)
        if self.body.local is not None and self._length:
            dents_now, dents_before = (self.body.local.of_corners(dent) for dent in self._dents[:2])
            x, v = x + dents_now, v + (dents_now - dents_before) / self._length
        return nodes + x, v

    def advance(self, h: float) -> None:
        """Make a step of ``h`` [s] that ends at the system's time; NotConverged if it is not found."""
        end = self._system.time
        if end >= self._meets_s:
            raise NotConverged(f"{self._meets} is driven into held nodes", [])
        first_stage = STAGE * h
        self._reach(end - h + first_stage, first_stage, 0.0, first_stage)
        first_reactions = (1.0 - STAGE) * self.contact.reactions
        self._reach(end, h - first_stage, AHEAD, first_stage)
        self.contact.means = first_reactions + STAGE * self.contact.reactions

    def _reach(self, end: float, h: float, share: float, reach: float) -> None:
        """Make a stage that ends at ``end`` [s], ``h`` [s] after the last: an implicit Euler step over ``reach`` [s].

        The Euler step starts at the last state plus ``share`` of the change since the one before.
        """
        contact, now, earlier = self.contact, self._now, self._before
        # the Euler step's inertia about its base
        base = now.ahead(earlier, share)
        lag = self._beta / reach
        inertia = self._masses * (1.0 / reach**2 + self._alpha / reach)
        centre = base.q + self._masses / reach * base.w / inertia
        last_tools, tools = self._tools, contact.at(end)
        start = last_tools._replace(tips=last_tools.tips + share * (last_tools.tips - self._tools_before.tips))
        self._rescale(inertia, 1.0 + lag)
        # unknowns are coordinates, from where they would swing freely, and dents
        q = now.q + h * now.w
        touch = self._touch(tools, q)
        dent, dent_before = (self._dented(each) for each in self._dents[:2])
        dent_base = dent + share * (dent - dent_before)
        z, z_base = np.append(q, dent), np.append(base.q, dent_base)
        outer = lag * np.append(base.g, self._local @ dent_base)
        rubbing = self._rubbing(touch, np.append(now.q, dent), last_tools, z_base, start, reach)
        known = NOTHING  # what the last search has found
        for search in range(PASSES):
            if search:
                if not (contact.friction and self._forces.any()):
                    break
                rubbing = self._rubbing(touch, z, tools, z_base, start, reach)
            known = self._found(z, (inertia, centre, 1.0 + lag, outer, self._local), touch, rubbing, known)
        # the state that is reached, its contact and its energy
        g, energy, *_ = known
        places_before = placed(np.append(now.q, dent), touch)
        self._places = placed(z, touch)
        self._speeds = (self._places - places_before) / h
        self._strayed |= strays(self._places, tools)
        q, dent_n = z[: len(q)], self._local @ z[len(q) :]
        forces = dent_n.reshape(-1, 3) @ self._turn
        self._dents = [Dent(self._kept, forces, self._turn), *self._dents[:2]]
        self._tools, self._tools_before = tools, last_tools
        self._floor, self._energy = max(self._floor, LEAST_ENERGY * energy), energy + 0.5 * float(dent_n @ z[len(q) :])
        self._last = now.q, earlier.q, base.w, reach, share
        self._before, self._now, self._length = now, _State(q, (q - base.q) / reach, g), h
        previous, contact.reactions = contact.reactions, -pushes(self._places, touch[2], tools, rubbing)[0].sum(axis=1)
        contact.work_j -= 0.5 * float(np.vdot(previous + contact.reactions, tools.tips - last_tools.tips))

    def energies(self) -> dict[str, float]:
        """Return the kinetic, the elastic and contact's energy [J], by the names of the effects; friction has none."""
        (contact, _), *_ = self._system.offering(Instrumented)
        depths = np.maximum(-gaps_of(self._places, self._tools)[0], 0.0)
        kinetic, pressed = self._masses * self._now.w**2, self._stiff[self._near] * depths**2
        elastic = next(iter(self._system.effects))
        return {"kinetic": 0.5 * float(kinetic.sum()), elastic: self._energy, contact: 0.5 * float(pressed.sum())}

    def contacts(self) -> pd.DataFrame:
        """Tabulate each point inside an instrument, with the columns of ``Contact.contacts``; friction is no part."""
        gaps, normals = gaps_of(self._places, self._tools)
        tool, point = np.nonzero(gaps < 0.0)
        travel = (self._tools.tips - self._tools_before.tips) / max(self._length, np.finfo(float).tiny)
        moving = self._speeds[point] - travel[tool]
        names = np.array([each.name for each in self.contact.obstacles], dtype=object)
        columns = {"first": self._system.particles.name, "second": names[tool]}
        for start, values, unit in (
            ("", self._places[point], "_m"), ("normal_", normals[tool, point], ""), ("velocity_", moving, "_m_s"),
        ):  # fmt: skip
            columns |= {f"{start}{letter}{unit}": values[:, axis] for axis, letter in enumerate("xyz")}
        gap_m = gaps[tool, point]
        return pd.DataFrame(columns | {"gap_m": gap_m, "force_n": -self._stiff[self._near][point] * gap_m})

    def _touch(
        self, tools: Tools, q: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, Tools, np.ndarray, np.ndarray]:
        """Return contact near ``tools``: rows (3c, r), places at rest (c, 3) [m], stiffness (c,) [N/m], and the tools.

        Then the weights (c, 6) and numbers (c, 6) of nodes that dents move there, of which there may be none.
        q : (r,), about where the search ends, as a deep press moves points far from their places at rest
        """
        local = self.body.local
        if local is None:
            moved = self._rest + self._between @ (self._nodes @ q).reshape(-1, 3)
            self._near = np.flatnonzero(gaps_of(moved, tools)[0].min(axis=0) < REACH_M)
            weights, nodes = np.zeros((len(self._near), 0)), np.zeros((len(self._near), 0), dtype=np.int64)
        else:
            posed = local.rest + (local.modes @ q).reshape(-1, 3)
            near = gaps_of(posed, tools)[0].min(axis=0) < FAR_M
            self._near = np.flatnonzero(near[local.places].any(axis=1))
            needed, numbers = numbered(local.places[self._near], len(posed))
            shift = posed[needed] - local.rest[needed] + local.field(self._dents[0], needed)
            moved = carried(self._rest, local.weights, local.places, self._near, shift, numbers)
            self._near = self._near[gaps_of(moved, tools)[0].min(axis=0) < CLOSE_M]
            weights, places = local.weights[self._near], local.places[self._near]
            needed, numbers = numbered(places, len(posed))
            if len(self._kept) > SPARE * len(needed) or (self._number[needed] < 0).any():
                self._kept, self._number = needed, numbers
                self._still = local.stiffness(needed)
            nodes = self._number[places]
            if len(needed):
                self._turn = turn_of(local.rest[needed], posed[needed])
            self._local = turned(self._still, self._turn)
        self._forces = np.zeros((len(self._near), 3))
        rows = self.body.rows[self._near].reshape(-1, self.body.count)
        return rows, self._rest[self._near], self._stiff[self._near], tools, weights, nodes

    def _dented(self, dent: Dent) -> np.ndarray:
        """Return the displacements (3m,) [m] of a ``dent`` at the nodes whose dents this step looks for."""
        return np.zeros(0) if self.body.local is None else self.body.local.field(dent, self._kept).ravel()

    def _rubbing(self, touch: tuple, z: np.ndarray, at: Tools, base: np.ndarray, start: Tools, reach: float) -> Rubbing:
        """Return friction with normals and pressures at unknowns ``z`` (r + 3m,) and instruments ``at``.

        It resists motion from ``base`` (r + 3m,) and instruments at ``start``, in the time ``reach`` [s].
        """
        travel, slip = touch[3].tips - start.tips, self.contact.slip_m_s * reach
        return rubbing_of(placed(z, touch), touch[2], at, self.contact.friction, placed(base, touch), travel, slip)

    def _found(self, z: np.ndarray, problem: Problem, touch: tuple, rubbing: Rubbing, known: Known) -> Known:
        """Minimise from ``z`` on, in place, and return what ``minimise`` does; NotConverged if it is not found."""
        (inertia, _, share, *_), ends = problem, (self._floor, self._tolerance, ITERATIONS)
        for _ in range(2):
            known = minimise(z, *problem, self._hessian, self._body, touch, rubbing, self._forces, ends, known)
            root = known[2]
            if root <= self._tolerance:
                return known
            # the Hessian learnt in earlier steps misleads: once more from that at rest
            self._hessian, known = np.diag(inertia + share), NOTHING
        raise NotConverged(
            f"the motion in modes stopped where a step would gain {root:.1e} of its energy's root, above the tolerance "
            f"{self._tolerance:.0e}; take shorter steps",
            [float(root)],
        )

    def _rescale(self, inertia: np.ndarray, share: float) -> None:
        """Scale the Hessian's part beside ``inertia`` (r,) to another length or order of steps, by their ``share``."""
        if not len(self._hessian):
            self._hessian = np.diag(inertia + share)
        elif not (self._scaled[1] == share and np.array_equal(self._scaled[0], inertia)):
            learnt = self._hessian - np.diag(self._scaled[0])
            self._hessian = np.diag(inertia) + learnt * (share / self._scaled[1])
        self._scaled = inertia, share

    def _whole(self) -> np.ndarray:
        """Return displacements (3, n, 3) [m] of all nodes after the last stage and at the two states before it."""
        body, earlier = self.body, self._last
        assert earlier is not None  # it has stepped
        moved = np.array([body.modes @ q for q in (self._now.q, *earlier[:2])])
        if body.local is None:
            return moved
        loads = np.zeros((*body.elements.rest.shape, 3))
        for number, dent in enumerate(self._dents):
            loads[body.local.nodes[dent.nodes], :, number] = SOFTER * dent.forces
        flat = body.modes.reshape(-1, body.count)
        lacked = body.elements.solve(loads, RESIDUAL) - (flat @ (flat.T @ loads.reshape(-1, 3))).reshape(loads.shape)
        return moved + np.array([lacked[..., k] @ dent.turn.T for k, dent in enumerate(self._dents)])

    def doubt(self) -> float:
        """Return what the modes lack [m], RMS over the surface: the linear response to all elements' residual.

        The residual is that of the last stage, of length a, and the response that of (1 + β/a) K at rest. Infinite
        where an instrument is inside of the body beyond what it may touch, or has been since this was asked, or the
        corners of an element are inside out. It grows with the error, and is not its size.
        """
        body, elements = self.body, self.body.elements
        assert self._last is not None  # it has stepped
        moved, moved_before, moved_earlier = self._whole()
        places = elements.rest + moved
        strayed, self._strayed = self._strayed or strays(places[body.body.fine.surface], self._tools), False
        corners = places[body.body.fine.tetrahedra]
        turned_over = (np.linalg.det(corners[:, 1:] - corners[:, :1]) <= 0.0).any()
        if turned_over or strayed:
            return math.inf
        _, _, rate, reach, share = self._last
        force_now, force_before, force_earlier = (elements.force(each) for each in (moved, moved_before, moved_earlier))
        lag = self._beta / reach
        inertia = body.motion.masses @ (body.modes @ ((self._now.w - rate) / reach + self._alpha * self._now.w))
        unbalanced = (1.0 + lag) * force_now - lag * (force_before + share * (force_before - force_earlier)) - inertia
        unbalanced += body.points.interpolation[self._near].T @ self._forces
        missed = elements.solve(unbalanced[:, :, None] / (1.0 + lag), MISSED_RESIDUAL)[body.body.fine.surface]
        return float(np.sqrt(np.mean(np.sum(missed**2, axis=1))))


def strays(places: np.ndarray, tools: Tools) -> bool:
    """Return whether one of ``places`` (n, 3) [m] is inside of an instrument by more than STRAY."""
    return bool((gaps_of(places, tools)[0].min(axis=1, initial=np.inf) < -STRAY * tools.radii).any())
