"""Answer a touch with methods that games relax bodies with: element by element, vertex by vertex, or by one matrix.

Contact is what each of them has for it in practice, at the nodes of the surface: an inequality constraint of extended
position-based dynamics, whose multiplier is the force; a projection with a weight in projective dynamics; a penalty in
vertex block descent. All end at the equilibrium of corotational linear elements whose nodes are kept out.
"""

from collections.abc import Callable
from functools import partial
from types import SimpleNamespace

import numpy as np

from palpate.benchmark.model import Setting, on_own_levels
from palpate.benchmark.touch import Touch, TouchCase, Touched, TouchSolver
from palpate.bodies.particles import particles_of
from palpate.effects.bed import BedSprings
from palpate.effects.instrument import GRASP, Pose
from palpate.effects.instrument_penalty import NodeContact
from palpate.effects.linear_elements import LinearElements
from palpate.errors import NotConverged
from palpate.models.relaxed import LAW, refuse_law
from palpate.models.touch.pushing import SHARES, NodeTouch, Relaxing
from palpate.solvers.projective_dynamics import ProjectiveDynamics
from palpate.solvers.vertex_block_descent import VertexBlockDescent
from palpate.solvers.xpbd import Obstacle, Xpbd

__all__ = ["LAW", "online", "settings"]

PENALTY = 100.0
"""Stiffness of a node's contact over what resists its displacement if all others stand still."""
NO_NODES = np.empty(0, dtype=int)
TOLERANCE = 1e-6
"""Of the residual of projective dynamics, relative to what the instrument pushes with before a step."""


def settings(case: TouchCase, method: str) -> list[Setting]:
    """List the grid's settings of ``method`` on levels that the body has."""
    return on_own_levels(case, getattr(case.grid.relaxed, method))


class RelaxedTouch(NodeTouch):
    """Linear elements on a level; each step of the instrument has as many iterations as the setting says.

    grasped : nodes that are held besides the anchors
    """

    def __init__(
        self, case: TouchCase, method: str, level: int, asked: SimpleNamespace, grasped: np.ndarray = NO_NODES
    ):
        super().__init__(case, level)
        self._grasped, self._anchored = grasped, self.held
        self.held = self.held | np.isin(np.arange(len(self.held)), grasped)
        refuse_law(case, method)
        self._elements = LinearElements(self.mesh, case.body.tissue(level))
        self._bed = None if case.body.bed is None else BedSprings(self.mesh, case.body.bed)
        masses = particles_of(case.body, level, surface=False).masses
        self._begin = _BEGIN[method](self._elements, masses, self.held, self._bed, asked)

    def begin(self, nodes: np.ndarray, pose: Pose) -> Relaxing:
        return self._begin(nodes, pose)

    def supported(self, x: np.ndarray) -> np.ndarray:
        borne = self._borne(x)
        return self._elements.force(x)[self._anchored].sum(axis=0) - borne.sum(axis=0)

    def _borne(self, x: np.ndarray) -> np.ndarray:
        """Return the forces (n, 3) [N] of the bed on the nodes."""
        borne = np.zeros_like(x)
        if self._bed is not None:
            self._bed.add_force(x, None, borne)
        return borne

    def move(self, touch: Touch) -> Touched:
        """Return the answer to a touch that moves what is grasped, step by step."""
        mesh, way, nodes = self.mesh, touch.depth_m * touch.direction, self._grasped
        relax, x = self.begin(NO_NODES, touch.pose(self.shape)).relax, mesh.nodes.copy()
        for share in SHARES:
            x[nodes] = mesh.nodes[nodes] + share * way
            x = relax(x)
        force = -(self._elements.force(x) + self._borne(x))[nodes].sum(axis=0)
        felt = float(self.supported(x) @ touch.direction)
        return Touched(self._up @ (x - mesh.nodes), float(force @ touch.direction), reaction_n=felt)


class RelaxedGrasp(TouchSolver):
    """The same body for each place that is grasped, with other nodes held; NotConverged where there are none."""

    def __init__(self, case: TouchCase, method: str, level: int, asked: SimpleNamespace):
        self._case, self._level = case, level
        self._make = partial(RelaxedTouch, case, method, level, asked)
        self._places: dict[int, RelaxedTouch] = {}

    def prepare(self, touch: Touch) -> None:
        nodes = touch.patch(self._case.body).nodes_of(self._case.body.levels[self._level])
        if not len(nodes):
            raise NotConverged("no node of this level lies on what is grasped; take a finer one", [float("nan")])
        self._places[touch.node] = self._make(nodes)

    def respond(self, touch: Touch) -> Touched:
        return self._places[touch.node].move(touch)


def online(case: TouchCase, method: str, level: int, **asked: float) -> TouchSolver:
    """Return what answers touches by instruments, or grasps of places that are prepared when that is asked.

    asked : fields of the method's settings
    """
    kind = RelaxedGrasp if case.instrument.kind == GRASP else RelaxedTouch
    return kind(case, method, level, SimpleNamespace(**asked))


Begin = Callable[[np.ndarray, Pose], Relaxing]
"""From the nodes (k,) that may touch, and the pose at first touch, to what relaxes."""


def _xpbd(
    elements: LinearElements, masses: np.ndarray, held: np.ndarray, bed: BedSprings | None, asked: SimpleNamespace
) -> Begin:
    step_s = asked.step * float(np.median(np.sqrt(masses / elements.resistance())))
    xpbd, nothing = Xpbd(elements, masses, held, bed), np.zeros((len(held), 3))

    def begin(nodes: np.ndarray, pose: Pose) -> Relaxing:
        obstacle = Obstacle(nodes, pose)

        def relax(x: np.ndarray) -> np.ndarray:
            return xpbd.relax(x, nothing, asked.steps, asked.iterations, step_s, obstacle=obstacle)[0]

        return Relaxing(obstacle, relax, lambda x: obstacle.pushes(x, step_s))

    return begin


def _projective_dynamics(
    elements: LinearElements, masses: np.ndarray, held: np.ndarray, bed: BedSprings | None, asked: SimpleNamespace
) -> Begin:
    projective, weights = ProjectiveDynamics(elements, held, bed), PENALTY * elements.resistance()

    def begin(nodes: np.ndarray, pose: Pose) -> Relaxing:
        contact = NodeContact(nodes, weights[nodes], pose)
        descent = projective.pressed(contact)
        return Relaxing(contact, lambda x: descent.relax(x, asked.iterations, asked.memory, TOLERANCE), contact.pushes)

    return begin


def _vertex_block_descent(
    elements: LinearElements, masses: np.ndarray, held: np.ndarray, bed: BedSprings | None, asked: SimpleNamespace
) -> Begin:
    descent, penalties = VertexBlockDescent(elements, held, bed), PENALTY * elements.resistance()
    nothing = np.zeros((len(held), 3))

    def begin(nodes: np.ndarray, pose: Pose) -> Relaxing:
        contact = NodeContact(nodes, penalties[nodes], pose)

        def relax(x: np.ndarray) -> np.ndarray:
            return descent.relax(x, nothing, asked.sweeps, asked.radius, contact=contact)[0]

        return Relaxing(contact, relax, contact.pushes)

    return begin


_BEGIN: dict[str, Callable[..., Begin]] = {
    "xpbd": _xpbd,
    "projective_dynamics": _projective_dynamics,
    "vertex_block_descent": _vertex_block_descent,
}
