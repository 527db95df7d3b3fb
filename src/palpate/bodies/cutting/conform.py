"""Change a mesh so that a cut's patch consists of faces, and its front of edges; the skin keeps its shape.

Elements near the cut are made small first. Nodes close to the surface are moved onto it, as in isosurface stuffing
(Labelle and Shewchuk 2007), within the flat parts of the skin; what still crosses is halved where it crosses, edge by
edge. Then the nodes of the surface do the same with the front. Nodes of bad elements are moved at the end.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from palpate.bodies.body import Body
from palpate.bodies.cutting.cut import Cut, Piece
from palpate.bodies.cutting.sever import inner_faces, sever
from palpate.bodies.local_refinement import LocalRefinement
from palpate.bodies.material import Tissue
from palpate.bodies.mesh import EDGES, Around, Mesh, Sheet, TetMesh, area_normals, edge_lengths, triangle_edges, unit
from palpate.errors import InputError

ON_SURFACE = 1e-9
"""Distance over the size of the body within which a node lies on the surface."""
CLOSE_OF_EDGE = 0.3
"""Share of an edge that crosses the surface within which its end is moved onto it."""
GIVEN_OF_EDGE = 0.12
"""The same share for ends that may not move: within it the cut bends to the node."""
LEAST_QUALITY, KEPT_QUALITY = 0.1, 0.4
"""Quality below which no move may bring an element, and the share of its own that it keeps."""
BAD_QUALITY, ROUNDS = 0.25, 8
"""Quality below which an element's nodes are moved for its sake, and how often."""
HALVINGS = 52
"""Halvings of an edge after which the place where it crosses is exact."""
STEEP = 0.04
"""Square of the least slope of a level along the ways in which a node may move to it."""
SLENDER = 0.7
"""Longest edge at the front over the patch's smaller half width: no edge crosses a patch from side to side."""
REACH = 0.8
"""Longest edges of the elements that are halved within which they are, around the patch and its front."""
FOOT_STEPS = 12
"""Steps of Newton's method to such a place."""
SHIFTS, GAIN = (0.05, 0.15, 0.3), 1e-3
"""Shares of a node's shortest edge by which it is moved on trial, and the least gain in quality of a move."""
MARGIN = 1.5
"""Edges beyond the front that the mesh conforms to the surface."""
COPLANAR = 1e-6
"""Sine of the angle between the normals of triangles that count as one plane."""

Level = Callable[[np.ndarray], np.ndarray]
"""A function of points (n, 3) [m] to (n,) [m]."""


@dataclass(frozen=True, eq=False, kw_only=True)
class CutBody(Body):
    """A body with one level that conforms to a cut, whose lips have nodes of their own.

    cut : the cut
    lips : (k, 2, 3) nodes of each severed face, corner by corner: on the cut's positive side, then on its negative one
    front : (m, 2) nodes of the edges where the patch ends inside the body
    whole : the mesh before it was severed; node i of ``coarse`` was ``origin[i]``, (n,), of it
    """

    cut: Cut
    lips: np.ndarray
    front: np.ndarray
    whole: TetMesh
    origin: np.ndarray


def cut_body(body: Body, cut: Cut, edge_m: float, front_m: float | None = None, level: int = -1) -> CutBody:
    """Return the body with one level: ``level`` of ``body``, refined near ``cut``, made to conform to it, and severed.

    edge_m : longest edges near the patch [m]; front_m : near its front, by default the same
    Raises InputError for a sheet.
    """
    if isinstance(body.coarse, Sheet):
        raise InputError(f"{body.name} is a sheet, which cannot be cut; cut a solid body.")
    level_body = body.from_level(range(len(body.levels))[level]).up_to(0)
    local = _refined(level_body, cut, edge_m, edge_m if front_m is None else front_m)
    mesh = Conforming(local.fine, np.isin(np.arange(len(local.fine.nodes)), local.anchors[-1]))
    for piece in cut.pieces:
        mesh.conform(piece)
    mesh.widen()
    mesh.improve()
    whole_mesh = TetMesh(mesh.nodes, mesh.tetrahedra)
    faces, elements = inner_faces(whole_mesh)
    sides = mesh.sides(faces, elements[:, 0])
    severed = sever(whole_mesh, faces, elements, sides != 0)
    # the lip on the cut's positive side is to come first; of a swapped pair the corners turn, too
    lips, swapped = severed.lips.copy(), sides[sides != 0] < 0
    lips[swapped] = lips[swapped][:, ::-1][:, :, [0, 2, 1]]
    tissue = local.tissue(len(local.levels) - 1)
    regions = None if body.regions is None else Tissue(tissue.materials, tissue.region[mesh.parents])
    densities = None if local.densities is None else [mesh.spread(local.densities[-1])[severed.origin]]
    anchors = np.flatnonzero(mesh.held[severed.origin])
    return CutBody(
        body.name,
        [severed.mesh],
        [],
        [anchors],
        body.material,
        body.bed,
        regions,
        densities,
        cut=cut,
        lips=lips[severed.apart],
        front=severed.front,
        whole=whole_mesh,
        origin=severed.origin,
    )


def _refined(body: Body, cut: Cut, edge_m: float, front_m: float) -> Body:
    """Refine a body until edges near the patch are at most ``edge_m`` long, and near its front ``front_m`` [m].

    Where the cut is narrow, edges near the front are at most SLENDER times as long as it is wide there.
    """
    if not cut.pieces:
        return body
    front_m = min(front_m, SLENDER * cut.narrow_m)
    patch, front = cut.patch(0.5 * edge_m), cut.front(0.5 * front_m)
    if (longest_m := _longest_near(body.coarse, patch)) == 0.0:
        return body
    levels = [max(0, int(np.ceil(np.log2(longest_m / each)))) for each in (edge_m, front_m)]
    halvings = max(levels)
    if halvings == 0:
        return body
    steps = np.arange(halvings)
    targets = [patch if each < levels[0] else front for each in steps]
    return LocalRefinement(body, halvings).around(targets, (REACH * longest_m / 2.0**steps).tolist())


def _longest_near(mesh: Mesh, points: np.ndarray) -> float:
    """Return the longest edge [m] of the elements that any of ``points`` (n, 3) [m] lies in, 0 if there is none."""
    corners = mesh.nodes[mesh.tetrahedra]
    low, high = corners.min(axis=1), corners.max(axis=1)
    longest = np.linalg.norm(corners[:, EDGES[:, 0]] - corners[:, EDGES[:, 1]], axis=2).max(axis=1)
    contains = np.array([((points >= a) & (points <= b)).all(axis=1).any() for a, b in zip(low, high, strict=True)])
    return float(longest[contains].max(initial=0.0))


def qualities(corners: np.ndarray) -> np.ndarray:
    """Return 1 for a regular tetrahedron, 0 for a flat one and less for an inverted one; corners : (..., 4, 3)."""
    sides = corners[..., EDGES[:, 0], :] - corners[..., EDGES[:, 1], :]
    mean_square = (sides**2).sum(axis=(-1, -2)) / 6.0
    a, b, c = (corners[..., i, :] - corners[..., 0, :] for i in (1, 2, 3))
    volume = (np.cross(a, b) * c).sum(axis=-1)
    return np.sqrt(2.0) * volume / mean_square**1.5


class Conforming:
    """A mesh that is changed to conform to one flat piece of a cut after the other.

    nodes : (n, 3) [m]; tetrahedra : (m, 4); parents : (m,) the elements of the first mesh that these are parts of
    held : (n,) bool; held nodes of elements with free nodes never move
    """

    def __init__(self, mesh: Mesh, held: np.ndarray):
        self.nodes, self.tetrahedra = mesh.nodes.copy(), mesh.tetrahedra
        self.parents, self.held = np.arange(len(mesh.tetrahedra)), held
        self._near, self._first = ON_SURFACE * mesh.size, len(mesh.nodes)
        self._pieces: list[Piece] = []
        # marks of the nodes on the planes of the pieces, (n, pieces) bool, and of those at the front of any, (n,)
        self._on, self._rim = np.zeros((len(held), 0), dtype=bool), np.zeros(len(held), dtype=bool)
        self._ends, self._shares = np.empty((0, 2), dtype=np.int64), np.empty(0)

    def conform(self, piece: Piece) -> None:
        """Make the patch of a flat piece consist of faces, and its front of edges."""
        self._pieces.append(piece)
        self._on = np.column_stack([self._on, np.zeros(len(self.nodes), dtype=bool)])
        self._on[:, -1] = self._conform_to(piece.across, np.ones(len(self.nodes), dtype=bool))
        front = self._conform_to(piece.within, self._on[:, -1])  # which makes the arrays longer
        self._rim |= front

    def sides(self, faces: np.ndarray, elements: np.ndarray) -> np.ndarray:
        """Return (k,) the cut's side, 1 or -1, of ``elements`` (k,) at ``faces`` (k, 3) in the patch; 0 outside it."""
        signs = np.zeros(len(faces))
        for number, piece in enumerate(self._pieces):
            on_piece = np.flatnonzero(self._on[faces, number].all(axis=1))
            middles = self.nodes[faces[on_piece]].mean(axis=1)
            on_piece, middles = on_piece[inside := piece.within(middles) > 0.0], middles[inside]
            to_element = self.nodes[self.tetrahedra[elements[on_piece]]].mean(axis=1) - middles
            signs[on_piece] = np.where(to_element @ piece.normal > 0.0, 1.0, -1.0)
        return signs

    def spread(self, values: np.ndarray) -> np.ndarray:
        """Interpolate ``values`` at the nodes of the first mesh linearly to all nodes, (n,)."""
        values = np.append(values, np.empty(len(self._ends)))
        for node, ((start, end), share) in enumerate(zip(self._ends, self._shares, strict=True), start=self._first):
            values[node] = (1.0 - share) * values[start] + share * values[end]
        return values

    def _conform_to(self, level: Level, movable: np.ndarray) -> np.ndarray:
        """Conform to the surface where ``level`` is 0: move near nodes onto it, then divide the edges that cross it.

        movable : (n,) bool, the nodes whose edges may be divided
        Returns which nodes, old and new, are on the surface then, (n,) bool.
        """
        value = level(self.nodes)
        on_level = movable & (np.abs(value) <= self._near)
        value[on_level] = 0.0
        edges = self._crossing(value, movable)
        shares = np.abs(value[edges]) / np.abs(value[edges]).sum(axis=1, keepdims=True)
        least_share, shortest = np.full(len(self.nodes), np.inf), np.full(len(self.nodes), np.inf)
        for end in (0, 1):
            np.minimum.at(least_share, edges[:, end], shares[:, end])
            np.minimum.at(shortest, edges[:, end], edge_lengths(self.nodes, edges))
        around, projection = Around(self.tetrahedra, len(self.nodes)), self._free_directions()
        for node in sorted(np.flatnonzero(least_share < CLOSE_OF_EDGE).tolist(), key=least_share.__getitem__):
            target = self._place_on(level, node, projection(node), CLOSE_OF_EDGE * shortest[node])
            if target is not None and self._may_move(node, target, around):
                self.nodes[node] = target
            elif not (least_share[node] < GIVEN_OF_EDGE and self._stays_solid(node, on_level, around)):
                continue
            on_level[node], value[node] = True, 0.0
        edges = self._crossing(value, movable)
        edges = edges[np.argsort(-edge_lengths(self.nodes, edges), kind="stable")]
        self._halve(edges, _roots(level, *np.swapaxes(self.nodes[edges], 0, 1)))
        return np.append(on_level, np.ones(len(edges), dtype=bool))

    def widen(self) -> None:
        """Halve edges that run inside the patch from front to front, as both lips would stay joined along them."""
        mesh = TetMesh(self.nodes, self.tetrahedra)
        faces, elements = inner_faces(mesh)
        edges, count = triangle_edges(faces[self.sides(faces, elements[:, 0]) != 0.0])
        factors = [len(self.nodes), 1]
        inside = (count > 1) | np.isin(edges @ factors, triangle_edges(mesh.triangles)[0] @ factors)
        edges = edges[inside & self._rim[edges].all(axis=1)]
        self._halve(edges, np.full(len(edges), 0.5))

    def _crossing(self, value: np.ndarray, movable: np.ndarray) -> np.ndarray:
        """Return the edges (k, 2) between nodes ``movable`` (n,) bool along which ``value`` (n,) changes its sign.

        They are near the last piece's patch: up to MARGIN edges beyond its front, which has to lie within faces.
        """
        edges = TetMesh(self.nodes, self.tetrahedra).edges
        edges = edges[(value[edges[:, 0]] * value[edges[:, 1]] < 0.0) & movable[edges].all(axis=1)]
        within = self._pieces[-1].within(self.nodes[edges].reshape(-1, 3)).reshape(-1, 2)
        return edges[within.max(axis=1) > -MARGIN * edge_lengths(self.nodes, edges)]

    def _free_directions(self) -> Callable[[int], np.ndarray]:
        """Return the function from a node to the projection (3, 3) onto the directions in which it may move.

        A node on the skin stays in the planes of its triangles, and a node on the cut in the planes of its pieces.
        """
        triangles = TetMesh(self.nodes, self.tetrahedra).triangles
        normals = unit(area_normals(self.nodes, triangles))
        skin, planes = Around(triangles, len(self.nodes)), np.array([piece.normal for piece in self._pieces])
        # a node all of whose elements are held may move at rest, as no force acts there
        held = self.held[self.tetrahedra]
        still = self._rim.copy()
        still[self.tetrahedra[held & ~held.all(axis=1, keepdims=True)]] = True

        def project(node: int) -> np.ndarray:
            if still[node]:
                return np.zeros((3, 3))
            rows = np.vstack([normals[skin.of(node)], planes[self._on[node]]])
            if not len(rows):
                return np.eye(3)
            _, values, directions = np.linalg.svd(rows)
            rank = int((values > COPLANAR * np.sqrt(len(rows))).sum())
            return directions[rank:].T @ directions[rank:]

        return project

    def _place_on(self, level: Level, node: int, projection: np.ndarray, reach_m: float) -> np.ndarray | None:
        """Return where (3,) [m] Newton's method takes a node to ``level`` = 0 in free directions; None if too far."""
        place, step = self.nodes[node].copy(), 100.0 * self._near * np.eye(3)
        for _ in range(FOOT_STEPS):
            value = float(level(place[None])[0])
            if abs(value) <= 0.01 * self._near:
                return place
            slope = projection @ (level(place + step) - level(place - step)) / (200.0 * self._near)
            if (squared := float(slope @ slope)) < STEEP:
                return None
            place -= (value / squared) * slope
            if np.linalg.norm(place - self.nodes[node]) > reach_m:
                return None
        return None

    def _may_move(self, node: int, to: np.ndarray, around: Around) -> bool:
        """Return whether the elements around a node stay good when it moves."""
        elements = self.tetrahedra[around.of(node)]
        corners = self.nodes[elements]
        before = qualities(corners)
        corners[elements == node] = to
        return bool((qualities(corners) >= np.maximum(LEAST_QUALITY, KEPT_QUALITY * before)).all())

    def _stays_solid(self, node: int, there: np.ndarray, around: Around) -> bool:
        """Return whether no element has all its nodes on the surface, ``there`` (n,) bool, once ``node`` is on it."""
        corners = self.tetrahedra[around.of(node)]
        return not (there[corners] | (corners == node)).all(axis=1).any()

    def _halve(self, edges: np.ndarray, share: np.ndarray) -> None:
        """Put a node on each of ``edges`` (k, 2), at ``share`` (k,) of its length; split the elements there in two."""
        ends, count = self.nodes[edges], len(self.nodes)
        self.nodes = np.vstack([self.nodes, ends[:, 0] + share[:, None] * (ends[:, 1] - ends[:, 0])])
        self.held = np.append(self.held, self.held[edges].all(axis=1))
        self._on = np.vstack([self._on, self._on[edges].all(axis=1)])
        self._rim = np.append(self._rim, np.zeros(len(edges), dtype=bool))
        self._ends, self._shares = np.vstack([self._ends, edges]), np.append(self._shares, share)
        keys = np.sort(edges, axis=1) @ [count, 1]
        ranked = np.append(np.argsort(keys), -1)
        keys = np.append(keys[ranked[:-1]], count**2)
        while True:
            # split each element at that one of its edges to halve that is first in ``edges``, as its neighbours do
            ends = np.sort(self.tetrahedra[:, EDGES], axis=2)
            key = np.where(ends.max(axis=2) < count, ends @ [count, 1], -1)
            row = np.searchsorted(keys, key)
            rank = np.where(keys[row] == key, ranked[row], len(keys))
            first_edge = rank.argmin(axis=1)
            rank = rank[np.arange(len(rank)), first_edge]
            split = np.flatnonzero(rank < len(keys))
            if not len(split):
                return
            halves = np.repeat(self.tetrahedra[split][:, None], 2, axis=1)
            for half in (0, 1):
                halves[np.arange(len(split)), half, EDGES[first_edge[split], half]] = count + rank[split]
            self.tetrahedra = np.vstack([np.delete(self.tetrahedra, split, axis=0), halves.reshape(-1, 4)])
            self.parents = np.append(np.delete(self.parents, split), np.repeat(self.parents[split], 2))

    def improve(self) -> None:
        """Move the nodes of bad elements to where the worst element around them is better, if there is such a place."""
        around, projection = Around(self.tetrahedra, len(self.nodes)), self._free_directions()
        moved = self._on.any(axis=1) | (np.arange(len(self.nodes)) >= self._first)
        near_cut = moved[self.tetrahedra].any(axis=1)
        for _ in range(ROUNDS):
            bad = near_cut & (qualities(self.nodes[self.tetrahedra]) < BAD_QUALITY)
            if not sum(self._move_to_best(node, projection(node), around) for node in np.unique(self.tetrahedra[bad])):
                return

    def _move_to_best(self, node: int, projection: np.ndarray, around: Around) -> bool:
        """Move a node in its free directions to the best of some places; return whether any is better than its own."""
        if not projection.any():
            return False
        elements = self.tetrahedra[around.of(node)]
        corners = self.nodes[elements]
        offsets = self.nodes[np.unique(elements[elements != node])] - self.nodes[node]
        length = np.linalg.norm(offsets, axis=1, keepdims=True)
        rays = np.vstack([offsets / length, -offsets / length, np.eye(3), -np.eye(3)])
        moves = np.vstack([offsets.mean(axis=0) * [[0.5], [1.0]], *(share * length.min() * rays for share in SHIFTS)])
        places = self.nodes[node] + moves @ projection
        trial_corners = np.repeat(corners[None], len(places), axis=0)
        trial_corners[:, elements == node] = places[:, None]
        quality = qualities(trial_corners).min(axis=1)
        best = int(quality.argmax())
        if quality[best] <= qualities(corners).min() + GAIN:
            return False
        self.nodes[node] = places[best]
        return True


def _roots(level: Level, first: np.ndarray, last: np.ndarray) -> np.ndarray:
    """Return the shares (n,) of the way from ``first`` to ``last``, both (n, 3) [m], at which ``level`` is 0."""
    low, high, sign = np.zeros(len(first)), np.ones(len(first)), np.sign(level(first))
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        same_sign = np.sign(level(first + middle[:, None] * (last - first))) == sign
        low, high = np.where(same_sign, middle, low), np.where(same_sign, high, middle)
    return 0.5 * (low + high)
