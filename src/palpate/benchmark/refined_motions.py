"""Motions of a body that instruments touch, on meshes that are refined where they do.

A coarse motion shows which points of the surface bear pressure at any time. Each further mesh halves the elements
around these and at the rim of what is held once more.
"""

from collections.abc import Callable, Iterator

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from palpate.benchmark.touch_mesh import COARSER
from palpate.bodies.body import Body
from palpate.bodies.fine_surface_map import FineSurfaceMap
from palpate.bodies.local_refinement import LocalRefinement
from palpate.bodies.refinement import with_midpoints
from palpate.collision.contact.instrument_contact import instruments_of
from palpate.effects.settings import Loads, Rayleigh
from palpate.errors import NotConverged
from palpate.solvers.indentation import contact_points
from palpate.solvers.quadratic_motion import QuadraticMotion, Reached
from palpate.solvers.touched_motion import TouchedMotion

TOLERANCE = 1e-3
"""Of the forces in a stage that do not balance, over the largest of contact."""
MARGIN = 1.0
"""A mesh is refined within so many of its own edges from what is touched."""


class RefinedMotions:
    """Makes the motions of one body under the blocks ``contact``, ``gravity``, ``push`` of a scene, mesh by mesh.

    steps : in which the coarse motion looks for what is touched
    InputError for instruments that are neither spheres nor capsules; NotConverged where nothing is touched.
    """

    first, nested = 0, False

    def __init__(self, body: Body, loads: Loads, rayleigh: Rayleigh, duration_s: float, steps: int):
        contact = loads.contact
        assert contact is not None
        self._base = body.from_level(body.shape_level if body.smooth is None else len(body.levels) - 1)
        self._surface, self._rayleigh = FineSurfaceMap(self._base), rayleigh
        self._loads = loads.but(contact=None)
        self._contact = instruments_of(body, contact)
        self._radius = max(each.radius_m for each in self._contact.obstacles)
        corners = self._base.coarse.nodes[self._base.coarse.triangles]
        self._edge = float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean())
        self._touched = self._find_touched(duration_s / steps, steps)
        near = cKDTree(self._touched).query(body.fine.nodes[body.fine.surface])[0]
        self.patch = near <= self._radius
        """Surface nodes (n_surface,) within a radius of the instrument from what is touched."""

    def motion(self, number: int) -> tuple[TouchedMotion, sparse.csr_array]:
        """Return the motion on the mesh of that number, and the map of its nodes to the fine surface of the body."""
        if not number:
            return self._moved(self._base.up_to(0), 0, lambda at: np.ones(len(at), dtype=bool))
        levels, everywhere = np.arange(number), max(0, number - COARSER)
        whole = 2.0 * np.linalg.norm(np.ptp(self._base.coarse.nodes, axis=0))
        radii = np.where(levels < everywhere, whole, MARGIN * self._edge / 2.0**levels)
        body = LocalRefinement(self._base, number).around(self._touched, radii.tolist(), number)
        touched, reach = cKDTree(self._touched), self._edge + self._radius
        return self._moved(body, number, lambda at: touched.query(at)[0] <= reach)

    def _moved(
        self, body: Body, number: int, near: Callable[[np.ndarray], np.ndarray]
    ) -> tuple[TouchedMotion, sparse.csr_array]:
        points = contact_points(body.fine, 2, body.material.young_pa, near)
        whole = with_midpoints(body, number)
        moved = TouchedMotion(whole, number, self._loads, self._rayleigh, points, self._contact)
        return moved, self._surface.of(body, 2)

    def steps(
        self, motion: QuadraticMotion, number: int, h: float, count: int, before: list[np.ndarray]
    ) -> Iterator[Reached]:
        """Yield the ends of the steps of a ``motion``; ``before`` is of no use, as meshes are not nested."""
        assert isinstance(motion, TouchedMotion)  # as ``motion`` makes it
        return motion.touched_steps(h, count, TOLERANCE)

    def _find_touched(self, h: float, count: int) -> np.ndarray:
        """Return the places at rest (k, 3) [m] of points that bear pressure after any step of the first mesh."""
        motion, _ = self.motion(0)
        rest = motion.points.interpolation @ motion.mesh.nodes
        bore = np.any([motion.bearing for _ in motion.touched_steps(h, count, TOLERANCE)], axis=0)
        if not bore.any():
            raise NotConverged(
                f"{self._base.name}: no instrument touches it, or elements are too large to see it", [0.0]
            )
        return rest[bore]
