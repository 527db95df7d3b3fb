"""Surfaces of masks and isosurfaces: volume, node count, manifold, normals."""

import numpy as np
import pytest
from fixtures.scans import drawn_shape
from scipy.ndimage import map_coordinates

from palpate.bodies.mesh_quality import check_closed
from palpate.bodies.surfaces.mask_surface import dense_surface, isosurface, surface
from palpate.bodies.surfaces.triangles import volume
from palpate.errors import InputError


def masked(inside, spacing=(0.002, 0.002, 0.002)):
    share, image = drawn_shape(inside, spacing)
    return share >= 0.5, image


def ellipsoid(x, y, z):
    return (x / 0.05) ** 2 + (y / 0.03) ** 2 + (z / 0.04) ** 2 < 1


def away(points):
    """How far points are from the ellipsoid, in units of half an axis."""
    return np.abs(np.linalg.norm(points / [0.05, 0.03, 0.04], axis=1) - 1).max()


def ring(x, y, z):
    return (np.hypot(x, y) - 0.035) ** 2 + z**2 < 0.014**2


@pytest.mark.parametrize("spacing", [(0.002, 0.002, 0.002), (0.0008, 0.0008, 0.008)], ids=["even", "ten to one"])
def test_the_dense_surface_is_that_of_the_ellipsoid(spacing):
    mask, image = masked(ellipsoid, spacing)
    points, triangles = dense_surface(mask, image)
    check_closed("surface", points, triangles)
    assert volume(points, triangles) == pytest.approx(mask.sum() * image.voxel_m3, rel=2e-4)
    # a mask resolves no more than half of the coarsest spacing
    assert away(points) < 0.5 * max(spacing) / 0.03


@pytest.mark.parametrize("nodes", [60, 140])
@pytest.mark.parametrize(("inside", "handles"), [(ellipsoid, 0), (ring, 1)], ids=["ellipsoid", "ring"])
def test_a_wanted_number_of_nodes_with_the_volume_of_the_mask(inside, handles, nodes):
    mask, image = masked(inside)
    points, triangles = surface(mask, image, nodes)
    check_closed("surface", points, triangles)
    assert len(points) == nodes
    assert len(triangles) == 2 * nodes - 4 + 4 * handles
    assert volume(points, triangles) == pytest.approx(mask.sum() * image.voxel_m3, rel=1e-9)
    lengths = np.linalg.norm(points[triangles] - points[np.roll(triangles, 1, axis=1)], axis=2)
    assert lengths.min() > 0.3 * lengths.mean()
    assert lengths.max() < 2 * lengths.mean()


def test_a_cut_organ_ends_in_a_flat_face():
    mask, image = masked(lambda x, y, z: ellipsoid(x, y, z - 0.04))
    points, triangles = dense_surface(mask, image)
    check_closed("surface", points, triangles)
    assert volume(points, triangles) == pytest.approx(mask.sum() * image.voxel_m3, rel=0.01)


def test_two_balls_on_a_thread_of_a_voxel_are_reported_to_fall_apart():
    def thread(x, y, z):
        one = (np.abs(x - 0.001) < 0.0005) & (np.abs(y - 0.001) < 0.0005)
        return (x**2 + y**2 + (np.abs(z) - 0.035) ** 2 < 0.015**2) | (one & (np.abs(z) < 0.03))

    with pytest.raises(InputError, match="the organ is too thin for its slices, and falls apart"):
        dense_surface(*masked(thread))


def test_parts_that_a_coarse_mesh_cannot_reach_are_reported():
    def dumbbell(x, y, z):
        return (x**2 + y**2 + (np.abs(z) - 0.035) ** 2 < 0.02**2) | ((x**2 + y**2 < 0.0045**2) & (np.abs(z) < 0.03))

    mask, image = masked(dumbbell)
    with pytest.raises(InputError, match=r"^image: 30 surface nodes are too few for this organ, parts of which"):
        surface(mask, image, 30)
    points, triangles = surface(mask, image, 140)
    check_closed("surface", points, triangles)
    assert np.ptp(points[:, 2]) > 0.1


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
