"""What models that settle have in common."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.judged_slab import *  # noqa: F403

from palpate.benchmark.load import Load
from palpate.benchmark.model import Case, Solver
from palpate.errors import InputError, NotConverged


@pytest.fixture
def loose(slab_case) -> Case:
    """The slab's case with nothing held."""
    case = slab_case[0]
    return replace(case, body=replace(case.body, anchors=[np.empty(0, dtype=np.int64)] * 2))


@pytest.fixture
def refuses(slab_case):
    """Assert that a solver of the slab finds nothing, saying ``said``, under no number, and answers no held node."""

    def check(solver: Solver, contact: int, said: str) -> None:
        load = Load.at(contact, np.zeros(3))
        load.presses[0].force[0] = np.nan  # loads are checked when they are made
        with pytest.raises(NotConverged, match=said):
            solver.respond(load)
        with pytest.raises(InputError, match="not a free surface node"):
            solver.respond(Load.at(slab_case[0].body.anchors[0][0], np.ones(3)))

    return check
