"""Tree of bounding volumes over triangles: paper 3's composite hierarchy, its two special cases, and its rivals."""

import numpy as np

from palpate.collision.trees import build_tree
from palpate.collision.trees.build_tree import KIND
from palpate.collision.trees.volumes import AABB, BOTH, DIRECTIONS, KINDS, SPHERE
from palpate.collision.triangles.intersection import coordinates
from palpate.errors import InputError

DEPTHS = (1, 1)
"""Levels of the fastest composite with all three layers: each further level with spheres made a frame of two livers of
4416 triangles slower (0.29 ms with AABBs alone, 0.33 as here, 0.42 with (4, 2)) and passed on the same pairs.
"""
REBUILD_QUALITY = 0.6
"""Quality below which a rebuild halves the node tests between two twisted livers, and pays off in ten searches."""
NOT_FINITE = "points of a tree are not finite; check the coordinates of its body."
POINTS = (None, 3)


class Tree:
    """Bounding volumes over ``triangles`` (m, 3) of ``points`` (n, 3) [m], from all of them down to single ones.

    structure : composite, sphere, aabb, obb, dop14 or dop18
    depths : of the composite, the number of levels with spheres only, and of those below with a sphere and an AABB; all
        further ones have AABBs only (paper 3, chapter 4). So (0, 0) is the AABB tree; the sphere tree has no second.
    Degenerate triangles are points and segments; a tree without triangles overlaps nothing. Raises InputError
    for arrays of another shape or type, coordinates that are not finite, and nodes that do not exist.
    Trap: the tree stays where it was last fitted; after the points have moved, call ``refit`` before any search.
    """

    def __init__(
        self,
        points: np.ndarray,
        triangles: np.ndarray,
        structure: str = "composite",
        depths: tuple[int, int] = DEPTHS,
    ):
        self.structure, self.depths = structure, depths
        cells = np.asarray(triangles).reshape(-1, 3) if not len(triangles) else np.asarray(triangles)
        if cells.ndim != 2 or cells.shape[1] != 3 or (len(cells) and cells.dtype.kind not in "iu"):
            raise InputError(
                f"triangles of a tree are {cells.dtype} {cells.shape}; give (m, 3) whole numbers of nodes."
            )
        self.triangles = np.ascontiguousarray(cells, dtype=np.int64)
        self.rebuild(points)

    def rebuild(self, points: np.ndarray) -> None:
        """Split the triangles anew at ``points`` (n, 3) [m], and fit the tree to them."""
        points = coordinates(points, POINTS, "points of a tree")
        if not np.isfinite(points).all():
            raise InputError(NOT_FINITE)
        if len(self.triangles) and not 0 <= self.triangles.min() <= self.triangles.max() < len(points):
            raise InputError(f"triangles of a tree name nodes that do not exist; there are {len(points)} points.")
        self.nodes, self.order, self.height = self._divide(*build_tree.triangle_boxes(points, self.triangles))
        self._leaf_triangles = self.triangles[self.order]
        self._allocate()
        self._gather(points)
        if self.structure == "obb":
            build_tree.choose_axes(self.nodes, self._corners, self._frames, self._axes)
        self._fit(0.0)
        self._built_cost = self._cost()

    def refit(self, points: np.ndarray, margin: float = 0.0) -> None:
        """Fit the volumes to ``points`` (n, 3) [m].

        Every volume then contains all points within ``margin`` [m], 0 or more, of its triangles; so a search finds all
        pairs that are as near as the sum of both trees' margins.
        Raises InputError for another number of points, and for coordinates that are not finite.
        """
        points = coordinates(points, POINTS, "points of a tree")
        if len(points) != len(self.points):
            raise InputError(f"a tree over {len(self.points)} points was refitted to another number; make a new one.")
        self._gather(points)
        # rounding must not reduce the margin
        self._fit(margin + 2.0**-50 * (margin + np.abs(self._corners).max(initial=0.0)) if margin else 0.0)

    @property
    def quality(self) -> float:
        """Cost of a search when last built over that of now: 1 as built, less the more the tree has degraded.

        The cost is the surface of all nodes' AABBs over the root's, since random boxes overlap a node as often as its
        surface is large (MacDonald, Booth 1990); margins do not count.
        """
        now = self._cost()
        return self._built_cost / now if now > 0.0 else 1.0

    @property
    def needs_rebuild(self) -> bool:
        """True where the quality has fallen below REBUILD_QUALITY: rebuild before the next search."""
        return self.quality < REBUILD_QUALITY

    def _divide(self, boxes: np.ndarray, centres: np.ndarray) -> tuple[np.ndarray, np.ndarray, int]:
        """Split triangles with these boxes (m, 6) and centres (m, 3) into nodes, whose kind is still their level."""
        return build_tree.build(boxes, centres, build_tree.LEAF)

    def _allocate(self) -> None:
        """Allocate the volumes, and set what kind each node has, by the structure and the level."""
        n, levels = len(self.nodes), self.nodes[:, KIND].copy()
        self._corners, self.spheres = np.empty((3 * len(self.triangles), 3)), np.empty((0, 4))
        self.nodes[:, KIND] = KINDS.get(self.structure, AABB)
        if self.structure == "composite":
            self.nodes[levels < sum(self.depths), KIND] = BOTH
            self.nodes[levels < self.depths[0], KIND] = SPHERE
        if self.structure in ("composite", "sphere"):
            self.spheres = np.empty((n, 4))
        if self.structure == "obb":
            self.boxes = np.empty((n, 15))
            self._frames, self._axes = np.empty((n, 2), np.int64), np.empty((n, 3, 3))
        else:
            self.boxes = np.empty((n, 2 * len(DIRECTIONS.get(self.structure, DIRECTIONS["aabb"]))))

    def _gather(self, points: np.ndarray) -> None:
        if not build_tree.gather_corners(points, self._leaf_triangles, self._corners):
            raise InputError(NOT_FINITE)
        self.points = points

    def _fit(self, pad: float) -> None:
        if not len(self.triangles):
            return
        fitted = (self.nodes, self._corners, pad)
        if self.structure == "obb":
            build_tree.refit_obbs(*fitted, self._frames, self._axes, self.boxes)
        elif self.structure in ("dop14", "dop18"):
            build_tree.refit_dops(*fitted, DIRECTIONS[self.structure], self.boxes)
        else:
            build_tree.refit_boxes(*fitted, self.boxes, self.spheres)

    def _cost(self) -> float:
        return build_tree.box_areas(self.nodes, self._corners) if len(self.triangles) else 0.0
