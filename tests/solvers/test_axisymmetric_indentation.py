"""A ball on a slab has the force of theory where strains are small, of its energy, and of finer meshes."""

import numpy as np
import pytest
from fixtures.indented_layer import force_at, sphere

from palpate.errors import InputError, NotConverged
from palpate.solvers import axisymmetric_indentation
from palpate.solvers.axisymmetric_indentation import BallOnSlab, hertz


@pytest.mark.parametrize("sticks", [False, True])
@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.49])
def test_a_small_press_of_a_half_space_is_that_of_hertz_and_of_spence(monkeypatch, poisson, sticks):
    """At 0.01 % of the radius; measured 0.1 % and less, with sticking at ν = 0.3 by 0.1 %."""
    monkeypatch.setattr(axisymmetric_indentation, "START", 0.01)
    curve = BallOnSlab("neo_hookean", poisson, np.inf, sticks).curve(1.2e-4)
    assert curve.force[0] / curve.depth[0] ** 1.5 == pytest.approx(hertz(poisson, sticks), rel=3e-3)


@pytest.mark.parametrize("poisson", [0.3, 0.45])
def test_a_small_press_of_a_layer_is_that_of_the_integral_equation(monkeypatch, poisson):
    """Half as thick as the ball: Hertz is 15 % off at a depth of 0.3 % of the thickness."""
    monkeypatch.setattr(axisymmetric_indentation, "START", 0.08)
    curve = BallOnSlab("neo_hookean", poisson, 0.5).curve(0.002)
    expected = force_at(sphere(1.0), curve.depth[0], 1.0, poisson, 0.5, most=0.5)
    assert curve.force[0] == pytest.approx(expected, rel=6e-3)
    assert expected > 1.05 * hertz(poisson) * curve.depth[0] ** 1.5


def test_force_is_the_derivative_of_the_energy():
    """By central differences over a part of the depth: virtual work at finite strains."""
    energies, forces = [], []
    for depth in (0.498, 0.5, 0.502):
        ball = BallOnSlab("neo_hookean", 0.45, 2.0)
        while ball._depth != depth:
            ball._x, ball._depth = ball.section.nodes.copy(), 0.0
            count = 34
            touching, _ = ball._surface(count)
            for each in np.linspace(0.05, 1.0, 12) * depth:
                ball._solve(touching[: 2 * int(6 + 11 * each / depth)], None, float(each))
        energies.append(ball.elements.energy_and_force(ball._x)[0])
        forces.append(ball._force)
    assert (energies[2] - energies[0]) / 0.004 == pytest.approx(forces[1], rel=1e-4)


@pytest.mark.parametrize("law", ["neo_hookean", "stable_neo_hookean", "exponential(4)"])
@pytest.mark.parametrize("sticks", [False, True])
def test_a_finer_mesh_has_the_same_force(law, sticks):
    """To 0.75 radii into a slab of 2.5; measured 0.05 %, with sticking 0.2 %."""
    depth = np.array([0.1, 0.3, 0.5, 0.75])
    usual = BallOnSlab(law, 0.45, 2.5, sticks).curve(0.75).at(depth)
    fine = BallOnSlab(law, 0.45, 2.5, sticks, ratio=1.12, angles=12).curve(0.75).at(depth)
    assert np.abs(usual / fine - 1.0).max() < (4e-3 if sticks else 1.5e-3)


def test_a_press_that_no_law_bears_is_refused():
    with pytest.raises(NotConverged, match="equilibrium"):
        BallOnSlab("st_venant_kirchhoff", 0.3, 2.0).curve(0.9)
    with pytest.raises(InputError, match="thickness"):
        BallOnSlab("neo_hookean", 0.3, 0.5).curve(0.6)
