"""Doubt answers near the load under which a body, linearised at rest, buckles, for models that know no stability."""

import numpy as np

from palpate.benchmark.load import Answer, Doubted, Load
from palpate.benchmark.model import Case
from palpate.solvers.buckling import Buckling

LARGEST_SHARE = 0.3
"""Share of the buckling load above which such a model does not know. Of a column that is pressed 1° or 5° off its axis
linear responses miss 12 to 16 % there and warped ones 2 %; at 0.54 they miss 24 to 27 and 10 %."""


class NearBuckling:
    """The buckling loads of a case's body; a model doubts above the share ``largest``, LARGEST_SHARE if None."""

    def __init__(self, case: Case, largest: float | None = None):
        name = "buckling", case.body, case.radius_m
        self._largest = LARGEST_SHARE if largest is None else largest
        self._buckling = case.share(name, lambda: Buckling(case.body, case.radius_m), "buckling")

    def checked(self, load: Load, answer: np.ndarray | Answer) -> np.ndarray | Answer:
        """Return the ``answer`` to ``load``; Doubted where its forces are near those that buckle the body."""
        full = answer if isinstance(answer, Answer) else Answer(answer)
        nodes = [press.node for press in load.presses]
        share = self._buckling.share(
            load.forces() if full.forces is None else zip(nodes, full.forces, strict=True), self._largest
        )
        if share <= self._largest:
            return answer
        raise Doubted(f"this is {share:.2f} of the load under which the body buckles", [share], full)
