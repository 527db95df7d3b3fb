"""The judged slab, and the slab on a bed."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.judged_slab import *  # noqa: F403

from palpate.benchmark.model import Case
from palpate.bodies.supports import Bed
from palpate.solvers.compliance import compute_compliance


@pytest.fixture(scope="session")
def bedded(slab_case) -> Case:
    """The slab on a bed under its lower side, nothing else holding it, with quadratic responses to discs of 3 cm."""
    case = slab_case[0]
    loose = replace(case.body, anchors=[np.empty(0, dtype=np.int64)] * 2)
    body = replace(loose, bed=Bed(np.array([0.1, 0.05, 0.0]), 0.3, 3e5, np.array([0.0, 0.0, -1.0])))
    return replace(case, body=body, radius_m=0.03, response=compute_compliance(body, 0.03, order=2), used={})


@pytest.fixture(scope="session")
def pressed(slab_case) -> tuple[Case, int, np.ndarray]:
    """The slab under a disc, a contact, and a force that moves it by about 10 % of its size."""
    case, test, _ = slab_case
    return replace(case, radius_m=0.03), int(test.contact[0]), 1.5 * test.force[0]
