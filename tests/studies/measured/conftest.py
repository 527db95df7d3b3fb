"""A slender bar of quadratic elements, without lateral contraction as in the theory of beams."""

import numpy as np
import pytest

from palpate.bodies.body import Body, nest
from palpate.bodies.material import Material
from palpate.bodies.simple_shapes import box

LENGTH, SIDE = 0.2, 0.01


@pytest.fixture(scope="session")
def bar() -> Body:
    """A bar of 0.2 m × 0.01 m × 0.01 m, held at x = 0, once refined."""
    mesh = box([LENGTH, SIDE, SIDE], [10, 2, 2])
    return nest("bar", mesh, 1, np.flatnonzero(mesh.nodes[:, 0] == 0.0), Material(1e6, 0.0, 1000.0))
