"""Shared by methods that relax nodes under an instrument: its steps inward, the answer at the end, and a calibration.

Methods without elements are calibrated by touches that quadratic elements answer: at a given depth a stiffness scales
the force and leaves the displacement as it is, so that one factor fits it.
"""

import warnings
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from palpate.benchmark.touch import Touch, TouchCase, Touched, TouchSolver, choose_touches, touches_of
from palpate.benchmark.touch_mesh import TouchedMeshes
from palpate.effects.instrument import Pose
from palpate.effects.instrument_penalty import NodeContact, may_touch
from palpate.errors import NotConverged
from palpate.models.fem_statics import held_on, to_surface
from palpate.solvers.xpbd import InstrumentConstraints

SHARES = (0.2, 0.4, 0.6, 0.8, 1.0)
"""Depths at which the instrument stops on its way, over the whole depth."""
REACH = 1.0
"""Nodes may come to touch that are within so many depths of the instrument's last place."""


class Relaxing(NamedTuple):
    """A body under one instrument, as a method relaxes it.

    contact : which has the ``pose`` of the instrument, for whoever moves it
    relax : from positions (n, 3) [m] to relaxed ones, with the instrument where it is
    pushes : from these to the forces (k, 3) [N] of the instrument on the nodes, as the method has them
    """

    contact: NodeContact | InstrumentConstraints
    relax: Callable[[np.ndarray], np.ndarray]
    pushes: Callable[[np.ndarray], np.ndarray]


class NodeTouch(TouchSolver):
    """A method that relaxes the nodes of a level at each step of an instrument, starting from the step before.

    Where nothing touches yet, the body stays at rest. The area is that of the nodes which carry a force.
    """

    def __init__(self, case: TouchCase, level: int):
        self.shape, self.mesh, self._up = case.body, case.body.levels[level], to_surface(case.body, level)
        self.held = held_on(case.body, level)

    def begin(self, nodes: np.ndarray, pose: Pose) -> Relaxing:
        """Return what relaxes the body, of which ``nodes`` (k,) may touch an instrument at ``pose``."""
        raise NotImplementedError

    def supported(self, x: np.ndarray) -> np.ndarray:
        """Return the force (3,) [N] of the body at ``x`` (n, 3) [m] on its supports."""
        raise NotImplementedError

    def respond(self, touch: Touch) -> Touched:
        start_pose, mesh = touch.pose(self.shape), self.mesh
        nodes = may_touch(mesh, self.held, start_pose.moved(touch.depth_m * touch.direction), REACH * touch.depth_m)
        relaxing, x, pushes = self.begin(nodes, start_pose), mesh.nodes, np.zeros((len(nodes), 3))
        for share in SHARES:
            pose = relaxing.contact.pose = start_pose.moved(share * touch.depth_m * touch.direction)
            if x is mesh.nodes and not (pose.gaps(x[nodes])[0] < 0.0).any():
                continue
            x = relaxing.relax(x)
            pushes = relaxing.pushes(x)
        force = float(pushes.sum(axis=0) @ touch.direction)
        area = float(mesh.areas[nodes[pushes.any(axis=1)]].sum())
        reaction = 0.0 if x is mesh.nodes else float(self.supported(x) @ touch.direction)
        return Touched(self._up @ (x - mesh.nodes), force, area, reaction)


def dragged(
    rest: np.ndarray, nodes: np.ndarray, shifts: np.ndarray, relax: Callable[[np.ndarray], np.ndarray]
) -> np.ndarray:
    """Return positions (n, 3) [m] after ``nodes`` moved by ``shifts`` (n, 3) [m], relaxed at SHARES of the way."""
    x = rest.copy()
    for share in SHARES:
        x[nodes] = (rest + share * shifts)[nodes]
        x = relax(x)
    return x


COUNT, DEPTHS = 4, (0.3, 0.7)
"""Calibrating touches, and their depths over the radius of the instrument, at most the deepest of the case."""
ALONG, TOLERANCE = 2.0, 1e-3
"""Elements along the radius of what touches, and the residual at which their answers stop."""
SEED = 1000
"""Added to the case's, so that the touches are not those that are asked."""


def calibration(case: TouchCase) -> list[tuple[Touch, Touched]]:
    """Return some touches and quadratic elements' answers to them, computed once for all models of a case."""
    return case.share("calibration", lambda: _answered(case))


def _answered(case: TouchCase) -> list[tuple[Touch, Touched]]:
    """Choose touches that elements finer than the models' answer, and return these with the answers."""
    meshes, answers = TouchedMeshes(case.body), {}

    def bears(touch: Touch) -> bool:
        try:
            mesh = meshes.around(touch, 0, meshes.level_for(touch, ALONG))
            answers[touch.node, touch.depth_m] = mesh.answer(TOLERANCE)[0]
        except NotConverged:
            return False
        return True

    deepest = case.deepest_m / case.instrument.radius_m
    depths = min(DEPTHS[0], deepest), min(DEPTHS[1], deepest)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of places that others take
        table = choose_touches(case.body, case.instrument, COUNT, depths, case.seed + SEED, bears)
    touches = touches_of(case.instrument, table)
    return [(touch, answers[touch.node, touch.depth_m]) for touch in touches]


def force_scale(answers: list[Touched], right: list[Touched]) -> float:
    """Return the factor by which forces of ``answers`` fit those of ``right``, by least squares of relative errors.

    NotConverged where no touch is felt at all.
    """
    ratios = np.array([answer.force_n / reference.force_n for answer, reference in zip(answers, right, strict=True)])
    if not (np.isfinite(ratios).all() and ratios.sum() > 0.0):
        raise NotConverged("no calibrating touch is felt; take a finer level", [float("nan")])
    return float(ratios.sum() / (ratios @ ratios))
