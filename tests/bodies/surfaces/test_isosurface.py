"""Isosurfaces and their normals from grey values, against numpy's differences and a ball."""

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from palpate.bodies.surfaces.mask_surface import isosurface

ORIGIN, SPACING = np.array([0.1, -0.2, 0.3]), np.array([0.001, 0.002, 0.003])


@pytest.fixture(scope="module")
def hill() -> np.ndarray:
    """A smooth hill of grey values, (nz, ny, nx), with some noise."""
    z, y, x = np.meshgrid(np.linspace(-1, 1, 21), np.linspace(-1, 1, 25), np.linspace(-1, 1, 29), indexing="ij")
    noise = np.random.default_rng(0).normal(0, 0.02, x.shape)
    return (np.exp(-2 * (x**2 + y**2 + z**2)) + noise).astype(np.float32)


def test_points_lie_where_lines_between_voxels_cross_the_level(hill):
    points, triangles, none = isosurface(hill, 0.5, ORIGIN, SPACING)
    index = ((points - ORIGIN) / SPACING)[:, ::-1]
    assert map_coordinates(hill.astype(float), index.T, order=1) == pytest.approx(0.5, abs=1e-4)
    assert triangles.max() < len(points) and none.shape == (0, 3)


def test_normals_are_central_differences_of_the_grey_values(hill):
    points, _, normals = isosurface(hill, 0.5, ORIGIN, SPACING, normals=True)
    slopes = np.gradient(hill.astype(float), *SPACING[::-1])[::-1]
    index = ((points - ORIGIN) / SPACING)[:, ::-1]
    downhill = -np.column_stack([map_coordinates(slope, index.T, order=1) for slope in slopes])
    downhill /= np.linalg.norm(downhill, axis=1, keepdims=True)
    assert np.linalg.norm(normals, axis=1) == pytest.approx(1)
    assert (normals * downhill).sum(axis=1).min() > np.cos(np.radians(2))


def test_nothing_above_the_level_is_no_surface(hill):
    assert [len(part) for part in isosurface(hill, 5.0, ORIGIN, SPACING, normals=True)] == [0, 0, 0]
