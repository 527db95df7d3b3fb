"""A ball on a slab has the force of theory where strains are small, of its energy, and of finer meshes."""

import numpy as np
import pytest
from fixtures.indented_layer import force_at, sphere

from palpate.errors import InputError, NotConverged
from palpate.identification import axisymmetric_indentation
from palpate.identification.axisymmetric_indentation import BallOnSlab, hertz


@pytest.mark.parametrize("sticks", [False, True])
@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.49])
def test_a_small_press_of_a_half_space_is_that_of_hertz_and_of_spence(monkeypatch, poisson, sticks):
    """At 0.04 % of the radius, where finite strains are 0.2 to 0.5 % of the force."""
    monkeypatch.setattr(axisymmetric_indentation, "START", 0.02)
    curve = BallOnSlab("neo_hookean", poisson, np.inf, sticks, far=100.0).curve(4e-4)
    assert curve.force[0] / curve.depth[0] ** 1.5 == pytest.approx(hertz(poisson, sticks), rel=7e-3)


@pytest.mark.parametrize("poisson", [0.3, 0.45])
def test_a_small_press_of_a_layer_is_that_of_the_integral_equation(monkeypatch, poisson):
    """A layer half as thick as the ball, pressed by 0.3 % of its thickness."""
    monkeypatch.setattr(axisymmetric_indentation, "START", 0.08)
    curve = BallOnSlab("neo_hookean", poisson, 0.5).curve(0.002)
    expected = force_at(sphere(1.0), curve.depth[0], 1.0, poisson, 0.5, most=0.5)
    assert curve.force[0] == pytest.approx(expected, rel=6e-3)
    assert expected > 1.05 * hertz(poisson) * curve.depth[0] ** 1.5


def test_the_energy_is_the_work_of_the_force():
    """Half a radius into a slab of two, without friction."""
    ball = BallOnSlab("neo_hookean", 0.45, 2.0)
    curve = ball.curve(0.5)
    depth = np.linspace(0.0, curve.depth[-1], 2001)
    energy = ball.elements.linearise(ball._x)[0]
    assert energy == pytest.approx(np.trapezoid(curve.at(depth), depth), rel=2e-3)


@pytest.mark.parametrize(
    "law",
    [
        "neo_hookean",
        pytest.param("stable_neo_hookean", marks=pytest.mark.slow),
        pytest.param("exponential(4)", marks=pytest.mark.slow),
    ],
)
@pytest.mark.parametrize("sticks", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_a_finer_mesh_has_the_same_force(law, sticks):
    """To 0.75 radii into a slab of 2.5."""
    depth = np.array([0.1, 0.3, 0.5, 0.75])
    usual = BallOnSlab(law, 0.45, 2.5, sticks).curve(0.75).at(depth)
    fine = BallOnSlab(law, 0.45, 2.5, sticks, ratio=1.12, angles=12).curve(0.75).at(depth)
    assert np.abs(usual / fine - 1.0).max() < (4e-3 if sticks else 1.5e-3)


def test_a_press_that_no_law_bears_is_refused():
    with pytest.raises(NotConverged, match="equilibrium"):
        BallOnSlab("st_venant_kirchhoff", 0.3, 2.0).curve(0.9)
    with pytest.raises(InputError, match="thickness"):
        BallOnSlab("neo_hookean", 0.3, 0.5).curve(0.6)
