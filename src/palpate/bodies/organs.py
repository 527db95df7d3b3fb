"""Bodies of smooth surface: images of the unit sphere (paper 1's liver, a kidney, a stomach), and the cylinder's."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial

import numpy as np
from scipy.spatial import cKDTree

from palpate.bodies.mesh import TetMesh, unit
from palpate.bodies.mesh_quality import REFUSED_DEG
from palpate.bodies.refinement import Snap
from palpate.bodies.settings import Cylinder, Smooth
from palpate.bodies.simple_shapes import onto_cylinder
from palpate.bodies.surfaces.remesh import fibonacci_sphere, nearest_alike, triangulate, triangulate_evenly
from palpate.bodies.surfaces.snap import Onto, element_quality, snapper_onto
from palpate.bodies.surfaces.tetrahedralize import Ball, tetrahedralize
from palpate.bodies.surfaces.triangles import vertex_normals
from palpate.errors import InputError

SURFACE_NODES = 140
SAMPLES = 20000
NEWTON_STEPS = 6
"""Gauss-Newton steps to the place of the sphere whose image is nearest; 3 suffice but at tips."""
DIFFERENCE, LONGEST = 1e-6, 0.05
"""Angle [rad] of the differences that slopes are taken by, and of a step at most."""

Shape = Callable[[np.ndarray], np.ndarray]
"""A smooth one-to-one map of points of the unit sphere (n, 3) to those of a shape (n, 3), of any size."""


def coarse_body(shape: Shape, length_m: float, balls: Sequence[Ball] = ()) -> TetMesh:
    """Build a coarse mesh of 140 nodes and 276 triangles on the surface of ``shape``, identical on every call.

    Its longest side is ``length_m``; the origin is the middle of the bounding box of the smooth shape. In ``balls``
    elements are smaller. Trap: which elements gmsh makes, and their order, depend on rounding, so that the mesh is made
    at one length and scaled.
    """
    made_m = MADE_M.get(shape, 0.2)
    scale = length_m / made_m
    points, triangles, sphere = _dense(shape, made_m)
    surface_points, surface_triangles = triangulate_evenly(points, triangles, sphere, SURFACE_NODES)
    scaled_balls = [(center / scale, radius / scale) for center, radius in balls]
    # a little finer than the surface (whose edges are 0.12 of the length), for better angles inside
    mesh = tetrahedralize(points[surface_points], surface_triangles, spacing_m=0.1 * made_m, balls=scaled_balls)
    return TetMesh(scale * mesh.nodes, mesh.tetrahedra)


def onto_shape(shape: Shape, length_m: float) -> Onto:
    """Return the projection to the smooth shape: to its nearest place that faces the same way, by its own formula.

    It begins at the nearest point of a dense surface, and finds the place on the unit sphere by Gauss-Newton steps.
    Trap: the dense surface alone, taken as flat around its points, is as far from the shape as the facets of the third
    refinement are.
    """
    dense, triangles, sphere = _dense(shape, length_m)
    normals, tree = vertex_normals(dense, triangles), cKDTree(dense)
    middle, scale = _placed(shape(sphere), length_m)

    def places(on_sphere: np.ndarray) -> np.ndarray:
        return (shape(on_sphere) - middle) * scale

    def onto(points: np.ndarray, facing: np.ndarray) -> np.ndarray:
        s = sphere[nearest_alike(points, facing, normals, tree)]
        projected = places(s)
        distance_now = np.linalg.norm(points - projected, axis=1)
        for _ in range(NEWTON_STEPS):
            next_s = _closer(places, s, points - projected)
            next_points = places(next_s)
            distance_next = np.linalg.norm(points - next_points, axis=1)
            better = distance_next < distance_now
            s, projected = np.where(better[:, None], next_s, s), np.where(better[:, None], next_points, projected)
            distance_now = np.minimum(distance_next, distance_now)
        return projected

    return onto


def _closer(places: Shape, s: np.ndarray, missing: np.ndarray) -> np.ndarray:
    """Return points (n, 3) of the sphere, a Gauss-Newton step from ``s`` to move images by ``missing`` (n, 3) [m]."""
    not_parallel = np.where(np.abs(s[:, :1]) < 0.7, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    tangent = unit(np.cross(s, not_parallel))
    axes = np.stack([tangent, np.cross(s, tangent)], axis=1)
    shifted = [unit(s[:, None] + sign * DIFFERENCE * axes).reshape(-1, 3) for sign in (1, -1)]
    slopes = ((places(shifted[0]) - places(shifted[1])) / (2 * DIFFERENCE)).reshape(-1, 2, 3)
    gram = slopes @ slopes.transpose(0, 2, 1)
    step = np.linalg.solve(gram, slopes @ missing[:, :, None])[:, :, 0]
    step *= np.minimum(1.0, LONGEST / np.maximum(np.linalg.norm(step, axis=1, keepdims=True), 1e-300))
    return unit(s + np.einsum("nk,nki->ni", step, axes))


def logistic(value: np.ndarray) -> np.ndarray:
    """Return the logistic function of ``value``, a smooth step from 0 to 1."""
    return 1 / (1 + np.exp(-value))


def _dense(shape: Shape, length_m: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return many points (n, 3) [m] of the smooth shape, the triangles between them, and their places on the sphere."""
    sphere = fibonacci_sphere(SAMPLES)
    points = shape(sphere)
    middle, scale = _placed(points, length_m)
    return (points - middle) * scale, triangulate(sphere), sphere


def _placed(points: np.ndarray, length_m: float) -> tuple[np.ndarray, float]:
    """Return the middle (3,) of the points' bounding box, and the factor that makes its longest side ``length_m``."""
    lowest, highest = points.min(axis=0), points.max(axis=0)
    return (lowest + highest) / 2, length_m / (highest - lowest).max()


def liver(length_m: float) -> TetMesh:
    """Build the coarse mesh of a liver, ``length_m`` long."""
    return coarse_body(liver_shape, length_m)


def liver_shape(sphere: np.ndarray) -> np.ndarray:
    """Map points of the unit sphere, (n, 3), smoothly and one to one onto a liver about 2 long, (n, 3).

    Axes as in CT: x to the patient's left, y to the back, z to the head. The coefficients are ours, set by eye:
    cross-sections along x shrink from the thick right lobe to the thin left one.
    """
    x, y, z = sphere.T
    right = logistic(3.2 * (0.18 - x))
    blunt = (1.0001 - x * x) ** -0.12
    y, z = y * blunt, z * blunt
    under = logistic(-8 * z)
    top = 0.22 + 0.42 * right
    # the underside falls to the anterior edge and rises to the back
    bottom = (0.18 + 0.72 * right) * (1 - 0.45 * y)
    height = z * (top + (bottom - top) * under)
    depth = y * (0.40 + 0.32 * right)
    hollow = 0.42 * np.exp(-(((x - 0.1) / 0.6) ** 2) - ((y - 0.25) / 0.6) ** 2)
    heart = 0.05 * np.exp(-(((x - 0.35) / 0.3) ** 2) - (y / 0.6) ** 2)
    notch = 0.07 * np.exp(-(((x - 0.28) / 0.15) ** 2)) * logistic(-8 * (y + 0.4))
    stomach = 0.14 * np.clip(x + 0.2, 0, None) ** 2
    height = height + hollow * under * (0.3 + 0.7 * right) - heart * (1 - under)
    return np.column_stack([x, depth + notch - stomach, height + 0.25 * depth + 0.12 * x])


def kidney_shape(sphere: np.ndarray) -> np.ndarray:
    """Map points of the unit sphere, (n, 3), smoothly and one to one onto a left kidney about 2 long, (n, 3).

    Axes as in CT: x to the patient's left, where it bulges, y to the back, z to the head. The
    coefficients are ours, set by eye: poles bent towards the hilum, which is a hollow in the middle side.
    """
    x, y, z = sphere.T
    blunt = (1.0001 - z * z) ** -0.1
    hilum = 0.2 * np.exp(-((z / 0.4) ** 2) - (y / 0.7) ** 2) * (1 - x) / 2
    across = (0.5 - 0.04 * z) * x * blunt + hilum
    return np.column_stack([across - 0.28 * z * z, 0.4 * y * blunt, z])


BEND = 2.0
"""Angle [rad] by which the axis turns from the body of the stomach to its outlet."""


def stomach_shape(sphere: np.ndarray) -> np.ndarray:
    """Map points of the unit sphere, (n, 3), smoothly and one to one onto a stomach about 2 long, (n, 3).

    Axes as in CT: the wide upper end, the fundus, is at the patient's left, the narrow outlet at the right. The
    coefficients are ours, set by eye: round sections around an axis that goes down, then turns to the right and up.
    """
    x, y, along = sphere.T
    # the axis, by the trapezoidal rule, and how it turns
    places = np.linspace(-1.0, 1.0, 2001)
    rise = np.clip((places + 0.35) / 1.1, 0.0, 1.0)
    turn = BEND * (rise**3 * (10 - 15 * rise + 6 * rise * rise))  # from 0 to BEND without a kink
    tangents = 1.25 * np.column_stack([-np.sin(turn), -np.cos(turn)])
    axis = np.cumsum((tangents[1:] + tangents[:-1]) / 2 * (places[1] - places[0]), axis=0)
    axis = np.vstack([np.zeros(2), axis])
    angle = np.interp(along, places, turn)
    blunt = (1.0001 - along * along) ** -0.12
    radius = (0.37 - 0.13 * along - 0.06 * along**2) * blunt
    middle = [np.interp(along, places, axis[:, i]) for i in range(2)]
    left = middle[0] + radius * x * np.cos(angle)
    head = middle[1] - radius * x * np.sin(angle)
    return np.column_stack([left, -0.85 * radius * y, head])


SHAPES: dict[str, Shape] = {"liver": liver_shape, "kidney": kidney_shape, "stomach": stomach_shape}
"""Kinds of bodies whose surface is an image of the sphere, and the maps of it."""
MADE_M: dict[Shape, float] = {liver_shape: 0.2, kidney_shape: 0.11, stomach_shape: 0.25}
"""Length [m] at which the elements of each are made."""


@dataclass(frozen=True)
class SmoothSurface:
    """The smooth surface of a body.

    kind : cylinder, or one of SHAPES
    size_m : the organ's longest side, or the cylinder's radius [m], whose flat ends need no size
    """

    kind: str
    size_m: float

    def snap(self, mesh: TetMesh, first: int) -> TetMesh:
        """Return ``mesh`` with its surface nodes from number ``first`` on moved onto the surface.

        Nodes inside follow where elements would be bad. InputError if elements are bad all the same.
        """
        snapped = _snapper(self)(mesh, first)
        least = float(element_quality(snapped.nodes, snapped.tetrahedra).min())
        if not least >= REFUSED_DEG:
            raise InputError(
                f"bodies: a {self.kind} whose refined surface is smooth has elements with dihedral angles of "
                f"{least:.2g}°; give smooth: false."
            )
        return snapped


def surface_of(entry: Smooth) -> SmoothSurface:
    """Return the smooth surface of a body, whether its levels lie on it or not."""
    return SmoothSurface(entry.kind, float(entry.radius_m if isinstance(entry, Cylinder) else entry.length_m))


@lru_cache(maxsize=8)
def _snapper(surface: SmoothSurface) -> Snap:
    if surface.kind == "cylinder":
        return snapper_onto(partial(onto_cylinder, radius_m=surface.size_m))
    return snapper_onto(onto_shape(SHAPES[surface.kind], surface.size_m))
