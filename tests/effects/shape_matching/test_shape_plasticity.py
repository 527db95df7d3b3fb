"""Clusters that keep a dent."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.bodies.particles import particles_of
from palpate.effects import shape_matching
from palpate.effects.shape_plasticity import ShapePlasticity
from palpate.errors import InputError

CLAY = {"yield_strain": 0.05, "creep_1_s": 5.0, "max_strain": 0.5}


@pytest.fixture(scope="module")
def particles(slab):
    return particles_of(slab, 0, surface=False)


def clay(particles, clusters=None, **change):
    settings = {"mode": "quadratic", "alpha": 0.5, "beta": 0.0, "clusters": clusters or {"kind": "one"}}
    matched = shape_matching.make(particles, settings)
    return matched, ShapePlasticity(particles, CLAY | change, matched)


def shape_of(matched, x):
    """Sides of the goals' bounding box."""
    out = np.empty_like(x)
    matched.goals(x, out)
    return np.ptp(out, axis=0)


def test_nothing_flows_below_the_yield_strain(particles, rotation):
    matched, plasticity = clay(particles)
    frames = matched.frames.copy()
    for stretch in ([1.0, 1.0, 1.0], [1.049, 1.0, 0.951]):
        plasticity.relax(particles.nodes * stretch @ rotation(1.0).T, 10.0)
        assert np.array_equal(plasticity.plastic[0], np.eye(3))
    assert np.array_equal(matched.frames, frames)


def test_a_turned_body_creeps_as_an_unturned_one(particles, rotation):
    x = particles.nodes * [1.3, 1.0, 0.9]
    plastics = []
    for angle in (0.0, 1.0, 3.0):
        _, plasticity = clay(particles)
        plasticity.relax(x @ rotation(angle).T, 0.05)
        plastics.append(plasticity.plastic[0])
    assert np.abs(plastics[0] - np.eye(3)).max() > 0.01
    assert np.abs(np.diff(plastics, axis=0)).max() < 1e-12


def test_the_rest_shape_reaches_a_shape_of_the_same_volume(particles):
    """However long the steps: what is left of the strain is below the yield strain."""
    stretch = np.array([1.25, 1.0, 0.8])
    for h in (1e-3, 0.1, 100.0):
        matched, plasticity = clay(particles)
        for _ in range(max(20, int(2.0 / h))):
            plasticity.relax(particles.nodes * stretch, h)
        left = stretch * np.ptp(particles.nodes, axis=0) / shape_of(matched, particles.nodes * stretch)
        assert np.abs(left - 1.0).max() < 0.06
        assert np.linalg.det(plasticity.plastic[0]) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("kind", [{"kind": "one"}, {"kind": "tetrahedra"}])
def test_strain_and_volume_stay_within_their_bounds_whatever_happens(particles, kind):
    random = np.random.default_rng(0)
    matched, plasticity = clay(particles, kind)
    for factor in ([9, 1, 1], [1, 1, 0], [0, 0, 0], [-1, 1, 1], [0.1, 0.1, 0.1], [3, 3, 0.1]):
        for _ in range(5):
            x = particles.nodes * np.array(factor, dtype=float) + 0.05 * random.normal(size=particles.nodes.shape)
            plasticity.relax(x, 0.1)
            assert np.linalg.norm(plasticity.plastic - np.eye(3), 2, axis=(1, 2)).max() <= 0.5 * (1 + 1e-8)
            assert np.abs(np.linalg.det(plasticity.plastic) - 1.0).max() < 1e-12
    assert np.isfinite(matched.frames).all()


def test_a_sheet_creeps_in_its_plane_only(particles, rotation):
    sheet = replace(particles, nodes=particles.nodes * [1.0, 1.0, 0.0] @ rotation(0.5).T)
    normal = rotation(0.5)[:, 2]
    _, plasticity = clay(sheet)
    x = particles.nodes * [1.2, 1.0, 0.0]
    plasticity.relax(x, 0.1)
    assert np.linalg.norm(plasticity.plastic[0] - np.eye(3)) > 0.02
    assert np.abs(plasticity.plastic[0] @ normal - normal).max() < 1e-12
    plasticity.relax(x * [1, 0, 0], 0.1)
    plasticity.relax(x * 0.0, 0.1)
    assert np.abs(plasticity.plastic[0] @ normal - normal).max() < 1e-12


@pytest.mark.parametrize("change", [{"yield_strain": -1.0}, {"creep_1_s": np.nan}, {"max_strain": 1.0}])
def test_settings_out_of_range_are_refused(particles, change):
    with pytest.raises(InputError, match=next(iter(change))):
        clay(particles, **change)
