"""The network, its masses, and points that move with it."""

import numpy as np
import pytest

from palpate.effects.springs import volume_springs
from palpate.errors import InputError
from palpate.models.springs.spring_motion import Press, key_points


def test_masses_and_weights_are_the_bodys(cube):
    assert cube.model.masses.sum() == pytest.approx(1000.0 * 1e-6, rel=1e-12)
    pairs, stiffness = volume_springs(cube.particles)
    assert np.array_equal(cube.model.pairs, pairs)
    assert 1000.0 * cube.model.weights == pytest.approx(stiffness, rel=1e-13)


def test_swelling_springs_have_the_bulk_modulus_of_a_quarter(cube):
    """Σ k l² = 9 V (2E/3): eq. 5 is isotropic elasticity at ν = 1/4, averaged over directions."""
    total = (cube.model.weights * cube.model.rest_m**2).sum()
    assert total == pytest.approx(9.0 * 1e-6 * 2.0 / 3.0, rel=1e-12)


def test_key_points_follow_an_affine_motion(cube):
    gradient, shift = np.array([[1.1, 0.2, 0], [0, 0.9, 0.1], [0.3, 0, 1]]), np.array([1.0, 2, 3])
    moved = np.stack([cube.model.nodes, cube.model.nodes @ gradient.T + shift])
    points = cube.settings.keys.of(moved)
    assert points.shape == (2, 4, 3)
    assert points[0] == pytest.approx(np.array([[5, 5, 10], [0, 0, 10], [10, 3, 6], [5, 4, 5]]) * 1e-3, abs=1e-15)
    assert points[1] == pytest.approx(points[0] @ gradient.T + shift, rel=1e-12)


@pytest.mark.parametrize("point", [[0.005, 0.005, 0.0101], [-1, 0, 0], [np.nan, 0.001, 0.001]])
def test_a_point_outside_gets_one_sentence(cube, point):
    with pytest.raises(InputError, match=r"^keys\[1\] is \[.*\], which is outside the mesh; give .*\.$") as caught:
        key_points(cube.mesh.nodes, cube.mesh.tetrahedra, [[0.001, 0.001, 0.001], point], "keys")
    assert "\n" not in str(caught.value)


def test_no_points_get_one_sentence(cube):
    with pytest.raises(InputError, match="keys is empty"):
        key_points(cube.mesh.nodes, cube.mesh.tetrahedra, [], "keys")


def test_a_press_rises_without_a_kink():
    factors = Press("top", 0, np.zeros(3), 0.01).factors(0.001, 20)
    assert factors[[4, 9, 19]] == pytest.approx([0.5, 1.0, 1.0])
    assert (np.diff(factors) >= 0.0).all()
