"""Measure by how much a mesh of linear elements, as engines have them, is stiffer than the organ, by pressing it.

The same ball is pressed into the mesh at the same places, with the engine's law. No part of the surface may be inside
the ball, as where an engine's contact takes the deepest point of each element: contact is checked at points that fill
the triangles, with their corners. The modulus that compensates is the organ's over the geometric mean of the ratios of
force.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from palpate.benchmark.touch import Touch
from palpate.bodies.body import Body
from palpate.bodies.mesh import Mesh, area_normals
from palpate.bodies.surface_quadrature import near_ball, surface_interpolation
from palpate.effects.instrument import Pose
from palpate.errors import NotConverged
from palpate.solvers.indentation import PENALTY, ContactPoints, Indentation

SPACING, MOST_ALONG = 0.15, 16
"""Distance of points that may touch over the ball's radius, and most of them along a side of a triangle."""
TOLERANCE = 1e-4
LARGEST_POISSON = 0.45
"""Above it linear elements lock, so that their forces differ by more than a modulus makes good."""


@dataclass(frozen=True, eq=False)
class Stiffer:
    """How much stiffer a mesh of linear elements is than the organ, at k places.

    law : of the engine; poisson : of the mesh; depth_m : (k,) [m] of the presses
    ratios : (k,) of the mesh's force over the organ's, NaN where the mesh has no answer
    """

    law: str
    poisson: float
    depth_m: np.ndarray
    ratios: np.ndarray

    @property
    def factor(self) -> float:
        """The geometric mean of the ratios."""
        return float(np.exp(np.nanmean(np.log(self.ratios))))

    @property
    def scatter(self) -> float:
        """The standard deviation of the ratios between places, as a share."""
        return float(np.nanstd(np.log(self.ratios)))

    @property
    def sentence(self) -> str:
        """The ratios in words, for the comment of an exported file."""
        more = self.factor - 1.0
        difference = f"acts {abs(more):.0%} {'stiffer' if more > 0 else 'softer'} than the organ"
        count = int(np.isfinite(self.ratios).sum())
        return (
            f"on this mesh, linear elements with the law {self.law}, the same ball {difference} in {count} of "
            f"{len(self.ratios)} presses to {1e3 * self.depth_m.max():.3g} mm, {self.scatter:.0%} from place to place; "
            "the modulus here makes up for the mean"
        )


def pressed(body: Body, level: int, law: str, poisson: float, touches: Sequence[Touch], organ_n: np.ndarray) -> Stiffer:
    """Press linear elements on ``level`` of ``body`` with an engine's ``law``, and compare forces with the organ's.

    touches : k presses, with their poses of first touch on ``body``
    organ_n : (k,) forces [N] of the organ for Young's modulus 1 Pa
    NotConverged where no press has an answer.
    """
    poisson = min(poisson, LARGEST_POISSON)
    elastic = replace(body, material=replace(body.material, law=law, poisson=poisson))
    ratios = np.full(len(touches), np.nan)
    for i, touch in enumerate(touches):
        try:
            ratios[i] = mesh_force(elastic, level, touch, touch.poses[body]) / organ_n[i]
        except NotConverged as failure:
            last_failure = failure
    if not np.isfinite(ratios).any():
        raise NotConverged(f"no press has an answer on the mesh for engines: {last_failure}", last_failure.history)
    return Stiffer(law, poisson, np.array([touch.depth_m for touch in touches]), ratios)


def mesh_force(body: Body, level: int, touch: Touch, pose: Pose) -> float:
    """Return the force [N] of linear elements against a touch that begins at ``pose``, for Young's modulus 1 Pa."""
    mesh, young = body.levels[level], body.material.young_pa
    end = pose.moved(touch.depth_m * touch.direction)
    center = end.tip + touch.instrument.radius_m * end.axes[2]
    points = filling_points(mesh, young, center, touch.instrument.radius_m)
    problem = Indentation(body, level, 1, points, [pose], touch.instrument.sticks)
    *_, state = problem.push(touch.direction, [touch.depth_m], TOLERANCE)
    return float(state.force @ touch.direction) / young


def filling_points(mesh: Mesh, young_pa: float, center: np.ndarray, radius_m: float) -> ContactPoints:
    """Return contact points that fill the triangles, corners and edges of ``mesh`` within 1.5 radii of ``center`` (3,).

    NotConverged where there are none.
    """
    corners = mesh.nodes[mesh.triangles]
    near = np.flatnonzero(near_ball(corners, center, 1.5 * radius_m))
    if not len(near):
        raise NotConverged("no part of the surface is near the instrument", [float("nan")])
    sides = np.linalg.norm(corners[near] - np.roll(corners[near], 1, axis=1), axis=2)
    along = int(np.clip(np.ceil(sides.max() / (SPACING * radius_m)), 1, MOST_ALONG))
    barycentric = np.array([[i, j, along - i - j] for i in range(along + 1) for j in range(along + 1 - i)]) / along
    triangles, per_triangle = np.repeat(near, len(barycentric)), len(barycentric)
    near_corners = mesh.triangles[near]
    at_rest = np.linalg.norm(area_normals(mesh.nodes, near_corners), axis=1)

    def stretch(x: np.ndarray) -> np.ndarray:
        return np.repeat(np.linalg.norm(area_normals(x, near_corners), axis=1) / at_rest, per_triangle)

    areas = np.repeat(0.5 * at_rest / per_triangle, per_triangle)
    penalty = np.repeat(PENALTY * young_pa / np.sqrt(at_rest), per_triangle)
    interpolation = surface_interpolation(mesh, triangles, np.tile(barycentric, (len(near), 1)), 1)
    return ContactPoints(interpolation, areas, penalty, stretch, per_triangle)
