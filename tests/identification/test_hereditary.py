"""Forces over time by closed solutions, quadrature, and the effect that scenes relax by."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import dawsn

from palpate.bodies.body import nest
from palpate.bodies.material import Material, Series
from palpate.bodies.particles import particles_of
from palpate.effects import prony
from palpate.effects.linear_elements import LinearElements
from palpate.effects.settings import Prony
from palpate.identification.hereditary import Branches, Fading, shear_series

SERIES = Series([0.5, 0.2], [0.4, 5.0])


def test_a_sphere_that_is_pressed_evenly_follows_lee_and_radok():
    speed, times = 1e-3, np.linspace(0.0, 4.0, 4001)
    force = Branches(SERIES).respond(times, (speed * times[:, None]) ** 1.5)[:, 0]
    t = times[1:]
    exact = (1.0 - sum(SERIES.shares)) * t**1.5
    for share, tau in zip(SERIES.shares, SERIES.times_s, strict=True):
        exact += 1.5 * share * (tau * np.sqrt(t) - tau**1.5 * dawsn(np.sqrt(t / tau)))
    assert force[1:] == pytest.approx(speed**1.5 * exact, rel=1e-4)


@pytest.mark.parametrize("kernel", [Branches(SERIES), Fading(0.3, 0.05)])
def test_what_changes_evenly_between_uneven_times_is_exact(kernel):
    times, loads = np.array([0.0, 0.1, 0.5, 0.6, 2.0, 7.0]), np.array([0.3, 0.4, 2.0, 2.5, 2.5, 1.0])
    found = kernel.respond(times, np.column_stack([loads, -loads]))
    whole = kernel.modulus(0.0)
    for k, t in enumerate(times):
        exact = loads[0] * kernel.modulus(t)
        for a, b, slope in zip(times[:k], times[1 : k + 1], np.diff(loads) / np.diff(times), strict=False):
            exact += slope * quad(lambda s, t=t: float(kernel.modulus(t - s)), a, b, epsabs=1e-12)[0]
        assert found[k] == pytest.approx([exact / whole, -exact / whole], rel=1e-7)
    assert whole == pytest.approx(1.0)


def test_even_steps_are_no_special_case():
    times, loads = np.arange(30) * 0.1, np.random.default_rng(1).normal(size=(30, 3))
    shaken = times + np.append(np.zeros(29), 1e-7)
    even, uneven = (Branches(SERIES).respond(t, loads) for t in (times, shaken))
    assert np.allclose(even, uneven, atol=1e-6)


@pytest.mark.parametrize("poisson", [0.3, 0.45, 0.495])
def test_the_shear_series_of_the_effect_gives_the_force_of_a_press(poisson, box):
    """Under plane strain between free sides a block has the modulus E/(1 − ν²), as a press has."""
    shear, material, steps = shear_series(SERIES, poisson), Material(1.0, poisson, 1.0), 300
    block = particles_of(nest("block", box([1, 1, 1], [1.0, 1.0, 1.0]), 0, np.empty(0, int), material), 0, False)
    elastic = LinearElements(block, material)
    branches = prony.make(block, Prony(shares=shear.shares, times_s=shear.times_s), elastic)
    rest, strain, step, found = block.nodes, 1e-4, 0.01, []

    def forces(side: float) -> tuple[float, float]:
        """Those at the sides and at the top, of a block that is wider by ``side``."""
        force = np.zeros_like(rest)
        for effect in (elastic, branches):
            effect.evaluate(rest * np.array([1.0 + side, 1.0, 1.0 + strain]), force)
        return force[rest[:, 0] > 0.5, 0].sum(), -force[rest[:, 2] > 0.5, 2].sum()

    branches.begin(rest, step)
    for _ in range(steps):
        one, other = forces(0.0)[0], forces(-strain)[0]
        side = -strain * one / (one - other)  # no force at the sides
        found.append(forces(side)[1] / strain)
        branches.end(rest * np.array([1.0 + side, 1.0, 1.0 + strain]))
        branches.begin(rest, step)
    times = step * np.arange(steps + 1)
    wanted = Branches(SERIES).respond(times, np.append(0.0, np.ones(steps))[:, None])[1:, 0]
    assert np.array(found) == pytest.approx(wanted / (1.0 - sum(SERIES.shares)) / (1.0 - poisson**2), rel=0.01)
