"""Columns against Euler, and equilibria that are left where they are not stable."""

import numpy as np
import pytest
from scipy import sparse

from palpate.bodies.body import nest
from palpate.bodies.simple_shapes import box, cylinder
from palpate.errors import NotConverged
from palpate.solvers.buckling import Buckling
from palpate.solvers.equilibrium import FastEquilibrium, Unbuckled, softest
from palpate.solvers.pushed_discs import Pushed, push
from palpate.studies.hard_cases.stage import end_face

YOUNG = 3000.0


def euler(length, bending):
    """The load [N] of a column that is held at one end and free at the other; bending : second moment of area [m⁴]."""
    return np.pi**2 * YOUNG * bending / (4.0 * length**2)


@pytest.fixture(scope="module")
def bar(soft):
    """A slender bar, 0.2 m by 0.03 m by 0.04 m, held at x = 0, and its load by Euler."""
    mesh = box([0.2, 0.03, 0.04], [8, 2, 2])
    body = nest("bar", mesh, 1, np.flatnonzero(mesh.nodes[:, 0] == 0.0), soft)
    return body, euler(0.2, 0.04 * 0.03**3 / 12.0)


MIDDLE = [0.2, 0.015, 0.02]
"""Of the bar's end [m]."""


def nearest(body, place):
    return int(np.argmin(np.linalg.norm(body.fine.nodes - place, axis=1)))


def axial(body, newtons):
    return np.outer(end_face(body.fine), [-newtons, 0.0, 0.0])


def bent(body, x):
    """The largest displacement across the axis [m]."""
    return float(np.abs((x - body.fine.nodes)[:, 1:]).max())


def where_singular(problem, size, straight):
    """The share of a load at which the tangent is singular, by its softest values at the straight states of two."""
    shares, values = (0.85, 0.95), []
    for share in shares:
        x = straight(share)
        values.append(softest(problem, problem.at_rest(), x, size, 1e-3).value)
    return shares[0] + values[0] * (shares[1] - shares[0]) / (values[0] - values[1])


def test_a_bar_buckles_at_eulers_load(bar):
    body, newtons = bar
    solver = FastEquilibrium(body, 0, 2)
    found = where_singular(solver, body.fine.size, lambda share: solver.solve(axial(body, share * newtons), 1e-8).x)
    assert found == pytest.approx(1.0, rel=0.03)


def test_a_column_is_linearised_to_buckle_at_eulers_load(bar, soft):
    """The cylinder has flat sides, and bends as one of its own area does."""
    body, newtons = bar
    found = Buckling(body, 0.01).share([(nearest(body, MIDDLE), np.array([-newtons, 0.0, 0.0]))])
    assert 1.0 / found == pytest.approx(1.0, abs=0.03)
    mesh = cylinder(0.2, 0.02)
    column = nest("column", mesh, 1, np.flatnonzero(mesh.nodes[:, 2] < 1e-9), soft)
    area = column.fine.volumes.sum() / 0.2
    newtons = euler(0.2, area**2 / (4.0 * np.pi))
    found = Buckling(column, 0.01).share([(nearest(column, [0.0, 0.0, 0.2]), np.array([0.0, 0.0, -newtons]))])
    assert 1.0 / found == pytest.approx(1.0, abs=0.03)


def test_what_bends_or_stretches_a_column_does_not_make_it_buckle(bar):
    body, newtons = bar
    middle, buckling = nearest(body, MIDDLE), Buckling(body, 0.01)
    assert buckling.share([(middle, np.array([newtons, 0.0, 0.0]))]) < 0.05
    assert buckling.share([(middle, np.array([0.0, 0.2 * newtons, 0.0]))]) < 0.1
    both = [(middle, np.array([-0.3 * newtons, 0.0, 0.0])), (middle, np.array([-0.4 * newtons, 0.0, 0.0]))]
    assert buckling.share(both) == pytest.approx(0.7, rel=0.05)


def test_the_side_that_a_body_gives_way_to_is_no_answer(bar):
    body, newtons = bar
    solver = Unbuckled(body, 0, 2)
    x = solver.solve(axial(body, 0.9 * newtons), 1e-6).x
    solver.check_stable(x)
    with pytest.raises(NotConverged, match="buckles"):
        solver.check_stable(body.fine.nodes + 1.2 / 0.9 * (x - body.fine.nodes))


@pytest.fixture(scope="module")
def slender(soft):
    """A column of 0.4 m by 0.02 m by 0.03 m, held at x = 0; the mean displacement of its end; its buckling depth [m].

    The end is held from the side and may turn: tan kL = kL. Shear lets it buckle earlier, by 1 % (Engesser 1889).
    """
    mesh = box([0.4, 0.02, 0.03], [16, 2, 2])
    body = nest("slender", mesh, 1, np.flatnonzero(mesh.nodes[:, 0] == 0.0), soft)
    strain = 4.4934**2 * 0.02**2 / 12.0 / 0.4**2
    shear = 2.0 * (1.0 + soft.poisson) / (5.0 / 6.0)
    return body, sparse.csr_array(end_face(body.fine)[None]), 0.4 * strain / (1.0 + shear * strain)


def pushed_in(problem, weights, depth, tolerance=1e-6):
    """Positions (n, 3) [m] with the column's end pushed in by a depth [m], and the force (3,) [N] on it."""
    way = np.array([[-depth, 0.0, 0.0]])
    solution, force = push(problem, np.zeros_like(problem.mesh.nodes), weights, way, tolerance)
    assert np.abs(weights @ (solution.x - problem.mesh.nodes) - way).max() < 1e-12
    return solution.x, force[0]


def test_a_column_that_is_pushed_buckles_as_one_whose_end_is_pinned(slender):
    body, weights, depth = slender
    problem = FastEquilibrium(body, 0, 2)

    def straight(share):
        x, _ = pushed_in(problem, weights, share * depth, 1e-8)
        assert bent(body, x) < 1e-3
        return x

    assert where_singular(Pushed(problem, weights), body.fine.size, straight) == pytest.approx(1.0, abs=0.03)
