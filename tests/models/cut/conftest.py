"""A bar that a plane cuts through, and a slab whose lips two hooks pull apart."""

import numpy as np
import pytest
from fixtures.cut_cases import hook

from palpate.benchmark.cut_truth import mouth
from palpate.bodies.body import nest
from palpate.bodies.cutting.cut import Disc, blade
from palpate.bodies.material import Material
from palpate.bodies.simple_shapes import box
from palpate.models.cut.opened import CutCase

TISSUE = Material(3000.0, 0.3, 1000.0)


@pytest.fixture(scope="session")
def bar():
    mesh = box([0.1, 0.02, 0.02], [10, 2, 2])
    return nest("bar", mesh, 1, np.flatnonzero(mesh.nodes[:, 0] == 0.0), TISSUE)


@pytest.fixture(scope="session")
def severed(bar):
    """The case of a bar that is severed at ``at`` [m] of its length, and hooked at its free end."""

    def case(at, normal=(1.0, 0.0, 0.0)):
        cut = Disc(np.array([at, 0.0, 0.0]), np.array(normal), 1.0)
        return CutCase(bar, [cut], [hook(bar, [0.1, 0.01, 0.01], [0.003, 0.0, 0.001])], np.empty((0, 3)))

    return case


@pytest.fixture(scope="session")
def slab():
    mesh = box([0.1, 0.1, 0.04], [8, 8, 4])
    return nest("slab", mesh, 1, np.flatnonzero(mesh.nodes[:, 2] == 0.0), TISSUE)


@pytest.fixture(scope="session")
def opening(slab):
    cut = blade(slab.fine, np.array([[0.025, 0.0517, 0.04], [0.075, 0.0493, 0.04]]), np.array([0.0, 0.0, -1.0]), 0.015)
    hooks = [hook(slab, [0.05, 0.05 + y, 0.04], [0.0, 0.15 * y, 0.001]) for y in (0.025, -0.025)]
    return CutCase(slab, [cut], hooks, mouth(slab.fine, cut))
