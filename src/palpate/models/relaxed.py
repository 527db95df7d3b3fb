"""Answer with methods that games relax bodies with: XPBD, vertex block descent and projective dynamics.

Given the time, all three end at the equilibrium of corotational linear elements on a level of the body. Contact is at
the nodes of the surface, as each method has it in practice: an inequality constraint of extended position-based
dynamics, whose multiplier is the force; a projection with a weight in projective dynamics; a penalty in vertex block
descent.
"""

from collections.abc import Callable, Sequence
from functools import cached_property, partial
from types import SimpleNamespace
from typing import Any

import numpy as np

from palpate.benchmark.cut_truth import Pulled
from palpate.benchmark.load import Load, Refused
from palpate.benchmark.model import Case, Setting, Solver, held_mb, on_own_levels
from palpate.benchmark.touch import Touch, TouchCase, Touched, TouchSolver
from palpate.bodies.body import Body
from palpate.bodies.cutting.cut import Cut
from palpate.bodies.cutting.ways import VIRTUAL_NODES
from palpate.bodies.material import LAWS
from palpate.bodies.particles import particles_of
from palpate.effects.bed import BedSprings
from palpate.effects.instrument import GRASP, Pose
from palpate.effects.instrument_penalty import NodeContact
from palpate.effects.linear_elements import LinearElements
from palpate.errors import NotConverged
from palpate.models import kinds
from palpate.models.cut.opened import CutCase, LevelModel
from palpate.models.fem import BEFORE
from palpate.models.fem_statics import ContactShares, held_on, to_surface
from palpate.models.touch.pushing import NodeTouch, Relaxing, dragged
from palpate.solvers.projective_dynamics import ProjectiveDynamics
from palpate.solvers.vertex_block_descent import VertexBlockDescent
from palpate.solvers.xpbd import InstrumentConstraints, Xpbd

LAW = LAWS[0]
FRAMES = 33
"""Frames in which a press has grown to the share BEFORE of its force: half a second, at 60 frames a second."""
PENALTY = 100.0
"""Stiffness of a node's contact over what resists its displacement if all others stand still."""
TOLERANCE = 1e-6
"""Of the residual of projective dynamics, relative to what the instrument pushes with before a step."""


def refuse_law(body: Body, method: str) -> None:
    """Raise Refused for a body whose law is not the one that ``method`` has."""
    if (law := body.material.law) != LAW:
        raise Refused(f"{method} has the corotational law, and {body.name} is {law}")


class RelaxedElements:
    """Linear elements on a ``level`` of a body and on its bed; ``held`` (n,) bool stand still.

    asked : the method's settings, such as ``benchmark.settings.Xpbd``
    """

    _relax: Callable[..., tuple[np.ndarray, np.ndarray]]

    def __init__(self, body: Body, level: int, held: np.ndarray, options: Any):
        mesh = body.levels[level]
        self._elements, self._asked = LinearElements(mesh, body.tissue(level)), options
        self._bed = None if body.bed is None else BedSprings(mesh, body.bed)

    def relax(
        self, x: np.ndarray, load: np.ndarray | None = None, before: np.ndarray | None = None, **met: Any
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return relaxed positions (n, 3) [m] from ``x``, and those one step of the method before.

        load : (n, 3) [N], or None for none; before : positions a step before ``x``, to continue a motion
        met : contact, by the keyword that the method has for it
        """
        return self._relax(x, np.zeros_like(x) if load is None else load, before=before, **met)

    def under(self, nodes: np.ndarray, pose: Pose) -> Relaxing:
        """Return the body under an instrument at ``pose`` that ``nodes`` (k,) may touch, ready to be relaxed."""
        raise NotImplementedError

    def force(self, x: np.ndarray) -> np.ndarray:
        """Return the forces (n, 3) [N] of elements and bed on all nodes."""
        return self._elements.force(x) + self._borne(x)

    def supported(self, x: np.ndarray, anchored: np.ndarray) -> np.ndarray:
        """Return the force (3,) [N] of the body on its anchors, ``anchored`` (n,) bool, and on its bed."""
        return self._elements.force(x)[anchored].sum(axis=0) - self._borne(x).sum(axis=0)

    def _borne(self, x: np.ndarray) -> np.ndarray:
        borne = np.zeros_like(x)
        if self._bed is not None:
            self._bed.add_force(x, None, borne)
        return borne

    @cached_property
    def _penalties(self) -> np.ndarray:
        return PENALTY * self._elements.resistance()


class ByXpbd(RelaxedElements):
    """Extended position-based dynamics; its step is in units of 1/ω of a node that swings between resting ones."""

    def __init__(self, body: Body, level: int, held: np.ndarray, options: Any):
        super().__init__(body, level, held, options)
        masses = particles_of(body, level, surface=False).masses
        self._step_s = options.step * float(np.median(np.sqrt(masses / self._elements.resistance())))
        xpbd = Xpbd(self._elements, masses, held, self._bed)
        self._relax = partial(xpbd.relax, steps=options.steps, iterations=options.iterations, step_s=self._step_s)

    def under(self, nodes: np.ndarray, pose: Pose) -> Relaxing:
        obstacle = InstrumentConstraints(nodes, pose)
        relax = partial(self.relax, obstacle=obstacle)
        return Relaxing(obstacle, lambda x: relax(x)[0], lambda x: obstacle.pushes(x, self._step_s))


class ByBlockDescent(RelaxedElements):
    """Vertex block descent: sweeps over the nodes."""

    def __init__(self, body: Body, level: int, held: np.ndarray, options: Any):
        super().__init__(body, level, held, options)
        descent = VertexBlockDescent(self._elements, held, self._bed)
        self._relax = partial(descent.relax, sweeps=options.sweeps, radius=options.radius)

    def under(self, nodes: np.ndarray, pose: Pose) -> Relaxing:
        contact = NodeContact(nodes, self._penalties[nodes], pose)
        relax = partial(self.relax, contact=contact)
        return Relaxing(contact, lambda x: relax(x)[0], contact.pushes)


class ByProjections(RelaxedElements):
    """Projective dynamics: iterations with one constant matrix."""

    def __init__(self, body: Body, level: int, held: np.ndarray, options: Any):
        super().__init__(body, level, held, options)
        self._projective = ProjectiveDynamics(self._elements, held, self._bed)
        self._relax = partial(self._projective.relax, iterations=options.iterations, memory=options.memory)

    def under(self, nodes: np.ndarray, pose: Pose) -> Relaxing:
        contact, asked = NodeContact(nodes, self._penalties[nodes], pose), self._asked
        descent = self._projective.pressed(contact)
        return Relaxing(contact, lambda x: descent.relax(x, asked.iterations, asked.memory, TOLERANCE), contact.pushes)


METHODS: dict[str, type[RelaxedElements]] = {
    "xpbd": ByXpbd,
    "vertex_block_descent": ByBlockDescent,
    "projective_dynamics": ByProjections,
}


def relaxed(method: str, body: Body, level: int, held: np.ndarray, options: Any) -> RelaxedElements:
    """Return the elements of a level as ``method`` relaxes them; Refused for a body of another law."""
    refuse_law(body, method)
    return METHODS[method](body, level, held, options)


class Relaxed(Solver):
    """Elements that are relaxed from rest, or from the frame before.

    The method finds that frame itself: the press grows over FRAMES, each with as many steps as the answer. So it lags
    behind, unlike a method that converges in every frame.
    """

    def __init__(self, case: Case, model: kinds.XPBD | kinds.VertexBlockDescent | kinds.ProjectiveDynamics):
        body, level = case.body, model.level
        self._body, self._rest = relaxed(model.name, body, level, held_on(body, level), model), body.levels[level].nodes
        self._shares, self._up = ContactShares(case, level), to_surface(body, level)
        self._follows = model.start == "frame"
        self._frames: dict[tuple[bytes | int, ...], tuple[np.ndarray, np.ndarray]] = {}

    @property
    def memory_mb(self) -> float:
        """The memory that is held between queries [MB], with one frame and not those of all queries."""
        return held_mb((self._body, self._shares, self._up, next(iter(self._frames.values()), None)))

    def precede(self, load: Load) -> None:
        """Relax the frame before under BEFORE times the load, if answers start from it; not timed."""
        if not self._follows or load.key in self._frames:
            return
        full_load = BEFORE * self._nodal(load)
        state = self._body.relax(self._rest, full_load / FRAMES)
        for frame in range(2, FRAMES + 1):
            state = self._body.relax(state[0], frame / FRAMES * full_load, before=state[1])
        self._frames[load.key] = state

    def respond(self, load: Load) -> np.ndarray:
        x, before = self._frames.get(load.key, (self._rest, None))
        return self._up @ (self._body.relax(x, self._nodal(load), before=before)[0] - self._rest)

    def _nodal(self, load: Load) -> np.ndarray:
        return self._shares.spread(load.forces(), len(self._rest))


prepare = Relaxed


class RelaxedTouch(NodeTouch):
    """Elements that are relaxed at each step of the instrument."""

    def __init__(self, case: TouchCase, method: str, level: int, options: Any):
        super().__init__(case, level)
        self._body = relaxed(method, case.body, level, self.held, options)

    def begin(self, nodes: np.ndarray, pose: Pose) -> Relaxing:
        return self._body.under(nodes, pose)

    def supported(self, x: np.ndarray) -> np.ndarray:
        return self._body.supported(x, self.held)


class RelaxedGrasp(TouchSolver):
    """Relaxed elements for each place that is grasped, with its nodes held; NotConverged where it has no node."""

    def __init__(self, case: TouchCase, method: str, level: int, options: Any):
        self._shape, self._mesh, self._up = case.body, case.body.levels[level], to_surface(case.body, level)
        self._anchored = held_on(case.body, level)
        self._holding = partial(relaxed, method, case.body, level, options=options)
        self._places: dict[int, tuple[np.ndarray, RelaxedElements]] = {}

    def prepare(self, touch: Touch) -> None:
        nodes = touch.patch(self._shape).nodes_of(self._mesh)
        if not len(nodes):
            raise NotConverged("no node of this level lies on what is grasped; take a finer one", [float("nan")])
        held = self._anchored | np.isin(np.arange(len(self._anchored)), nodes)
        self._places[touch.node] = nodes, self._holding(held=held)

    def respond(self, touch: Touch) -> Touched:
        (nodes, body), rest = self._places[touch.node], self._mesh.nodes
        shifts = np.broadcast_to(touch.depth_m * touch.direction, rest.shape)
        x = dragged(rest, nodes, shifts, lambda x: body.relax(x)[0])
        force, support_force = -body.force(x)[nodes].sum(axis=0), body.supported(x, self._anchored)
        direction = touch.direction
        return Touched(self._up @ (x - rest), float(force @ direction), reaction_n=float(support_force @ direction))


def settings(case: TouchCase, method: str) -> list[Setting]:
    """List the grid's settings of ``method`` on levels that the body has."""
    return on_own_levels(case, getattr(case.grid.relaxed, method))


def online(case: TouchCase, method: str, level: int, **options: float) -> TouchSolver:
    """Return the solver of touches by instruments, or of grasps, whose places are prepared when they are asked for.

    options : fields of the method's settings
    """
    kind = RelaxedGrasp if case.instrument.kind == GRASP else RelaxedTouch
    return kind(case, method, level, SimpleNamespace(**options))


class CutRelaxed(LevelModel):
    """Elements on a cut level that are relaxed at each step of the hooks; ``asked`` as of ``online``."""

    def __init__(self, method: str, case: CutCase, level: int, way: str = VIRTUAL_NODES, **options: float):
        super().__init__(case, level, way)
        self._method, self._asked = method, SimpleNamespace(**options)
        refuse_law(case.body, method)

    def cut(self, cuts: Sequence[Cut]) -> None:
        cut = self._opened = self._part(cuts)
        self._body = relaxed(self._method, cut.parted.body, 0, cut.held | cut.moved, self._asked)

    def pull(self) -> Pulled:
        cut = self._opened
        x = dragged(cut.rest, cut.moved, cut.shifts, lambda x: self._body.relax(x)[0])
        if not np.isfinite(x).all():
            raise NotConverged(f"{self._method} left the finite numbers", [float("nan")])
        return cut.answer(x, self._body.force(x))
