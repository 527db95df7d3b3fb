"""Quadratic elements against the theory of beams: deflection, frequency, frequency with a mass at the tip."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from palpate.studies.measured.predict import natural_frequency
from palpate.studies.measured.settings import Load
from palpate.studies.measured.specimen import Bench, Carried, FemSpecimen, SpringSpecimen, mass_matrix, rest_of

LENGTH, SIDE, YOUNG, DENSITY = 0.2, 0.01, 1e6, 1000.0
BENDING, AREA = YOUNG * SIDE**4 / 12, SIDE**2
DOWN = np.array([0.0, 0.0, -1.0])
TIP = [LENGTH, SIDE / 2, SIDE / 2]
EDGE = [[LENGTH, 0.0, SIDE], [LENGTH, SIDE, SIDE]]


@pytest.fixture(scope="module")
def bench(bar):
    return Bench(FemSpecimen(bar, 0, 2), [TIP])


def test_an_end_load_bends_it_as_timoshenko_says(bench):
    force = 1e-5  # so small that nothing is nonlinear
    pull = Load(force_n=(force * DOWN).tolist(), line_m=EDGE)
    load = bench.load([pull], DOWN) - bench.load([], DOWN)
    assert load.sum(axis=0) == pytest.approx(force * DOWN, abs=1e-12 * force)
    sunk = -bench.moves(bench.specimen.settle(load, None))[0, 2]
    shear = YOUNG / 2
    assert sunk == pytest.approx(force * (LENGTH**3 / (3 * BENDING) + LENGTH / (5 / 6 * shear * AREA)), rel=2e-3)


def test_its_weight_bends_it_as_timoshenko_says(bench):
    load = 1e-4 * bench.load([], DOWN)
    line = 1e-4 * 9.81 * DENSITY * AREA
    sunk = -bench.moves(bench.specimen.settle(load, None))[0, 2]
    expected = line * (LENGTH**4 / (8 * BENDING) + LENGTH**2 / (2 * 5 / 6 * YOUNG / 2 * AREA))
    assert sunk == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize("hung", [0.0, 0.05])
def test_it_swings_as_beams_do(bench, hung):
    """Euler and Bernoulli's frequency; with a mass at the tip that of Rayleigh, whose shape is right to 0.1 %."""
    loads = [Load(weight_n=9.81 * hung, line_m=EDGE)] if hung else []
    masses = bench.masses(loads)
    assert masses.sum() == pytest.approx(DENSITY * AREA * LENGTH + hung)
    x = bench.specimen.settle(1e-5 * bench.load(loads, DOWN), None)
    hz, shape = natural_frequency(bench.specimen, x, masses)
    line = np.sqrt(BENDING / (DENSITY * AREA * LENGTH**4)) * 1.8751041**2
    tip = np.sqrt(3 * BENDING / LENGTH**3 / (hung + 33 / 140 * DENSITY * AREA * LENGTH))
    assert hz == pytest.approx((tip if hung else line) / (2 * np.pi), rel=6e-3)  # shear and rotation lower it by 0.4 %
    assert np.abs(shape[:, 1]).max() < 1e-2 * np.abs(shape[:, 2]).max()  # upright, and not across
    assert natural_frequency(bench.specimen, x, masses, stiffer=4.0)[0] == pytest.approx(2 * hz)


def test_springs_settle_where_their_forces_vanish(bar):
    springs = Bench(SpringSpecimen(bar, 0), [TIP])
    load = 1e-4 * springs.load([], DOWN)
    x = springs.specimen.settle(load, None)
    assert np.linalg.norm(springs.specimen.force(x)) <= 1e-5 * np.linalg.norm(load)
    assert springs.moves(x)[0, 2] < 0.0


PLACES = np.array([[0.2, 0.005, 0.016], [0.1, -0.006, 0.004], [0.15, 0.005, 0.01]])
"""Beyond the tip's upper edge, beside the bar, and on its top."""


@pytest.mark.parametrize("order", [1, 2])
def test_a_rigid_motion_carries_them_along(bar, order):
    turn, shift = Rotation.from_euler("xyz", [0.3, -1.2, 2.0]).as_matrix(), np.array([0.1, -0.2, 0.3])
    rest = rest_of(bar.coarse, order)
    carried = Carried(bar.coarse, PLACES, order)
    assert carried.of(rest) == pytest.approx(PLACES, abs=1e-15)
    assert carried.of(rest @ turn.T + shift) == pytest.approx(PLACES @ turn.T + shift, abs=1e-14)


def test_a_bent_surface_turns_them(bar):
    """On a bar bent to a circle a marker keeps its height, along the radius."""
    rest, radius = rest_of(bar.coarse, 2), 0.3
    angle, height = rest[:, 0] / radius, rest[:, 2] - 0.005
    bent = np.column_stack([(radius - height) * np.sin(angle), rest[:, 1], radius - (radius - height) * np.cos(angle)])
    place = np.array([0.1, 0.005, 0.016])
    found = Carried(bar.coarse, place[None], 2).of(bent)[0]
    turned, above = 0.1 / radius, radius - (0.016 - 0.005)
    expected = [above * np.sin(turned), 0.005, radius - above * np.cos(turned)]
    assert found == pytest.approx(expected, abs=3e-5)
    along = found[0] - 0.1
    nearest = (radius - 0.005) * np.sin(turned) - 0.1
    assert along < nearest - 0.0015  # the displacement of the surface alone misses this


@pytest.mark.parametrize("order", [1, 2])
def test_products_of_polynomials_are_exact(box, order):
    mesh = box((2, 3, 2), (1.0, 2.0, 0.5), jitter=0.2)
    x = rest_of(mesh, order)
    masses = mass_matrix(mesh, np.full(len(mesh.tetrahedra), 3.0), order)
    assert masses.sum() == pytest.approx(3.0)  # a volume of 1
    f, g = x[:, 0] ** order, (x[:, 1] * x[:, 2] if order == 2 else x[:, 1])
    # ∫ x^k over (0, 1), ∫ y over (0, 2), ∫ z over (0, 0.5)
    across = 2.0 * 0.125 if order == 2 else 2.0 * 0.5
    assert f @ masses @ g == pytest.approx(3.0 * across / (order + 1))


def test_densities_are_those_of_the_elements(box):
    mesh = box((2, 1, 1), (1.0, 1.0, 1.0))
    right = mesh.nodes[mesh.tetrahedra].mean(axis=1)[:, 0] > 0.5
    assert mass_matrix(mesh, np.where(right, 5.0, 1.0), 2).sum() == pytest.approx(3.0)
