"""Instruments' distances have the derivatives that they say, and touch a body first where brute force finds it."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from palpate.bodies.mesh import TetMesh
from palpate.effects.instrument import Instrument, Pose, first_touch, upright
from palpate.errors import InputError

SPHERE = Instrument("sphere", 0.008)
CAPSULE = Instrument("capsule", 0.005, length_m=0.02)
PUNCH = Instrument("punch", 0.006, edge_m=0.002)
SHARP = Instrument("punch", 0.006)
ALL = (SPHERE, CAPSULE, PUNCH, SHARP)
NAMES = ("sphere", "capsule", "punch", "sharp punch")
DOWN = np.array([0.0, 0.0, -1.0])


def tilted(instrument: Instrument) -> Pose:
    return upright(instrument, np.array([0.01, -0.02, 0.03]), np.array([0.3, -0.5, 0.8]))


def around(pose: Pose, count: int = 400, reach: float = 2.5) -> np.ndarray:
    """Random points in and around the lower part of an instrument."""
    size = pose.instrument.radius_m + 0.5 * pose.instrument.length_m
    local = np.random.default_rng(0).uniform(-reach * size, reach * size, (count, 3))
    return pose.tip + local @ pose.axes


def smooth(pose: Pose, points: np.ndarray, step: float) -> np.ndarray:
    """Which points are away from where a distance has a kink: on axes, edges and between end and side."""
    gradients = [pose.gaps(points + shift)[1] for shift in step * np.vstack([np.eye(3), -np.eye(3)])]
    bends = [
        pose.bends(points + shift, *pose.gaps(points + shift)) for shift in step * np.vstack([np.eye(3), -np.eye(3)])
    ]
    close = np.abs(np.array(bends) - bends[0]).max(axis=(0, 2, 3)) < 0.05 * (1.0 + np.abs(bends[0]).max(axis=(1, 2)))
    return close & (np.abs(np.array(gradients) - gradients[0]).max(axis=(0, 2)) < 0.05)


@pytest.mark.parametrize("instrument", ALL, ids=NAMES)
def test_gradient_and_second_derivatives_are_those_of_the_distance(instrument):
    """Central differences with a step of 1e-6 m, away from kinks."""
    pose, step = tilted(instrument), 1e-6
    points = around(pose)
    points = points[smooth(pose, points, 10 * step)]
    assert len(points) > 200
    gaps, normals = pose.gaps(points)
    bends = pose.bends(points, gaps, normals)
    ahead, behind = ([pose.gaps(points + sign * shift) for shift in step * np.eye(3)] for sign in (1.0, -1.0))
    slopes = np.stack([(a[0] - b[0]) / (2 * step) for a, b in zip(ahead, behind, strict=True)], axis=1)
    curves = np.stack([(a[1] - b[1]) / (2 * step) for a, b in zip(ahead, behind, strict=True)], axis=2)
    assert np.abs(slopes - normals).max() < 1e-6
    assert np.abs(np.linalg.norm(normals, axis=1) - 1.0).max() < 1e-12
    scale = 1.0 / np.maximum(np.abs(gaps + (instrument.edge_m or instrument.radius_m)), 1e-3)
    assert (np.abs(curves - bends).max(axis=(1, 2)) / np.maximum(scale, np.abs(bends).max(axis=(1, 2)))).max() < 1e-4
    assert np.abs(bends - bends.transpose(0, 2, 1)).max() < 1e-9 * np.abs(bends).max()


def surface(instrument: Instrument, count: int = 400) -> np.ndarray:
    """Points (k, 3) of the surface of an upright instrument whose tip is the origin, written apart from its kernel."""
    turn, rise = np.meshgrid(np.linspace(0.0, 2 * np.pi, count), np.linspace(0.0, np.pi / 2, count))
    turn, rise, r = turn.ravel(), rise.ravel(), instrument.radius_m
    if instrument.kind == "punch":
        e = instrument.edge_m
        rim, height = r - e + e * np.sin(rise), e - e * np.cos(rise)
        flat = (r - e) * rise / (np.pi / 2)
        wall = np.linspace(e, 3 * r, count * count)
        rim, height = np.concatenate([rim, flat, np.full_like(wall, r)]), np.concatenate([height, 0 * flat, wall])
        turn = np.concatenate([turn, turn, np.resize(turn, len(wall))])
        return np.column_stack([rim * np.cos(turn), rim * np.sin(turn), height])
    ball = np.column_stack([np.sin(rise) * np.cos(turn), np.sin(rise) * np.sin(turn), 1.0 - np.cos(rise)]) * r
    if instrument.kind == "sphere":
        return ball
    half, ends = 0.5 * instrument.length_m, np.sign(ball[:, :1]) * [1.0, 0.0, 0.0]
    straight = np.column_stack(
        [half * (turn / np.pi - 1.0), r * np.sin(2 * rise - np.pi / 2), r * (1 - np.cos(2 * rise - np.pi / 2))]
    )
    return np.concatenate([ball + half * ends, straight])


@pytest.mark.parametrize("instrument", ALL, ids=NAMES)
def test_distance_outside_is_that_to_points_of_the_surface(instrument):
    pose = upright(instrument, np.zeros(3), -DOWN)
    along = surface(instrument) @ pose.axes
    points = np.random.default_rng(1).uniform(-2, 2, (60, 3)) * instrument.radius_m
    gaps = pose.gaps(points)[0]
    points, gaps = points[(gaps > 0.0) & (points[:, 2] < 0.0)], gaps[(gaps > 0.0) & (points[:, 2] < 0.0)]
    nearest, spacing = cKDTree(along).query(points)[0], 0.02 * instrument.radius_m
    assert len(points) > 20
    assert (nearest > gaps - 1e-12).all() and (nearest < np.sqrt(gaps**2 + spacing**2)).all()


def single(corners) -> TetMesh:
    """A tetrahedron below three corners (3, 3) [m]."""
    nodes = np.vstack([corners, np.mean(corners, axis=0) + 0.1 * DOWN])
    mesh = TetMesh(nodes, np.array([[0, 1, 2, 3]]))
    return mesh if mesh.volumes[0] > 0.0 else TetMesh(nodes, np.array([[1, 0, 2, 3]]))


FACE = single(np.array([[-0.06, -0.05, 0.0], [0.06, -0.05, 0.01], [0.0, 0.07, -0.01]]))
EDGE = single(np.array([[-0.05, 0.0, 0.0], [0.05, 0.0, 0.0], [0.0, 0.05, -0.09]]))
CORNER = single(np.array([[0.0, 0.0, 0.0], [0.05, -0.03, -0.08], [-0.03, 0.05, -0.08]]))
PLACES = {"face": FACE, "edge": EDGE, "corner": CORNER}
WAYS = {"normal": DOWN, "oblique": np.array([0.5, 0.3, -1.0]) / np.linalg.norm([0.5, 0.3, -1.0])}


def fine(mesh: TetMesh, count: int = 200) -> np.ndarray:
    """Points of all triangles of a mesh."""
    u, v = (grid.ravel() for grid in np.meshgrid(*2 * [np.linspace(0.0, 1.0, count)]))
    shares = np.column_stack([1.0 - u, u * (1.0 - v), u * v])
    return (shares[None] @ mesh.nodes[mesh.triangles]).reshape(-1, 3)


@pytest.mark.parametrize("way", WAYS.values(), ids=WAYS)
@pytest.mark.parametrize("mesh", PLACES.values(), ids=PLACES)
@pytest.mark.parametrize("instrument", ALL, ids=NAMES)
def test_first_touch_is_where_bisection_with_many_points_finds_it(instrument, mesh, way):
    """Within what 40 000 points of a triangle resolve; and nothing overlaps, by more than 1e-8 of the radius."""
    pose = upright(instrument, np.zeros(3), -DOWN)
    found, points = first_touch(pose, mesh, way), fine(mesh)
    low, high = -1.0, float((found.tip - pose.tip) @ way) + 0.002
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if pose.moved(middle * way).gaps(points)[0].min() < 0.0 else (middle, high)
    assert float((found.tip - pose.tip) @ way) == pytest.approx(high, abs=2e-3 * instrument.radius_m)
    assert found.gaps(points)[0].min() > -1e-8 * instrument.radius_m


def test_a_sphere_meets_a_corner_an_edge_and_a_face_where_geometry_says():
    r = SPHERE.radius_m
    corner = first_touch(upright(SPHERE, np.array([0.0, 0.002, 0.0]), -DOWN), CORNER, DOWN)
    assert corner.tip[2] + r == pytest.approx(np.sqrt(r**2 - 0.002**2), abs=1e-8 * r)
    edge = first_touch(upright(SPHERE, np.array([0.01, -0.003, 0.0]), -DOWN), EDGE, DOWN)
    assert edge.tip[2] + r == pytest.approx(np.sqrt(r**2 - 0.003**2), abs=1e-8 * r)
    face = first_touch(upright(SPHERE, np.zeros(3), -DOWN), FACE, WAYS["oblique"])
    a, b, c = FACE.nodes[:3]
    normal = np.cross(b - a, c - a) / np.linalg.norm(np.cross(b - a, c - a))
    middle = face.tip - r * DOWN
    assert abs(normal @ (middle - a)) == pytest.approx(r, abs=1e-8 * r)


def test_what_misses_the_body_and_what_is_no_instrument_are_refused():
    with pytest.raises(InputError, match="does not reach"):
        first_touch(upright(SPHERE, np.array([1.0, 0.0, 0.0]), -DOWN), FACE, DOWN)
    for wrong in ({"radius_m": np.nan}, {"radius_m": 0.0}, {"kind": "cone"}, {"edge_m": 0.01}, {"edge_m": np.nan}):
        with pytest.raises(InputError):
            Instrument(**{"kind": "punch", "radius_m": 0.006, "edge_m": 0.001} | wrong)
    for wrong in (np.nan, np.inf, -1.0):
        with pytest.raises(InputError):
            Instrument("capsule", 0.01, length_m=wrong)
