"""A scene reduced to what all models can share, engines elsewhere too: what moves and what acts, on nested levels."""

from dataclasses import dataclass, field
from typing import Self

import numpy as np

from palpate.benchmark.comparable import TAKEN_OVER, acts
from palpate.bodies.body import Body
from palpate.bodies.mesh import Sheet
from palpate.bodies.refinement import finer
from palpate.bodies.sheet_levels import nest_sheet
from palpate.effects.push import placed
from palpate.scenes import effect_registry


@dataclass(frozen=True, eq=False)
class MovingScene:
    """A scene whose motion is known at the ends of ``frames`` equal parts of ``duration_s``.

    body : of nested levels, the last of which is the reference's
    loads : blocks of TAKEN_OVER; rayleigh : what damps the reference
    shifts_m : of further bodies of the same kind; held : whether anchors hold them
    """

    name: str
    body: Body
    loads: dict[str, dict]
    rayleigh: dict
    duration_s: float
    frames: int
    shifts_m: list[list[float]] = field(default_factory=list)
    held: bool = True

    @classmethod
    def of(cls, name: str, entry: dict, body: Body, own: dict) -> Self:
        """Reduce the scene ``entry`` of the config to what its models can share.

        own : ``duration_s``, ``frames``, and perhaps ``level``, that of the reference; without it the scene's, but one
            finer than the coarse one
        """
        kind = "sheet" if isinstance(body.coarse, Sheet) else ""
        loads = {effect: entry[effect] for effect in TAKEN_OVER if effect in entry and acts(effect, entry, kind)}
        damping = entry.get("rayleigh", dict(effect_registry.EFFECTS["rayleigh"].settings or {}))
        last = own.get("level", max(entry.get("level", 0), 1))
        if kind:
            body = nest_sheet(body, last)
        else:
            while len(body.levels) <= last:
                body = finer(body)
            body = body.up_to(last)
        shifts = [other["shift_m"] for other in entry.get("others", [])]
        return cls(name, body, loads, damping, own["duration_s"], own["frames"], shifts, entry.get("held", True))

    def placed_loads(self) -> dict[str, dict]:
        """Return ``loads`` with the discs that are pushed as the reference's level has them, for models of all levels.

        Raises InputError as ``push.placed``.
        """
        if "push" not in self.loads:
            return self.loads
        held = self.body.anchors[-1] if self.held else np.empty(0, dtype=int)
        return self.loads | {"push": {"loads": placed(self.body.fine, held, self.body.name, self.loads["push"])}}
