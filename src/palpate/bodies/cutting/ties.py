"""A body made with its cut, whose doubled nodes stay tied to each other until the blade has passed between them.

So nothing but ties changes while a blade moves: elements, nodes, positions and velocities stay, and so does the energy.
What is joined at any time is what ``sever`` would find: nodes are one that a chain of faces joins.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from palpate.bodies.body import Body
from palpate.bodies.cutting import settings
from palpate.bodies.cutting.conform import cut_body
from palpate.bodies.cutting.cut import Blade, Cut, Cuts, make_cut
from palpate.bodies.cutting.ways import SPLIT_FACES, Parted, part
from palpate.bodies.mesh import FACES, TetMesh, components
from palpate.bodies.particles import Particles, particles_of
from palpate.errors import InputError

CONFORM = "conform"
"""The way in which the mesh is changed so that faces of it are the cut."""
ON_FACE = 1e-6
"""Distance over the size of the body by which a face may be nearer to one cut than to another and be of both."""


class Stroke(NamedTuple):
    """A cut that is made from ``at_s`` [s] on, within ``lasts_s`` [s], at an even speed along the blade's path."""

    cut: Cut
    at_s: float
    lasts_s: float

    def passes_s(self, points: np.ndarray) -> np.ndarray:
        """Return when (n,) [s] the blade is where ``points`` (n, 3) [m] are nearest to the cut."""
        shares = self.cut.share(points) if isinstance(self.cut, Blade) else np.zeros(len(points))
        return self.at_s + self.lasts_s * shares


@dataclass(frozen=True, eq=False)
class Ties:
    """Which of the n nodes of a cut body are still one.

    pairs : (k, 2) nodes at one place, which are one until ``let_go_s`` (k,) [s]
    triangles : (t, 3) the surface when all is cut, lips included
    first : (n,) the nodes in the order in which they lead others
    """

    pairs: np.ndarray
    let_go_s: np.ndarray
    triangles: np.ndarray
    first: np.ndarray

    def leaders(self, t: float = -np.inf) -> np.ndarray:
        """Return (n,) the node that each one moves with at ``t`` [s]: of those tied together, the first in order."""
        count = len(self.first)
        groups = components(self.pairs[self.let_go_s > t], count)
        leader_of_group = np.full(count, -1)
        leader_of_group[groups[self.first[::-1]]] = self.first[::-1]  # the last one written is the first of the group
        return leader_of_group[groups]

    def surface(self, leaders: np.ndarray) -> np.ndarray:
        """Return the surface's triangles (m, 3), by the ``leaders`` (n,) of its nodes, without lips that are closed."""
        tied = leaders[self.triangles]
        _, face, copies = np.unique(np.sort(tied, axis=1), axis=0, return_inverse=True, return_counts=True)
        return tied[copies[face.ravel()] == 1]

    def beside(self, triangles: np.ndarray, count: int) -> "Ties":
        """Return the ties of several bodies with ``count`` nodes, this one first; triangles (m, 3) : of the others."""
        first = np.append(self.first, np.arange(len(self.first), count))
        return replace(self, triangles=np.vstack([self.triangles, triangles]), first=first)


def cut_particles(place: str, body: Body, level: int, options: settings.Cut) -> Particles:
    """Make the particles of one level of ``body`` with the ties of the cuts in the settings ``options``.

    place : of the scene
    The surface of the particles is the skin. Raises InputError for settings of no cut, and for one that severs nothing.
    """
    if body.bed is not None:
        raise InputError(f"{place}.cut: {body.name} lies on a bed, which lips would rest on; give it anchors.")
    strokes = []
    for number, entry in enumerate([options, *(options.more or [])]):
        setting = f"{place}.cut" if number == 0 else f"{place}.cut.more[{number - 1}]"
        stroke = Stroke(make_cut(setting, entry, body.fine), entry.at_s, entry.lasts_s)
        if stroke.lasts_s > 0.0 and not isinstance(stroke.cut, Blade):
            raise InputError(f"{setting}.lasts_s is {stroke.lasts_s:g} s, and only a blade has a path; set it to 0.")
        strokes.append(stroke)
    way = options.way
    doubled = _conforming(body, level, strokes) if way == CONFORM else _parted(body, level, strokes, way)
    particles = particles_of(doubled.body, 0, surface=False)
    if len(particles.nodes) == len(doubled.whole.nodes):
        raise InputError(
            f"{place}.cut severs nothing of level {level} of {body.name}: it misses the body, or is smaller than an "
            "element; move it, make it deeper, or take a finer level."
        )
    pairs = np.stack([doubled.first, doubled.last], axis=-1).reshape(-1, 2)
    distinct, let_go_s = pairs[:, 0] != pairs[:, 1], np.repeat(doubled.let_go_s, 3)
    held = np.isin(np.arange(len(particles.nodes)), particles.held)
    ties = Ties(pairs[distinct], let_go_s[distinct], particles.triangles, np.argsort(~held, kind="stable"))
    return replace(particles, triangles=_skin(doubled), ties=ties)


class _Doubled(NamedTuple):
    """A cut body of one level; node i was ``origin[i]``, (n,), of the ``whole`` mesh.

    first, last : (k, 3) nodes of the faces that are parted, corner by corner, and let_go_s : (k,) [s] when
    """

    body: Body
    whole: TetMesh
    origin: np.ndarray
    first: np.ndarray
    last: np.ndarray
    let_go_s: np.ndarray


def _conforming(body: Body, level: int, strokes: Sequence[Stroke]) -> _Doubled:
    """Cut one level along faces that are moved onto the cuts, without refinement; find when [s] each face parts."""
    cuts = tuple(stroke.cut for stroke in strokes)
    no_refinement_m = body.fine.size  # no edge is longer
    opened = cut_body(body, cuts[0] if len(cuts) == 1 else Cuts(cuts), no_refinement_m, level=level)
    mesh = opened.coarse
    one_lip, other_lip, _ = _parted_faces(mesh.tetrahedra, opened.origin)
    middles = mesh.nodes[one_lip].mean(axis=1)
    # faces may lie beside their cut, where nodes could not move onto it: a face parts when the blade of the nearest cut
    # passes it, and of equally near cuts the first to pass
    distances = np.array([np.hypot(cut.across(middles), np.minimum(cut.within(middles), 0.0)) for cut in cuts])
    passes_s = np.array([stroke.passes_s(middles) for stroke in strokes])
    parts_s = np.where(distances <= distances.min(axis=0) + ON_FACE * mesh.size, passes_s, np.inf).min(axis=0)
    return _Doubled(opened, opened.whole, opened.origin, one_lip, other_lip, parts_s)


def _parted(body: Body, level: int, strokes: Sequence[Stroke], way: str) -> _Doubled:
    """Cut one level along faces of its mesh, or with virtual nodes; find when [s] each face parts."""
    parted = part(body, level, [stroke.cut for stroke in strokes], way)
    one_lip, other_lip, elements = _parted_faces(parted.mesh.tetrahedra, parted.origin)
    parents = parted.parents[elements]
    element_middles = parted.whole.nodes[parted.whole.tetrahedra].mean(axis=1)
    face_middles, parts_s = parted.mesh.nodes[one_lip].mean(axis=1), np.full(len(one_lip), np.inf)
    for c, stroke in enumerate(strokes):
        on_two_sides = np.flatnonzero(parted.sides[elements, c].prod(axis=1) < 0)
        ends = element_middles[parents[on_two_sides]]
        if way == SPLIT_FACES:
            sides = stroke.cut.across(ends.reshape(-1, 3)).reshape(-1, 2)
            crossing = np.divide(sides[:, 0], sides[:, 0] - sides[:, 1])[:, None]
            passes_s = stroke.passes_s(ends[:, 0] + crossing * (ends[:, 1] - ends[:, 0]))
            passes_s[~stroke.cut.severs(ends[:, 0], ends[:, 1])] = np.inf
        else:
            # parts of an element come apart as the blade passes its middle, and faces beside them need no tie (-inf)
            one_element = parents[on_two_sides, 0] == parents[on_two_sides, 1]
            divided = _divided(parted, c)[parents[on_two_sides]].any(axis=1)
            passes_s = np.where(one_element, stroke.passes_s(ends[:, 0]), np.where(divided, -np.inf, np.inf))
            between = ~divided & (stroke.cut.within(face_middles[on_two_sides]) > 0.0)
            passes_s[between] = stroke.passes_s(face_middles[on_two_sides[between]])
        parts_s[on_two_sides] = np.minimum(parts_s[on_two_sides], passes_s)
    return _Doubled(parted.body, parted.whole, parted.origin, one_lip, other_lip, parts_s)


def _parted_faces(tetrahedra: np.ndarray, origin: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return pairs of faces that were one before the cut: nodes (k, 3) of both, corner by corner; elements (k, 2)."""
    nodes = tetrahedra[:, FACES].reshape(-1, 3)
    nodes = np.take_along_axis(nodes, np.argsort(origin[nodes], axis=1), axis=1)
    order = np.lexsort(origin[nodes].T)
    places, pairs = origin[nodes[order]], [np.empty((0, 2), dtype=np.int64)]
    for step in range(1, len(nodes)):
        equal = np.flatnonzero((places[step:] == places[:-step]).all(axis=1))
        if not len(equal):
            break
        pairs.append(np.column_stack([order[equal], order[equal + step]]))
    one_side, other_side = np.concatenate(pairs).T
    differ = (nodes[one_side] != nodes[other_side]).any(axis=1)
    one_side, other_side = one_side[differ], other_side[differ]
    return nodes[one_side], nodes[other_side], np.column_stack([one_side, other_side]) // 4


def _divided(parted: Parted, cut_number: int) -> np.ndarray:
    """Return which elements of the whole body have parts on both sides of a cut, (m,) bool."""
    has_part = np.zeros((len(parted.whole.tetrahedra), 2), dtype=bool)
    for side, sign in enumerate((-1, 1)):
        has_part[parted.parents[parted.sides[:, cut_number] == sign], side] = True
    return has_part[:, 0] & has_part[:, 1]


def _skin(doubled: _Doubled) -> np.ndarray:
    """Return the uncut body's surface triangles (t, 3), by nodes of that part of their element with most tissue."""
    faces = doubled.body.coarse.tetrahedra[:, FACES].reshape(-1, 3)
    tissue_share = doubled.body.tissue(0).share
    order = np.arange(len(faces)) if tissue_share is None else np.argsort(-np.repeat(tissue_share, 4), kind="stable")
    skin = np.sort(doubled.whole.triangles, axis=1)
    originals = np.sort(doubled.origin[faces[order]], axis=1)
    _, first_row, kinds = np.unique(np.vstack([originals, skin]), axis=0, return_index=True, return_inverse=True)
    return faces[order[first_row[kinds.ravel()[len(originals) :]]]]
