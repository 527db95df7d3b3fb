"""Which pairs of nodes are springs, and how stiff those of a solid are."""

import numpy as np
import pytest

from palpate.bodies.body import nest
from palpate.bodies.material import Material
from palpate.bodies.particles import particles_of
from palpate.effects.springs import rest_lengths, surface_springs, volume_springs


def grid(n):
    """Triangles of an n × n grid of nodes, two a square, all diagonals alike."""
    corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()[:, None]
    return np.concatenate([corner + np.array(cut) for cut in ([0, n, n + 1], [0, n + 1, 1])])


def test_every_edge_of_a_solid_is_one_spring(slab):
    pairs, stiffness = volume_springs(particles_of(slab, 0, False))
    assert np.array_equal(pairs, slab.coarse.edges)
    assert (stiffness > 0).all()


def test_stiffness_is_paper_2_eq_5(box, soft):
    """And Σ k l² = 6 E V, which is 9λ + 6μ = 3λ + 12μ of the isotropic material with E and the Poisson ratio 1/4."""
    body = nest("cube", box([3, 3, 3], [0.1, 0.1, 0.1], jitter=0.2), 0, np.array([0]), soft)
    particles = particles_of(body, 0, False)
    pairs, stiffness = volume_springs(particles)
    lengths = rest_lengths(particles.nodes, pairs)
    quarter = Material(soft.young_pa, 0.25, soft.density_kg_m3)
    assert np.sum(stiffness * lengths**2) == pytest.approx(6 * soft.young_pa * 1e-3, rel=1e-12)
    assert 9 * quarter.lame_pa + 6 * quarter.shear_pa == pytest.approx(6 * soft.young_pa, rel=1e-12)
    assert 3 * quarter.lame_pa + 12 * quarter.shear_pa == pytest.approx(6 * soft.young_pa, rel=1e-12)
    around = [(np.isin(body.coarse.tetrahedra, pair).sum(axis=1) == 2) @ body.coarse.volumes for pair in pairs]
    assert stiffness == pytest.approx(soft.young_pa * np.array(around) / lengths**2, rel=1e-12)


def test_springs_of_a_grid_are_those_of_cloth():
    """Around an inner node of a regular grid: 6 neighbours, 6 across an edge, 6 straight ahead."""
    kinds = surface_springs(grid(7), 49)
    middle = 3 * 7 + 3
    found = {}
    for kind, pairs in kinds.items():
        others = pairs[(pairs == middle).any(axis=1)].sum(axis=1) - middle
        rows, columns = np.divmod(others, 7)
        found[kind] = {(int(r) - 3, int(c) - 3) for r, c in zip(rows, columns, strict=True)}
    assert found["structural"] == {(0, 1), (1, 0), (1, 1), (0, -1), (-1, 0), (-1, -1)}
    assert found["shear"] == {(1, -1), (1, 2), (2, 1), (-1, 1), (-1, -2), (-2, -1)}
    assert found["bending"] == {(2 * r, 2 * c) for r, c in found["structural"]}


def test_no_pair_is_a_spring_twice(slab):
    particles = particles_of(slab, 0, True)
    pairs = np.concatenate(list(surface_springs(particles.triangles, len(particles.nodes)).values()))
    assert len(np.unique(pairs, axis=0)) == len(pairs)
    assert (pairs[:, 0] < pairs[:, 1]).all()


def test_a_closed_tetrahedron_has_its_six_edges_only():
    kinds = surface_springs(np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]]), 4)
    assert [len(pairs) for pairs in kinds.values()] == [6, 0, 0]
