"""Families of curves meet the curves between their nodes, and a slab's forward model gives them."""

import numpy as np
import pytest

from palpate.errors import InputError
from palpate.identification import curves
from palpate.identification.axisymmetric_indentation import BallOnSlab, hertz
from palpate.identification.curves import Ranges, family_of
from palpate.identification.forward import Parameter, SlabForward


def test_the_sparse_grid_reproduces_what_its_polynomials_can():
    rng = np.random.default_rng(0)
    for dimensions, level, whole in ((1, 2, 2), (2, 3, 3), (3, 2, 6)):
        places, degrees = curves._sparse_grid(dimensions, level, whole)
        assert len(places) == len(degrees) == len(np.unique(places, axis=0)) == len(np.unique(degrees, axis=0))
        weights, at = rng.standard_normal(len(degrees)), rng.uniform(-1.0, 1.0, (5, dimensions))
        found = np.linalg.solve(curves._basis(places, degrees), curves._basis(places, degrees) @ weights)
        assert curves._basis(at, degrees) @ found == pytest.approx(curves._basis(at, degrees) @ weights)


@pytest.mark.slow
def test_a_family_meets_curves_between_its_nodes_and_is_kept(tmp_path, monkeypatch):
    ranges = Ranges(0.5, (0.35, 0.49))
    family = family_of("neo_hookean", ranges, tmp_path)
    depth = np.array([-1.0, 0.0, 0.01, 0.1, 0.5])
    forces = family.forces(depth, 0.41)
    assert family.error < 2e-3 and (forces[:2] == 0.0).all() and (np.diff(forces[1:]) > 0.0).all()
    exact = BallOnSlab("neo_hookean", 0.41).curve(0.5).at(depth[2:])
    assert forces[2:] == pytest.approx(exact, rel=2e-3)
    assert forces[2] == pytest.approx(hertz(0.41) * 0.01**1.5, rel=0.02)
    monkeypatch.setattr(curves, "_computed", None)
    assert family_of("neo_hookean", ranges, tmp_path).forces(depth, 0.41) == pytest.approx(forces, rel=1e-14)


def test_a_slab_scales_with_its_ball():
    kept = {"law": "neo_hookean", "poisson": (0.45, 0.45), "sticking": (0.0, 1.0)}
    small = SlabForward(0.004, 0.001, thickness_m=(0.01, 0.01), **kept)
    assert small.parameters == (Parameter("sticking", 0.0, 1.0),)
    depth = np.array([0.0002, 0.001])
    slips, between, sticks = (small.forces(0, depth, {"sticking": each}) for each in (0.0, 0.5, 1.0))
    assert between == pytest.approx(np.sqrt(slips * sticks)) and 1.0 < sticks[1] / slips[1] < 1.05
    expected = BallOnSlab("neo_hookean", 0.45, 2.5).curve(0.25).at(depth / 0.004) * 0.004**2
    assert slips == pytest.approx(expected, rel=1e-3)
    with pytest.raises(InputError, match="depth"):
        small.forces(0, np.array([0.002]), {"sticking": 0.0})
    with pytest.raises(InputError, match="sticking"):
        small.forces(0, depth, {"sticking": 1.1})


def test_ranges_that_are_none_are_refused():
    for wrong in ({"poisson": (0.3, 0.5)}, {"thinness": (0.2, 3.0)}, {"stiffening": (2.0, 1.0)}):
        with pytest.raises(InputError, match="give"):
            Ranges(0.5, **{"poisson": (0.3, 0.4), **wrong})
    with pytest.raises(InputError, match="stiffening"):
        family_of("neo_hookean", Ranges(0.5, (0.3, 0.4), stiffening=(0.0, 2.0)))
