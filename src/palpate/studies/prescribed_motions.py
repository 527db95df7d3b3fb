"""Surfaces that move in closed form: bodies that deform and meet, and bodies that are apart."""

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from palpate.bodies.body import nest
from palpate.bodies.material import Material
from palpate.bodies.organs import liver
from palpate.bodies.particles import particles_of
from palpate.bodies.simple_shapes import sheet
from palpate.bodies.surfaces.remesh import fibonacci_sphere, triangulate

TURN = 2 * np.pi
LENGTH_M = 0.2
SOUP_GRID = 512
"""Grid intervals per unit length: the soup's vertices lie on this grid, so that they often touch exactly."""


class Moving(NamedTuple):
    """One body that may collide with itself, or two that may collide with each other.

    triangles : (m, 3) int64 of each body; at : function of a time from 0 to 1 that gives the points (n, 3) [m] of each
    """

    name: str
    triangles: list[np.ndarray]
    at: Callable[[float], list[np.ndarray]]


def scenes(refinements: int, seed: int) -> list[Moving]:
    """Return the four scenes; a liver has 276 · 4^``refinements`` triangles, and the others are about as fine."""
    return [
        two_livers(refinements),
        instrument_press(refinements),
        folding_sheet(8 * 2**refinements),
        random_soup(50 * 4**refinements, seed),
    ]


@cache
def liver_surface(refinements: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the points (n, 3) [m] and triangles (276 · 4^refinements, 3) of the liver's surface."""
    body = nest("liver", liver(LENGTH_M), refinements, np.array([0]), Material(3000.0, 0.3, 1000.0))
    particles = particles_of(body, refinements, surface=True)
    return particles.nodes, particles.triangles


def two_livers(refinements: int) -> Moving:
    """Make two livers that oscillate, rotate and press into each other."""
    rest, triangles = liver_surface(refinements)

    def at(time: float) -> list[np.ndarray]:
        angle = 0.4 * time
        turn = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
        shift = np.array([0.16 - 0.025 * np.sin(np.pi * time), 0.01, 0.005])
        return [_wobble(rest, time), _wobble(rest, time + 0.3) @ turn + shift]

    return Moving("two_livers", [triangles, triangles], at)


def _wobble(rest: np.ndarray, time: float) -> np.ndarray:
    """Add transverse waves of length 0.1 m and amplitude 4 mm along each axis."""
    return rest + 0.004 * np.sin(TURN * (rest[:, [1, 2, 0]] / 0.1 + 2 * time))


def instrument_press(refinements: int) -> Moving:
    """Make a rigid capsule that moves over the liver and presses in, while the tissue moves by 80 % of the depth."""
    rest, triangles = liver_surface(refinements)
    capsule, sides = _capsule(80 * 4**refinements, radius_m=0.012, length_m=0.08)
    upper = rest[rest[:, 2] > 0]
    corners = np.array([[-0.05, 0.0], [0.0, -0.02], [0.05, -0.01]])
    path = np.array([upper[np.argmin(np.linalg.norm(upper[:, :2] - corner, axis=1))] for corner in corners])

    def at(time: float) -> list[np.ndarray]:
        touched = np.array([np.interp(time, [0.0, 0.5, 1.0], path[:, axis]) for axis in range(3)])
        depth = 0.02 * np.sin(np.pi * time) ** 2
        falloff = np.exp(-0.5 * np.sum((rest - touched) ** 2, axis=1) / 0.015**2)
        pressed = rest - 0.8 * depth * falloff[:, None] * np.array([0.0, 0.0, 1.0])
        return [capsule + touched - [0.0, 0.0, depth], pressed]

    return Moving("instrument_press", [sides, triangles], at)


@cache
def _capsule(count: int, radius_m: float, length_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Make an upright capsule of about 2 ``count`` triangles with its lowest point at the origin."""
    sphere = fibonacci_sphere(count)
    points = radius_m * sphere + [0.0, 0.0, radius_m]
    points[sphere[:, 2] > 0, 2] += length_m
    return points, triangulate(sphere)


def folding_sheet(divisions: int) -> Moving:
    """Make a rippled sheet of 2 ``divisions``² triangles that folds at its middle until its halves cross."""
    mesh = sheet([0.3, 0.3], [divisions, divisions], 0.001)
    rest_x, column = np.unique(mesh.nodes[:, 0], return_inverse=True)
    y = mesh.nodes[:, 1]

    def at(time: float) -> list[np.ndarray]:
        bend = np.pi * (1.0 + 0.25 * time) * np.clip((rest_x - 0.12) / 0.06, 0.0, 1.0)
        steps = np.diff(rest_x)[:, None] * _direction((bend[1:] + bend[:-1]) / 2)
        middle_line = np.vstack([[0.0, 0.0], np.cumsum(steps, axis=0)])
        normals = _direction(bend + np.pi / 2)[column]
        ripple = 0.004 * np.sin(TURN * (y / 0.1 + mesh.nodes[:, 0] / 0.07 + time))
        x, z = (middle_line[column] + ripple[:, None] * normals).T
        return [np.column_stack([x, y, z])]

    return Moving("folding_sheet", [mesh.triangles], at)


def _direction(angle: np.ndarray) -> np.ndarray:
    return np.column_stack([np.cos(angle), np.sin(angle)])


def random_soup(count: int, seed: int) -> Moving:
    """Make two clouds of ``count`` separate triangles each in a unit cube, every triangle with a drift of its own.

    One in ten is a segment and one in ten a point; all vertices lie on a grid of SOUP_GRID intervals per unit.
    """
    random = np.random.default_rng(seed)
    size = 1.2 * count ** (-1 / 3)
    clouds = []
    for _ in range(2):
        shape = size * random.uniform(-0.5, 0.5, (count, 3, 3))
        shape[: count // 10] = shape[: count // 10, :1]
        shape[count // 10 : count // 5, 2] = shape[count // 10 : count // 5, 1]
        centre, drift = random.uniform(0, 1, (count, 1, 3)), random.normal(0, 0.15, (count, 1, 3))
        clouds.append((shape, centre, drift))
    triangles = np.arange(3 * count).reshape(-1, 3)

    def at(time: float) -> list[np.ndarray]:
        placed = [(shape + centre + drift * time).reshape(-1, 3) for shape, centre, drift in clouds]
        return [np.round(points * SOUP_GRID) / SOUP_GRID for points in placed]

    return Moving("random_soup", [triangles, triangles], at)


def crossing_waves(triangles: int) -> Moving:
    """Make two sheets of together about ``triangles`` triangles with perpendicular waves, for scaling."""
    divisions = max(2, round(np.sqrt(triangles / 4)))
    mesh = sheet([1.0, 1.0], [divisions, divisions], 0.001)
    x, y = mesh.nodes[:, 0], mesh.nodes[:, 1]

    def at(time: float) -> list[np.ndarray]:
        z_1, z_2 = (0.05 * np.sin(TURN * (2 * along + phase)) for along, phase in ((x, time), (y, 0.1 - time)))
        return [np.column_stack([x, y, z_1]), np.column_stack([x + 1e-3, y + 1e-3, z_2])]

    return Moving("crossing_waves", [mesh.triangles, mesh.triangles], at)


FAR_M = 0.06
"""Height from which the instrument comes, and to which it returns."""
APART_M = 0.05
"""Additional distance of the livers' centres, with which they pass each other."""


def instrument_approach(refinements: int) -> Moving:
    """Make the instrument of ``instrument_press`` come from far, press for a fifth of the time, and leave again."""
    pressing = instrument_press(refinements)

    def at(time: float) -> list[np.ndarray]:
        capsule, liver = pressing.at(np.clip((time - 0.4) / 0.2, 0.0, 1.0))
        away_share = max(abs(time - 0.5) - 0.1, 0.0) / 0.4
        return [capsule + np.array([0.0, 0.0, FAR_M * away_share]), liver]

    return Moving("instrument_approach", pressing.triangles, at)


def livers_apart(refinements: int) -> Moving:
    """Make the livers of ``two_livers`` pass each other without touching."""
    meeting = two_livers(refinements)

    def at(time: float) -> list[np.ndarray]:
        liver_1, liver_2 = meeting.at(time)
        return [liver_1, liver_2 + np.array([APART_M, 0.0, 0.0])]

    return Moving("livers_apart", meeting.triangles, at)


def two_bodies(refinements: int) -> dict[str, tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]]:
    """Return pairs of rigid bodies to be placed apart: points (n, 3) [m] and triangles (m, 3) of both, by name."""
    liver = liver_surface(refinements)
    pressing = instrument_press(refinements)
    return {"two_livers": (liver, liver), "instrument": ((pressing.at(0.0)[0], pressing.triangles[0]), liver)}


def turned(points: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Rotate points (n, 3) [m] about their mean, evenly over all rotations, and put the mean at the origin."""
    return Rotation.random(random_state=random).apply(points - points.mean(axis=0))
