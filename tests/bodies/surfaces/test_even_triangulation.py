import numpy as np

from palpate.bodies.surfaces.decimate import fibonacci_sphere, flip, triangulate, triangulate_evenly


def corner_angles(points, triangles):
    corners = points[triangles]
    u, v = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    return np.degrees(np.arctan2(np.linalg.norm(np.cross(u, v), axis=-1), (u * v).sum(axis=-1)))


def test_spreads_evenly_over_a_stretched_sphere():
    sphere = fibonacci_sphere(4000)
    points = sphere * [3.0, 1.0, 0.7]
    chosen, triangles = triangulate_evenly(points, triangulate(sphere), sphere, 100)
    assert len(set(chosen.tolist())) == 100
    assert len(triangles) == 196
    assert corner_angles(points[chosen], triangles).min() > 25
    lengths = np.linalg.norm(points[chosen][triangles] - points[chosen][np.roll(triangles, 1, 1)], axis=2)
    assert lengths.max() < 3 * lengths.min()


def test_flips_keep_the_surface_closed_and_improve_it():
    sphere = fibonacci_sphere(200)
    points, before = sphere * [1.0, 1.0, 0.3], triangulate(sphere)
    after = flip(points, before)
    ends = after[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    assert len(np.unique(ends, axis=0)) == len(ends) == 3 * len(before)
    assert np.array_equal(np.unique(ends, axis=0), np.unique(ends[:, ::-1], axis=0))
    assert corner_angles(points, after).min() >= corner_angles(points, before).min()
