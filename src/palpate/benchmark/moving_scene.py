"""A scene reduced to the body that moves and the loads that act, which all models have, and engines elsewhere too."""

from dataclasses import dataclass, field
from typing import Self

import numpy as np

from palpate.benchmark.comparable import TAKEN_OVER
from palpate.bodies.body import Body
from palpate.bodies.mesh import Sheet
from palpate.bodies.refinement import finer
from palpate.bodies.sheet_levels import nest_sheet
from palpate.effects.push import placed
from palpate.effects.settings import Loads, Push, Rayleigh
from palpate.scenes.settings import Scene


@dataclass(frozen=True, eq=False)
class MovingScene:
    """A moving body and its loads; its motion is asked for at the ends of ``frames`` equal parts of ``duration_s``.

    body : of nested levels, the last of which is the reference's
    loads : what acts, of TAKEN_OVER; rayleigh : what damps the reference
    shifts_m : of further bodies of the same kind; held : whether anchors hold them
    """

    name: str
    body: Body
    loads: Loads
    rayleigh: Rayleigh
    duration_s: float
    frames: int
    shifts_m: list[list[float]] = field(default_factory=list)
    held: bool = True

    @classmethod
    def of(cls, scene: Scene, body: Body, duration_s: float, frames: int, level: int | None = None) -> Self:
        """Reduce ``scene`` to the loads TAKEN_OVER on a ``body``, whose levels are refined up to that of the reference.

        level : of the reference; None takes the scene's, but level 1 at least
        """
        loads = Loads(**{effect: getattr(scene, effect) for effect in TAKEN_OVER})
        finest = max(scene.level, 1) if level is None else level
        if isinstance(body.coarse, Sheet):
            body = nest_sheet(body, finest)
        else:
            while len(body.levels) <= finest:
                body = finer(body)
            body = body.up_to(finest)
        shifts, damping = [other.shift_m for other in scene.others], scene.rayleigh or Rayleigh()
        return cls(scene.name, body, loads, damping, duration_s, frames, shifts, scene.held)

    def placed_loads(self) -> Loads:
        """Return ``loads`` with the discs that are pushed as the reference's level has them, for models of all levels.

        Raises InputError as ``push.placed``.
        """
        if not self.loads.push:
            return self.loads
        held_nodes = self.body.anchors[-1] if self.held else np.empty(0, dtype=int)
        discs = placed(self.body.fine, held_nodes, self.body.name, self.loads.pushes)
        return self.loads.but(push=Push(loads=discs))
