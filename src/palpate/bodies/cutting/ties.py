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
        """Return the node (n,) that each one moves with at ``t`` [s], itself where nothing ties it to one before it."""
        count = len(self.first)
        group = components(self.pairs[self.let_go_s > t], count)
        leads = np.full(count, -1)
        leads[group[self.first[::-1]]] = self.first[::-1]  # the last one written is the first of the group
        return leads[group]

    def surface(self, leaders: np.ndarray) -> np.ndarray:
        """Return the triangles (m, 3) of the surface while nodes are tied to ``leaders``: lips that are open only."""
        tied = leaders[self.triangles]
        _, kind, count = np.unique(np.sort(tied, axis=1), axis=0, return_inverse=True, return_counts=True)
        return tied[count[kind.ravel()] == 1]

    def beside(self, triangles: np.ndarray, count: int) -> "Ties":
        """Return the same where the body is the first of several with ``count`` nodes; triangles : of the others."""
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
    differ, let_go_s = pairs[:, 0] != pairs[:, 1], np.repeat(doubled.let_go_s, 3)
    held = np.isin(np.arange(len(particles.nodes)), particles.held)
    ties = Ties(pairs[differ], let_go_s[differ], particles.triangles, np.argsort(~held, kind="stable"))
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
    """Cut one level, made to conform to the cuts without being refined near them; find when each face parts."""
    cuts = tuple(stroke.cut for stroke in strokes)
    no_refinement_m = body.fine.size  # no edge is longer
    opened = cut_body(body, cuts[0] if len(cuts) == 1 else Cuts(cuts), no_refinement_m, level=level)
    mesh = opened.coarse
    first, last, _ = _parted_faces(mesh.tetrahedra, opened.origin)
    faces = mesh.nodes[first].mean(axis=1)
    # the patch bends to nodes that may not move, so that a face need not lie on its cut: it parts with the nearest cut,
    # and of equally near ones with that which passes first
    away = np.array([np.hypot(cut.across(faces), np.minimum(cut.within(faces), 0.0)) for cut in cuts])
    passed = np.array([stroke.passes_s(faces) for stroke in strokes])
    let_go = np.where(away <= away.min(axis=0) + ON_FACE * mesh.size, passed, np.inf).min(axis=0)
    return _Doubled(opened, opened.whole, opened.origin, first, last, let_go)


def _parted(body: Body, level: int, strokes: Sequence[Stroke], way: str) -> _Doubled:
    """Cut one level along faces of its mesh, or with virtual nodes; find when each face parts."""
    parted = part(body, level, [stroke.cut for stroke in strokes], way)
    first, last, elements = _parted_faces(parted.mesh.tetrahedra, parted.origin)
    parents = parted.parents[elements]
    middles = parted.whole.nodes[parted.whole.tetrahedra].mean(axis=1)
    faces, let_go = parted.mesh.nodes[first].mean(axis=1), np.full(len(first), np.inf)
    for c, stroke in enumerate(strokes):
        apart = np.flatnonzero(parted.sides[elements, c].prod(axis=1) < 0)
        ends = middles[parents[apart]]
        if way == SPLIT_FACES:
            sides = stroke.cut.across(ends.reshape(-1, 3)).reshape(-1, 2)
            share = np.divide(sides[:, 0], sides[:, 0] - sides[:, 1])[:, None]
            passed = stroke.passes_s(ends[:, 0] + share * (ends[:, 1] - ends[:, 0]))
            passed[~stroke.cut.severs(ends[:, 0], ends[:, 1])] = np.inf
        else:
            # the parts of an element are one until the blade has passed its middle, and with them all that they join
            one_element = parents[apart, 0] == parents[apart, 1]
            divided = _divided(parted, c)[parents[apart]].any(axis=1)
            passed = np.where(one_element, stroke.passes_s(ends[:, 0]), np.where(divided, -np.inf, np.inf))
            between = ~divided & (stroke.cut.within(faces[apart]) > 0.0)
            passed[between] = stroke.passes_s(faces[apart[between]])
        let_go[apart] = np.minimum(let_go[apart], passed)
    return _Doubled(parted.body, parted.whole, parted.origin, first, last, let_go)


def _parted_faces(tetrahedra: np.ndarray, origin: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return pairs of faces that were one and have different nodes now: nodes (k, 3) of both, and elements (k, 2)."""
    faces = tetrahedra[:, FACES].reshape(-1, 3)
    faces = np.take_along_axis(faces, np.argsort(origin[faces], axis=1), axis=1)
    order = np.lexsort(origin[faces].T)
    place, pairs = origin[faces[order]], [np.empty((0, 2), dtype=np.int64)]
    for step in range(1, len(faces)):
        same = np.flatnonzero((place[step:] == place[:-step]).all(axis=1))
        if not len(same):
            break
        pairs.append(np.column_stack([order[same], order[same + step]]))
    first, last = np.concatenate(pairs).T
    differ = (faces[first] != faces[last]).any(axis=1)
    first, last = first[differ], last[differ]
    return faces[first], faces[last], np.column_stack([first, last]) // 4


def _divided(parted: Parted, c: int) -> np.ndarray:
    """Return which elements of the whole body have parts on both sides of cut number ``c``, (m,) bool."""
    has_part = np.zeros((len(parted.whole.tetrahedra), 2), dtype=bool)
    for side, sign in enumerate((-1, 1)):
        has_part[parted.parents[parted.sides[:, c] == sign], side] = True
    return has_part[:, 0] & has_part[:, 1]


def _skin(doubled: _Doubled) -> np.ndarray:
    """Return the triangles (t, 3) of the uncut body's surface, each of the part of its element with most tissue."""
    faces = doubled.body.coarse.tetrahedra[:, FACES].reshape(-1, 3)
    share = doubled.body.tissue(0).share
    order = np.arange(len(faces)) if share is None else np.argsort(-np.repeat(share, 4), kind="stable")
    skin = np.sort(doubled.whole.triangles, axis=1)
    originals = np.sort(doubled.origin[faces[order]], axis=1)
    _, first, kind = np.unique(np.vstack([originals, skin]), axis=0, return_index=True, return_inverse=True)
    return faces[order[first[kind.ravel()[len(originals) :]]]]
