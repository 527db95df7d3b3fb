"""Answer with linear fine finite elements, whose compliance is computed in advance.

What is linear adds up: several presses at prepared contacts are the sum of their responses, and a disc that is pushed
to a depth bears the force of which the sum moves it so far.
"""

import numpy as np

from palpate.benchmark.load import Answer, Load
from palpate.benchmark.model import Case, Setting
from palpate.models.depths import Discs
from palpate.models.enrichment.linear_fem import LinearFem
from palpate.models.memory import held_mb

PREPARED, REDUCES, LAW = True, "p2", "linear"


def settings(case: Case) -> list[Setting]:
    """List the one setting there is."""
    return [{}]


def prepare(case: Case, setting: Setting) -> "Linear":
    """Take the compliance, which is all that it costs."""
    return Linear(case)


class Linear:
    """Three stored columns for each contact."""

    def __init__(self, case: Case):
        self._linear, self._discs = LinearFem(case.use_compliance()), Discs(case)

    @property
    def memory_mb(self) -> float:
        """The memory that is held between queries [MB]."""
        return held_mb(self._linear)

    def respond(self, load: Load) -> np.ndarray | Answer:
        """Return the displacement (n_surface, 3) [m] under ``load``, with the forces of discs pushed to a depth.

        InputError for a contact that is not prepared, Refused where forces do not follow from the depths.
        """
        given, pushed = load.parted()
        if not pushed:
            return self._linear.superpose(given)
        forces = self._discs.linear_forces(load)
        presses = [(press.node, force) for press, force in zip(load.presses, forces, strict=True)]
        return Answer(self._linear.superpose(presses), forces)
