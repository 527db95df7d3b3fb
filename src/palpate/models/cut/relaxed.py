"""Answer with methods that games relax bodies with, on a cut level: by elements, by vertices, or by one matrix.

All end at the equilibrium of corotational linear elements on the level, in the way that it is cut.
"""

from collections.abc import Sequence
from types import SimpleNamespace

import numpy as np

from palpate.benchmark.cut_truth import Pulled
from palpate.bodies.cutting.cut import Cut
from palpate.bodies.cutting.ways import VIRTUAL_NODES
from palpate.bodies.particles import particles_of
from palpate.effects.linear_elements import LinearElements
from palpate.errors import NotConverged
from palpate.models.cut.opened import CutCase, opened, skin_of
from palpate.models.relaxed import refuse_law, relaxes
from palpate.models.touch.pushing import SHARES


class CutRelaxed:
    """Linear elements that are relaxed at each step of the hooks, ``asked`` says with how many iterations."""

    def __init__(self, method: str, case: CutCase, level: int, way: str = VIRTUAL_NODES, **asked: float):
        self.case, self._level, self._way, self._method = case, level, way, method
        self._asked, self._skin = SimpleNamespace(**asked), skin_of(case, level)
        refuse_law(case, method)

    def cut(self, cuts: Sequence[Cut]) -> None:
        self._opened = opened(self.case, self._level, self._skin, cuts, self._way)
        body = self._opened.parted.body
        self._elements = LinearElements(body.coarse, body.tissue(0))
        masses = particles_of(body, 0, surface=False).masses
        still = self._opened.held | self._opened.moved
        self._relax = relaxes(self._method, self._elements, masses, still, self._asked)

    def pull(self) -> Pulled:
        cut = self._opened
        x, nothing = cut.rest.copy(), np.zeros_like(cut.rest)
        for share in SHARES:
            x[cut.moved] = (cut.rest + share * cut.shifts)[cut.moved]
            x = self._relax(x, nothing)[0]
        if not np.isfinite(x).all():
            raise NotConverged(f"{self._method} left the finite numbers", [float("nan")])
        return cut.answer(x, self._elements.force(x))
