"""Answer with methods that games relax bodies with: element by element, vertex by vertex, or by one matrix.

All three end at the equilibrium of corotational linear elements on a level of the body, if they are given the time.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from palpate.benchmark.load import Load, Refused
from palpate.benchmark.model import Case, OfBody, Solver, held_mb
from palpate.bodies.material import LAWS
from palpate.bodies.particles import particles_of
from palpate.effects.bed import BedSprings
from palpate.effects.linear_elements import LinearElements
from palpate.models import kinds
from palpate.models.fem import BEFORE
from palpate.models.fem_statics import ContactShares, to_surface
from palpate.solvers.projective_dynamics import ProjectiveDynamics
from palpate.solvers.vertex_block_descent import VertexBlockDescent
from palpate.solvers.xpbd import Xpbd

LAW = LAWS[0]
FRAMES = 33
"""Frames in which a press has grown to the share BEFORE of its force: half a second, at 60 frames a second."""

Relax = Callable[..., tuple[np.ndarray, np.ndarray]]
"""From positions (n, 3) [m] and nodal forces (n, 3) [N] to relaxed positions, and those a step before; ``before`` may
be given, too, to go on with the motion."""


def refuse_law(case: OfBody, method: str) -> None:
    """Raise Refused for a body whose law is not the one that ``method`` has."""
    if (law := case.body.material.law) != LAW:
        raise Refused(f"{method} has the corotational law, and {case.body.name} is {law}")


class Relaxed(Solver):
    """Linear elements on a level that are relaxed from rest, or from the frame before.

    To that frame the method has come by itself, over FRAMES in which the press grows, with as many steps in each as for
    the answer. So it lags behind, unlike a method that converges in every frame. Answers whose nodes are not all finite
    are refused afterwards, as all models' are.
    """

    def __init__(self, case: Case, model: kinds.XPBD | kinds.VertexBlockDescent | kinds.ProjectiveDynamics):
        body, level = case.body, model.level
        mesh, tissue = body.levels[level], body.tissue(level)
        refuse_law(case, model.name)
        self._rest = mesh.nodes
        held = np.isin(np.arange(len(self._rest)), body.anchors[level])
        bed = None if body.bed is None else BedSprings(mesh, body.bed)
        masses = particles_of(body, level, surface=False).masses
        self._relax = relaxes(model.name, LinearElements(mesh, tissue), masses, held, model, bed)
        self._shares, self._up = ContactShares(case, level), to_surface(body, level)
        self._follows = model.start == "frame"
        self._frames: dict[tuple[bytes | int, ...], tuple[np.ndarray, np.ndarray]] = {}

    @property
    def memory_mb(self) -> float:
        """The memory that is held between queries [MB], with one frame and not those of all queries."""
        return held_mb((self._relax, self._shares, self._up, next(iter(self._frames.values()), None)))

    def precede(self, load: Load) -> None:
        """Press up to the frame before, if that is what answers start from; not timed."""
        if not self._follows or load.key in self._frames:
            return
        whole = BEFORE * self._nodal(load)
        at = self._relax(self._rest, whole / FRAMES)
        for frame in range(2, FRAMES + 1):
            at = self._relax(at[0], frame / FRAMES * whole, before=at[1])
        self._frames[load.key] = at

    def respond(self, load: Load) -> np.ndarray:
        x, before = self._frames.get(load.key, (self._rest, None))
        return self._up @ (self._relax(x, self._nodal(load), before=before)[0] - self._rest)

    def _nodal(self, load: Load) -> np.ndarray:
        return self._shares.spread(load.forces(), len(self._rest))


def relaxes(
    method: str,
    elements: LinearElements,
    masses: np.ndarray,
    held: np.ndarray,
    setting: Any,
    bed: BedSprings | None = None,
) -> Relax:
    """Return ``method``; masses (n,) [kg], held (n,) bool, ``bed`` what the body lies on.

    setting : an object with the numbers of the method, such as ``benchmark.settings.Xpbd``
    """
    if method == "xpbd":
        # a step is measured by the time in which a node would swing if all others stood still
        step_s = setting.step * float(np.median(np.sqrt(masses / elements.resistance())))
        steps, iterations = setting.steps, setting.iterations
        return partial(Xpbd(elements, masses, held, bed).relax, steps=steps, iterations=iterations, step_s=step_s)
    if method == "vertex_block_descent":
        descent = VertexBlockDescent(elements, held, bed)
        return partial(descent.relax, sweeps=setting.sweeps, radius=setting.radius)
    projective = ProjectiveDynamics(elements, held, bed)
    return partial(projective.relax, iterations=setting.iterations, memory=setting.memory)


prepare = Relaxed
