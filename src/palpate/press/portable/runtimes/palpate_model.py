"""Answer presses on a body from a portable model file: numpy is all that it needs.

The format is described in docs/portable-model.md; palpate.js and palpate.c beside this file do the same.
"""

import json
import math
import struct
import zlib
from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

MAGIC, VERSION, HEAD = b"palpate\n", 2, 144
SCALARS = (
    *("radius_m", "guard", "far", "hard", "farthest_m", "floor"),
    *("share", "spread", "several", "peak_m", "hardest_n", "places"),
)
RESIDUAL_TOLERANCE, ITERATIONS = 1e-6, 200
FORCE_SEARCH_TOLERANCE, FIRST_TOLERANCE, MOST_SEARCH_STEPS = 1e-6, 0.1, 40
HELD_COMPLIANCE, LEAST_EIGENVALUE, MOST_MISSED = 2e-3, 0.03, 0.1
APART = "the nearest place that was prepared"
MOST_MODES, MOST_CELLS, MOST_VECTORS, MOST_PARTS, MOST_PRESSES = 256, 4096, 1024, 8, 16
TOUCH_TOLERANCE, TOUCH_ITERATIONS, TOUCH_RESIDUAL, STEEPEST, TILTED, ROUNDING = 1e-8, 60, 1e-3, 45.0, 30.0, 1.0 + 1e-6
MOST_POINTS, MOST_PUSHES, MOST_PLACES, KINDS = 16384, 256, 1024, ("sphere", "punch")
WORDS, NUMBERS = ("body", "regime", "model", "error"), ("radius_m", "peak_m", "hardest_n")


class PortableAnswer(NamedTuple):
    """The answer to presses.

    displacement : (n, 3) [m]; forces : (k, 3) [N], given or found; error : estimated RMSE over peak
    doubt : why the answer is not to be believed, or ""
    rest : for each press its contacts with their ``Rest``, from which the answer to a similar press can start
    """

    displacement: np.ndarray
    forces: np.ndarray
    error: float
    doubt: str
    rest: "list[list[tuple[Contact, Rest]]]"


class TouchAnswer(NamedTuple):
    """The answer to a rigid instrument that is pushed in.

    displacement : (n, 3) [m]; force : (3,) of the instrument on the body, force_n : along its direction [N]
    area_m2 : that touches; error : RMSE over peak, force_error : over the force, the largest of the export's trials
    doubt : why the answer is not to be believed, or ""; tip : (3,) of the instrument [m]
    """

    displacement: np.ndarray
    force: np.ndarray
    force_n: float
    area_m2: float
    error: float
    force_error: float
    doubt: str
    tip: np.ndarray


@dataclass(frozen=True, eq=False)
class TouchPlace:
    """A reduced model of one place under one instrument, in r coordinates with m cells and p points to be touched.

    node : of the surface, that the tip is held against; kind : of KINDS; a ball is a punch whose edge is its radius
    axes : (3, 3), rows: two across, and outward; first : (6,) [m], how far from the node the instrument first touches,
        a quadratic function of what its unit direction has across
    deepest_m : that was prepared; stretched : areas that touch over those at rest; error, force_error : of TouchAnswer
    tilted_error, tilted_force_error : the same of pushes that are tilted by TILTED degrees
    rest : (r, r), stiffness of all that is not in the cells; volumes, mu, lam : (m,); slopes : (9 m, r), of their F
    points : (3 p,) [m], moves : (3 p, r); areas, penalty : (p,)
    pushed : (k, 3), of past pushes along the axes, over the deepest; starts : (k, r), by which a search begins
    surface : (3 n, r)
    """

    node: int
    kind: str
    radius_m: float
    edge_m: float
    axes: np.ndarray
    first: np.ndarray
    deepest_m: float
    stretched: float
    error: float
    force_error: float
    tilted_error: float
    tilted_force_error: float
    rest: np.ndarray
    volumes: np.ndarray
    mu: np.ndarray
    lam: np.ndarray
    slopes: np.ndarray
    points: np.ndarray
    moves: np.ndarray
    areas: np.ndarray
    penalty: np.ndarray
    pushed: np.ndarray
    starts: np.ndarray
    surface: np.ndarray

    @cached_property
    def firm(self) -> np.ndarray:
        """The constant, positive part of the stiffness (r, r): of 2 μ V |δF|² in all cells, and ``rest``."""
        return self.rest + self.slopes.T @ (np.tile(2.0 * self.mu * self.volumes, 9)[:, None] * self.slopes)

    @property
    def noise(self) -> float:
        """Rounding of the energy [J]."""
        return 4e-15 * float(self.volumes @ (self.mu + self.lam))


class Contact(NamedTuple):
    """A reduced model of one place, in r coordinates with m cells and b vectors of the surface.

    place, normal, bearing : (3,); reach : energy norm; loads : (r, 3); volumes, mu, lam : (m,)
    rest : (r, r), stiffness of all that is not in the cells; slopes : (9 m, r), of the cells' F; coefficients : (b, r)
    here : (3, b), the mean of the vectors over its own disc; noise : rounding of the energy [J]
    """

    place: np.ndarray
    normal: np.ndarray
    bearing: np.ndarray
    reach: float
    loads: np.ndarray
    rest: np.ndarray
    volumes: np.ndarray
    mu: np.ndarray
    lam: np.ndarray
    slopes: np.ndarray
    coefficients: np.ndarray
    here: np.ndarray
    noise: float


class Rest(NamedTuple):
    """Coordinates q (r,) of a contact, and there the energy [J] of its cells, its gradient (r,), and the least det F.

    inverse : (r, r), of the stiffness, as far as steps have shown it; None for the identity, which it is at rest
    """

    q: np.ndarray
    energy: float
    pull: np.ndarray
    least: float
    inverse: np.ndarray | None

    def bent_by(self, load: np.ndarray) -> np.ndarray:
        """Return by how much ``load`` (r, ...) would change the coordinates."""
        return load if self.inverse is None else self.inverse @ load


class _Near(NamedTuple):
    """A contact near a press, the weight of its answer, and the loads (r, 3) of the press in its coordinates."""

    contact: Contact
    weight: float
    loads: np.ndarray


class _Place(NamedTuple):
    """A press: the mean (3, b) of the vectors over its disc, the contacts near, the distance to the nearest [m]."""

    disc: np.ndarray
    near: list[_Near]
    apart: float


class _Bent(NamedTuple):
    """The answer to a press beyond its linear part.

    more : (b,) coordinates of the displacement; spread : how far contacts differ about it [m]
    least : smallest det F of their cells; far : largest coordinates over a contact's reach; left : largest residual
    """

    more: np.ndarray
    spread: float
    least: float
    far: float
    left: float


class _Found(NamedTuple):
    """Forces (k, 3) [N] of presses that are given by displacements, and the rests of contacts under them.

    share, missed : what discs miss of their displacements, as a part of them and in [m]; sure : if the search ended
    """

    force: np.ndarray
    rests: list[Rest]
    share: float
    missed: float
    sure: bool

    def doubt(self) -> str:
        """Return why these forces are not to be believed, or nothing."""
        if not self.sure:
            return "no force was found that moves the disc as far as it is pushed"
        if not self.share <= MOST_MISSED:
            return f"a disc is held there, or too near another, and misses its way by {100.0 * self.share:.0f} %"
        return ""


class PortableModel:
    """A model that was read from the bytes of a file; ValueError with one sentence if they are none.

    info : the header; nodes : (n, 3) [m]; triangles : (t, 3); touches : places that rigid instruments were prepared at
    """

    def __init__(self, data: bytes):
        reader = _Reader(data)
        self.info, scalars = reader.info, reader.scalars
        self.radius_m, self._guard, self._far, self._hard, self._farthest = scalars[:5]
        self._floor, self._share, self._spread, self._several, peak, hardest = scalars[5:11]
        self._held = HELD_COMPLIANCE * peak / hardest if hardest > 0.0 else 0.0
        n, t, stored, vectors, contacts, parts = reader.counts
        self.nodes = reader.floats(3 * n).reshape(n, 3).astype(float)
        self._normals = reader.floats(3 * n).reshape(n, 3).astype(float)
        self.triangles = reader.take("<u4", 3 * t).reshape(t, 3).astype(np.int64)
        _must(bool((self.triangles < n).all()), "a triangle has a node that is not there")
        self._from = reader.take("<u4", 6 * n).reshape(n, 6).astype(np.int64)
        _must(bool((self._from < stored).all()), "a node is made of one that is not there")
        self._by = reader.floats(6 * n).reshape(n, 6).astype(float)
        scale = reader.floats(vectors)
        packed = reader.take("<i2", 3 * stored * vectors).reshape(vectors, -1)
        self._basis = np.ascontiguousarray((packed * scale[:, None]).astype(np.float32).T)
        self._compliance = reader.floats(vectors**2).reshape(vectors, vectors).astype(float)
        self._shapes = _parts(parts)
        corners = self.nodes[self.triangles]
        area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        self._areas = np.linalg.norm(area, axis=1)
        self._facing = area / np.maximum(self._areas, 1e-300)[:, None]
        self._middles = corners.mean(axis=1)
        self._wide = float(np.linalg.norm(corners - self._middles[:, None], axis=2).max())
        self.contacts = [self._contact(reader, vectors) for _ in range(contacts)]
        self.touches = [_touch_place(reader, n) for _ in range(reader.places)]
        reader.end()
        self._places = np.array([each.place for each in self.contacts])
        self._directions = np.array([each.normal for each in self.contacts])

    @np.errstate(over="ignore", invalid="ignore")  # what overflows is answered, and doubted
    def respond(self, presses: Sequence[Mapping[str, Any]], start: PortableAnswer | None = None) -> PortableAnswer:
        """Return the answer to ``presses``, each at a triangle and weights (3,), with a force [N] or the way moved [m].

        start : an answer to similar presses, in the same order, from which the search starts; it saves time only, as
            a doubted answer is computed again without it
        ValueError with one sentence for a press that is none.
        """
        sound = isinstance(presses, Sequence) and all(isinstance(press, Mapping) for press in presses)
        _must(sound, "presses are a list of dictionaries")
        _must(len(presses) <= MOST_PRESSES, f"more than {MOST_PRESSES} presses are asked for")
        overdetermined = any(press.get("moved") is not None and press.get("force") is not None for press in presses)
        _must(not overdetermined, "a press has a force or is moved, and not both")
        places = [self._place(press) for press in presses]
        displaced = np.array([press.get("moved") is not None for press in presses], dtype=bool)
        given = [_vector(press, "moved" if moves else "force") for press, moves in zip(presses, displaced, strict=True)]
        force, rests = _begun(places, start)
        force = np.where(displaced[:, None], force, np.array(given).reshape(-1, 3))
        result = _Found(force, rests, 0.0, 0.0, True)
        if displaced.any():
            result = _Search(self._compliance, self._held, places, np.array(given), displaced).forces(force, rests)
        force = result.force
        linear, bent, rests = self._parts_of(places, force, result.rests)
        nonlinear = np.sum([each.more for each in bent], axis=0) if bent else np.zeros_like(linear)
        stored = (self._basis @ (linear + nonlinear).astype(np.float32)).reshape(-1, 3)
        moved = np.einsum("nk,nkd->nd", self._by, stored[self._from])
        if not (np.isfinite(moved).all() and np.isfinite(force).all()):
            nothing = np.zeros((len(self.nodes), 3)), np.zeros_like(force)
            return PortableAnswer(*nothing, 1.0, "the numbers of this answer are beyond what can be stored", [])
        peak = max(float(np.linalg.norm(moved, axis=1).max(initial=0.0)), 1e-30)
        doubt = result.doubt()
        error = 1.0 if doubt else self._error(bent, result.missed, peak)
        for place, each, newtons in zip(places, bent, force, strict=True):
            doubt = doubt or self._doubt(place, each, newtons)
        if doubt and start is not None:
            return self.respond(presses)
        in_order = iter(rests)
        rest = [[(near.contact, next(in_order)) for near in place.near] for place in places]
        return PortableAnswer(moved.astype(float), force, error, doubt, rest)

    @np.errstate(over="ignore", invalid="ignore", divide="ignore")
    def touch(self, place: int, depth_m: float, direction: Sequence[float] | np.ndarray | None = None) -> TouchAnswer:
        """Return the answer to the instrument of ``touches[place]``, pushed from first touch to a depth.

        depth_m : from first touch on [m]; direction : of its way, or straight in
        ValueError with one sentence for a touch that is none.
        """
        prepared_there = isinstance(place, int | np.integer) and 0 <= place < len(self.touches)
        _must(prepared_there, f"the touch is at place {place}, which is not there")
        sound = isinstance(depth_m, int | float | np.number) and math.isfinite(depth_m) and depth_m >= 0.0
        _must(sound, "a touch needs a finite depth of 0 or more")
        prepared = self.touches[place]
        heading = -prepared.axes[2] if direction is None else _vector({"direction": direction}, "direction")
        length = float(np.linalg.norm(heading))
        _must(0.0 < length < math.inf, "the direction of a touch has no length")
        heading = heading / length
        in_axes = prepared.axes @ heading
        x, y = in_axes[:2]
        # the tip goes to first touch, a quadratic of the direction, and then the depth
        along = prepared.first @ np.array([1.0, x, y, x * x, x * y, y * y]) + depth_m
        tip = self.nodes[prepared.node] + along * heading
        # the search begins at what prepared pushes of like depth and direction came to
        start = touch_kernel(prepared.pushed, in_axes * (depth_m / prepared.deepest_m)) @ prepared.starts
        q, force, area, residual = settle_touch(prepared, tip, start)
        moved, along_n = (prepared.surface @ q).reshape(-1, 3), float(force @ heading)
        if not (np.isfinite(moved.astype(np.float32)).all() and math.isfinite(along_n)):
            nothing, why = np.zeros_like(moved), "the numbers of this answer are beyond what can be stored"
            return TouchAnswer(nothing, np.zeros(3), 0.0, 0.0, 1.0, 1.0, why, tip)
        doubt = ""
        if not residual <= TOUCH_RESIDUAL:
            doubt = f"the model found no rest: {100.0 * residual:.1f} % of the load are left"
        elif not depth_m <= ROUNDING * prepared.deepest_m:
            doubt = f"this is deeper than the {1e3 * prepared.deepest_m:.1f} mm that were prepared"
        elif not -in_axes[2] * ROUNDING >= math.cos(math.radians(STEEPEST)):
            doubt = f"the direction is more than {STEEPEST:.0f} degrees off the normal"
        share = min(math.hypot(x, y) / math.sin(math.radians(TILTED)), 1.0)
        error = prepared.error + share * max(prepared.tilted_error - prepared.error, 0.0)
        force_error = prepared.force_error + share * max(prepared.tilted_force_error - prepared.force_error, 0.0)
        return TouchAnswer(moved, force, along_n, prepared.stretched * area, error, force_error, doubt, tip)

    def _error(self, bent: list[_Bent], missed: float, peak: float) -> float:
        """Return the bound of an answer's error, as RMSE over peak."""
        sizes = [float(np.linalg.norm(each.more)) for each in bent]
        error = missed + self._several * (sum(sizes) - max(sizes, default=0.0))
        error += sum(self._share * size + self._spread * each.spread for size, each in zip(sizes, bent, strict=True))
        return min(self._floor + error / peak, 1.0)

    def beyond(self, presses: Sequence[Mapping[str, Any]]) -> tuple[list[float], list[float]]:
        """Return the size of what each press by force has beyond its linear part, and how far contacts differ [m]."""
        forces, places = np.array([_vector(press, "force") for press in presses]), [self._place(p) for p in presses]
        _, bent, _ = self._parts_of(places, forces, _begun(places, None)[1])
        return [float(np.linalg.norm(each.more)) for each in bent], [each.spread for each in bent]

    def press_at(self, node: int, force: np.ndarray) -> dict[str, Any]:
        """Return the press of a ``force`` (3,) [N] at a node of the surface, counted from 0."""
        triangle = int(np.flatnonzero((self.triangles == node).any(axis=1))[0])
        return {"triangle": triangle, "weights": np.where(self.triangles[triangle] == node, 1.0, 0.0), "force": force}

    def apart(self, point: np.ndarray, normal: np.ndarray) -> np.ndarray:
        """Return how far all contacts (k,) are from a point with a normal [m]; a right angle counts as 1.4 radii."""
        turned = self.radius_m**2 * ((self._directions - normal) ** 2).sum(axis=1)
        return np.sqrt(((self._places - point) ** 2).sum(axis=1) + turned)

    def _contact(self, reader: "_Reader", vectors: int) -> Contact:
        modes, count = map(int, reader.take("<u4", 2))
        _must(0 < modes <= MOST_MODES and count <= MOST_CELLS, "a contact has too many coordinates or cells")
        place, normal, bearing = reader.floats(9).reshape(3, 3).astype(float)
        reach = float(reader.floats(1)[0])
        _must(reach > 0.0, "a contact reaches nowhere")
        loads = reader.floats(3 * modes).reshape(modes, 3).astype(float)
        rest = reader.floats(modes**2).reshape(modes, modes).astype(float)
        volumes, mu, lam = reader.floats(3 * count).reshape(3, count).astype(float)
        slopes = reader.columns(9 * count, modes)
        scale = reader.floats(modes).astype(float)
        rows = reader.take("<i2", modes * vectors).reshape(modes, vectors) * scale[:, None]
        shape, cells = (np.ascontiguousarray(rows.T), self.mean_over_disc(place, normal)), (volumes, mu, lam, slopes)
        noise = 4e-15 * float(volumes @ (mu + lam))
        return Contact(place, normal, bearing, reach, loads, rest, *cells, *shape, noise)

    def _place(self, press: Mapping[str, Any]) -> _Place:
        """Find a press's disc and the three nearest contacts, weighted down to 0 at the fourth; ValueError if none."""
        number, weights = press.get("triangle"), _vector(press, "weights")
        _must(isinstance(number, int | np.integer), "a press needs the whole number of a triangle")
        triangle = int(number or 0)
        _must(0 <= triangle < len(self.triangles), f"the press is on triangle {triangle}, which is not there")
        inside = weights.min() >= -1e-6 and abs(weights.sum() - 1.0) < 1e-4
        _must(inside, "the weights of a press are not of a point in its triangle")
        corners = self.triangles[triangle]
        point, normal = weights @ self.nodes[corners], weights @ self._normals[corners]
        normal = normal / max(float(np.linalg.norm(normal)), 1e-30)
        disc = self.mean_over_disc(point, normal)
        apart = self.apart(point, normal)
        order = np.argsort(apart, kind="stable")[:4]
        fourth_m = max(float(apart[order[3]]), 1e-9) if len(order) > 3 else math.inf
        distances = [max(float(apart[i]), 1e-9) for i in order[:3]]
        weight = [max(0.0, 1.0 - one / fourth_m) ** 2 / one**2 for one in distances]
        total = sum(weight)
        if not total > 0.0:
            weight, total = [1.0, 0.0, 0.0][: len(weight)], 1.0
        near = []
        for i, w in zip(order, weight, strict=False):
            if w > 1e-3 * total:
                one = self.contacts[i]
                near.append(_Near(one, w, one.loads + ((disc - one.here) @ one.coefficients).T))
        total = sum(each.weight for each in near)
        return _Place(disc, [each._replace(weight=each.weight / total) for each in near], float(apart[order[0]]))

    def mean_over_disc(self, point: np.ndarray, normal: np.ndarray) -> np.ndarray:
        """Return the mean (3, b) of the basis vectors over the disc at a point (3,), weighted by its pressure."""
        near = np.flatnonzero(((self._middles - point) ** 2).sum(axis=1) < (self.radius_m + self._wide) ** 2)
        corners = self.triangles[near]
        points = np.einsum("pa,tai->tpi", self._shapes, self.nodes[corners])
        pressure = 1.0 - ((points - point) ** 2).sum(axis=2) / self.radius_m**2
        facing = np.clip((self._facing[near] @ normal) / 0.1, 0.0, 1.0) * self._areas[near]
        corner_shares = np.einsum("t,tp,pa->ta", facing, np.maximum(pressure, 0.0), self._shapes)
        sum_of_shares = float(corner_shares.sum())
        if not sum_of_shares > 0.0:
            corners = np.argmin(((self.nodes - point) ** 2).sum(axis=1), keepdims=True)
            corner_shares, sum_of_shares = np.ones(1), 1.0
        node_shares = (corner_shares / sum_of_shares).ravel()[:, None] * self._by[corners.ravel()]
        weights = np.bincount(self._from[corners.ravel()].ravel(), node_shares.ravel())
        used = np.flatnonzero(weights)
        return np.tensordot(weights[used], self._basis.reshape(-1, 3, self._basis.shape[1])[used], 1)

    def _parts_of(
        self, places: list[_Place], force: np.ndarray, rests: list[Rest]
    ) -> tuple[np.ndarray, list[_Bent], list[Rest]]:
        """Return the linear answer (b,) to presses of ``force`` (k, 3) [N], what each has beyond it, and new rests."""
        disc_loads = np.zeros(self._compliance.shape[0])
        for place, newtons in zip(places, force, strict=True):
            disc_loads += newtons @ place.disc
        rests = settle(*_loaded(places, force), rests, RESIDUAL_TOLERANCE)
        rests_in_order = iter(rests)
        bent = [
            _bent(place, newtons, [next(rests_in_order) for _ in place.near])
            for place, newtons in zip(places, force, strict=True)
        ]
        return self._compliance @ disc_loads, bent, rests

    def _doubt(self, place: _Place, bent: _Bent, newtons: np.ndarray) -> str:
        """Return why the answer to a press is not to be believed, or an empty text."""
        hard = sum(each.weight * float(each.contact.bearing @ newtons) for each in place.near)
        if not bent.left <= 1e-3:
            return f"the model found no rest: {100.0 * bent.left:.1f} % of the load are left"
        if not bent.least >= self._guard:
            return f"cells are squeezed to det F = {bent.least:.2f}, beyond what the contact's model was made for"
        if not bent.far <= self._far:
            return f"this goes {bent.far:.1f} times as far as what the contact's model is made of"
        if not hard <= self._hard:
            return f"this presses {hard:.2f} times as hard as finer elements are known to bear"
        if not place.apart <= self._farthest:
            return f"{APART} is {1e3 * place.apart:.0f} mm away"
        return ""


def _bent(place: _Place, newtons: np.ndarray, rests: list[Rest]) -> _Bent:
    """Return what a press of ``newtons`` (3,) causes beyond its linear answer, by the ``rests`` of contacts near it."""
    loads = [each.loads @ newtons for each in place.near]
    contacts, weights = [each.contact for each in place.near], np.array([each.weight for each in place.near])
    differences = np.array(
        [contact.coefficients @ (rest.q - load) for contact, rest, load in zip(contacts, rests, loads, strict=True)]
    )
    nonlinear = weights @ differences
    spread = math.sqrt(float(weights @ ((differences - nonlinear) ** 2).sum(axis=1)))
    largest = max(float(np.linalg.norm(rest.q)) / contact.reach for contact, rest in zip(contacts, rests, strict=True))
    residual = max(_norm(load - rest.pull) / max(_norm(load), 1e-300) for rest, load in zip(rests, loads, strict=True))
    return _Bent(nonlinear, spread, min(rest.least for rest in rests), largest, residual)


def _begun(places: list[_Place], start: PortableAnswer | None) -> tuple[np.ndarray, list[Rest]]:
    """Return the forces (k, 3) [N] of presses and the rests of contacts near them, from which a search starts.

    They are those of an earlier answer ``start`` where it has the same contact and no doubt; else all are zero.
    """
    force, rests = np.zeros((len(places), 3)), []
    earlier_rests = start.rest if start is not None and not start.doubt else []
    for i, place in enumerate(places):
        of_press = earlier_rests[i] if i < len(earlier_rests) else []
        for near in place.near:
            matching = [rest for contact, rest in of_press if contact is near.contact]
            rests.append(matching[0] if matching else undeformed(near.contact))
            if matching and start is not None:
                force[i] = start.forces[i]
    return force, rests


def _loaded(places: list[_Place], force: np.ndarray) -> tuple[list[Contact], list[np.ndarray]]:
    """Return the contacts of all presses, and the loads (r,) on them."""
    pairs = [(near, newtons) for place, newtons in zip(places, force, strict=True) for near in place.near]
    return [near.contact for near, _ in pairs], [near.loads @ newtons for near, newtons in pairs]


class _Search:
    """Finds the forces under which discs move as far as they are pushed, by Newton's method.

    Of k presses, f components of disc displacements are prescribed. ``_linear`` (f, 3 k) [m/N] is their linear response
    to all forces, ``_seen`` (f, r) what the coordinates of each contact add, ``_ways`` (f, j) independent forces.
    """

    def __init__(
        self, compliance: np.ndarray, held: float, places: list[_Place], prescribed: np.ndarray, displaced: np.ndarray
    ):
        self._places, self._free = places, np.repeat(displaced, 3)
        discs = np.concatenate([place.disc for place in places])
        pushed = discs[self._free]
        self._linear = pushed @ compliance @ discs.T
        self._seen = [near.weight * (pushed @ near.contact.coefficients) for place in places for near in place.near]
        self._wanted = prescribed.ravel()[self._free]
        self._ways = _independent(self._linear[:, self._free], held)
        by_others = self._linear[:, ~self._free] @ prescribed.ravel()[~self._free]
        self._way = max(_norm(self._wanted), _norm(by_others), 1e-300)  # a held disc has a way to go, too
        self._scale = max(_norm(self._wanted @ self._ways), _norm(by_others @ self._ways), 1e-300)

    def forces(self, force: np.ndarray, rests: list[Rest]) -> _Found:
        """Search all forces from ``force`` (k, 3) and ``rests``; near the end contacts settle more exactly."""
        size, tolerance = self._scale, FIRST_TOLERANCE
        missed, step, _ = self._missed(force, rests)
        for _ in range(MOST_SEARCH_STEPS):
            if size <= FORCE_SEARCH_TOLERANCE * self._scale and tolerance <= RESIDUAL_TOLERANCE:
                break
            tolerance = max(RESIDUAL_TOLERANCE, FIRST_TOLERANCE * min(1.0, size / self._scale))
            new_force = force + step
            new_rests = settle(*_loaded(self._places, new_force), rests, tolerance)
            new_missed, new_step, new_size = self._missed(new_force, new_rests)
            if not (new_size < 1.5 * size or new_size <= FORCE_SEARCH_TOLERANCE * self._scale):
                rests = [old._replace(inverse=new.inverse) for old, new in zip(rests, new_rests, strict=True)]
                step = 0.5 * step
                continue
            force, rests, missed, size, step = new_force, new_rests, new_missed, new_size, new_step
        missed_m = _norm(missed)
        return _Found(force, rests, missed_m / self._way, missed_m, size <= 1e-3 * self._scale and missed_m < math.inf)

    def _missed(self, force: np.ndarray, rests: list[Rest]) -> tuple[np.ndarray, np.ndarray, float]:
        """Return what the f prescribed displacements lack (f,) [m], Newton's step (k, 3) [N], and the error's size.

        Step and size include how far contacts will still move to their rests, foreseen by their inverse stiffness.
        """
        missed, slope = self._wanted - self._linear @ force.ravel(), self._linear.copy()
        rows_in_order, rests_in_order, foreseen = iter(self._seen), iter(rests), np.zeros(len(missed))
        for i, place in enumerate(self._places):
            for near in place.near:
                rows, rest, load = next(rows_in_order), next(rests_in_order), near.loads @ force[i]
                missed -= rows @ (rest.q - load)
                foreseen += rows @ rest.bent_by(load - rest.pull)
                slope[:, 3 * i : 3 * i + 3] += rows @ (rest.bent_by(near.loads) - near.loads)
        step = np.zeros(force.size)
        reduced_slope = self._ways.T @ slope[:, self._free] @ self._ways
        step[self._free] = self._ways @ _solved(reduced_slope, (missed - foreseen) @ self._ways)
        return missed, step.reshape(-1, 3), _norm(missed @ self._ways) + _norm(foreseen @ self._ways)


def _independent(linear: np.ndarray, held: float) -> np.ndarray:
    """Return j combinations (f, j) of forces that move discs independently; linear : (f, f), three forces a disc.

    Responses are scaled by the mean of each disc; one whose mean is at most ``held`` [m/N] counts as held. Small
    eigenvalues are left out, as two discs at nearly one place can only be moved alike.
    """
    mean = np.repeat(np.diagonal(linear).reshape(-1, 3).mean(axis=1), 3)
    scale = np.where(mean > held, mean, np.inf) ** -0.5
    scaled = scale[:, None] * linear * scale
    if not np.isfinite(scaled).all():
        return np.zeros((len(linear), 0))
    values, vectors = np.linalg.eigh(scaled)
    return scale[:, None] * vectors[:, values > LEAST_EIGENVALUE]


def _solved(matrix: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Solve ``matrix`` (k, k) · solution = ``x`` (k,) by elimination; zeros if a pivot is not above 0."""
    work = np.column_stack([matrix, x])
    for k in range(len(work)):
        if not work[k, k] > 0.0:
            return np.zeros_like(x)
        work[k] /= work[k, k]
        others = np.arange(len(work)) != k
        work[others] -= work[others, k : k + 1] * work[k]
    return work[:, -1]


def undeformed(contact: Contact) -> Rest:
    """Return where a contact is without a load."""
    nothing = np.zeros(len(contact.loads))
    return Rest(nothing, 0.0, nothing, 1.0, None)


def settle(
    contacts: Sequence[Contact], loads: Sequence[np.ndarray], rests: Sequence[Rest], enough: float
) -> list[Rest]:
    """Return the rests of contacts under ``loads`` [(r,)], searched from ``rests``; enough : residual over the load.

    Each contact has a descent of its own; the energies of all contacts' cells are computed at once.
    """
    descents = [_descent(*problem, enough) for problem in zip(contacts, loads, rests, strict=True)]
    reached, energies = list(rests), dict.fromkeys(range(len(descents)))
    while energies:
        points = {}
        for i, energy in energies.items():
            try:
                points[i] = descents[i].send(energy)
            except StopIteration as end:
                reached[i] = end.value
        energies = dict(zip(points, _energies([contacts[i] for i in points], list(points.values())), strict=True))
    return reached


def _descent(contact: Contact, load: np.ndarray, rest: Rest, enough: float) -> Generator[np.ndarray, Any, Rest]:
    """Minimise a contact's energy less the work of ``load`` (r,) [N] by BFGS, from the state ``rest`` and its inverse.

    A generator: it yields trial coordinates (r,), is sent energy, gradient and least det F there, and returns the end.
    """
    size = _norm(load)
    for _ in range(ITERATIONS):
        residual = load - rest.pull
        if _norm(residual) <= enough * size:
            break
        direction, energy = rest.bent_by(residual), rest.energy - float(load @ rest.q)
        slope, length = float(residual @ direction), 1.0
        while slope > 0.0 and length > 1e-4:
            q = rest.q + length * direction
            cell_energy, pull, least = yield q
            end = Rest(q, cell_energy, pull, least, rest.inverse)
            new_energy = end.energy - float(load @ end.q)
            if new_energy <= energy - 1e-4 * length * slope + 1e-12 * abs(energy) + contact.noise:
                rest = end._replace(inverse=_bfgs_inverse(rest.inverse, q - rest.q, pull - rest.pull))
                break
            length *= 0.5
        else:
            if rest.inverse is None:
                break
            rest = rest._replace(inverse=None)
    return rest


def _bfgs_inverse(inverse: np.ndarray | None, step: np.ndarray, change: np.ndarray) -> np.ndarray | None:
    """Return the inverse stiffness (r, r), updated by BFGS for a ``step`` (r,) and the gradient's ``change`` (r,)."""
    curvature = float(step @ change)
    if not curvature > 0.0:
        return inverse
    old = np.eye(len(step)) if inverse is None else inverse
    scaled_change = (old @ change) / curvature
    mixed = np.outer(scaled_change, step)
    return old + (1.0 + float(change @ scaled_change)) / curvature * np.outer(step, step) - mixed - mixed.T


def _energies(contacts: Sequence[Contact], points: Sequence[np.ndarray]) -> list[tuple[float, np.ndarray, float]]:
    """Return (energy [J], gradient (r,), least det F) of each contact at its q (r,): of its cells and ½ qᵀ rest q."""
    if not contacts:
        return []
    f = np.hstack([(contact.slopes @ q).reshape(9, -1) for contact, q in zip(contacts, points, strict=True)])
    volumes, mu, lam = (np.concatenate(each) for each in zip(*(contact[6:9] for contact in contacts), strict=True))
    f[::4] += 1.0
    energies, stress, det, _, _ = _corotational(f, mu, lam)
    pulls, results, first_cell = volumes * stress, [], 0
    for contact, q in zip(contacts, points, strict=True):
        cells, linear_force = slice(first_cell, first_cell + len(contact.volumes)), contact.rest @ q
        first_cell = cells.stop
        energy = float(volumes[cells] @ energies[cells]) + 0.5 * float(q @ linear_force)
        results.append(
            (energy, pulls[:, cells].ravel() @ contact.slopes + linear_force, float(det[cells].min(initial=math.inf)))
        )
    return results


def _corotational(f: np.ndarray, mu: np.ndarray, lam: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return energy (k,) and stress (9, k) [Pa] of cells with F (9, k), row by row, det F, s (k,), and R (9, k).

    Ψ = μ ‖F − R‖² + λ/2 (s − 3)², where s = tr RᵀF is the largest root of (s² − ‖F‖²)² = 4 (‖cof F‖² + 2 s det F), by
    Newton's method, and R = ∂s/∂F.
    """
    a, b, c, d, e, g, h, i, j = f
    cof = np.array([
        e * j - g * i, g * h - d * j, d * i - e * h,
        c * i - b * j, a * j - c * h, b * h - a * i,
        b * g - c * e, c * d - a * g, a * e - b * d,
    ])  # fmt: skip
    det = a * cof[0] + b * cof[1] + c * cof[2]
    norm_f_2, norm_cof_2 = np.einsum("ik,ik->k", f, f), np.einsum("ik,ik->k", cof, cof)
    s = np.sqrt(3.0 * norm_f_2)
    for _ in range(30):
        apart = s * s - norm_f_2
        change = (apart * apart - 4.0 * norm_cof_2 - 8.0 * det * s) / np.maximum(4.0 * s * apart - 8.0 * det, 1e-12)
        s = s - change
        if not np.abs(change).max(initial=0.0) > 1e-13 * np.abs(s).max(initial=0.0):
            break
    apart = s * s - norm_f_2
    rows = f.reshape(3, 3, -1)
    products = np.einsum("iak,ijk->ajk", rows, rows)
    cubed = np.einsum("iak,ajk->ijk", rows, products).reshape(9, -1)
    bottom = np.maximum(s * apart - 2.0 * det, 1e-12)
    rotation = (apart * f + 2.0 * (norm_f_2 * f - cubed) + 2.0 * s * cof) / bottom
    energies = mu * (norm_f_2 - 2.0 * s + 3.0) + 0.5 * lam * (s - 3.0) ** 2
    stress = 2.0 * mu * (f - rotation) + lam * (s - 3.0) * rotation
    return energies, stress, det, s, rotation


def touch_kernel(pushes: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Return the polynomial kernel of degrees 1 to 3 between pushes (k, 3) and (3, ...), each over the deepest."""
    product = pushes @ others
    return product + product**2 + product**3


def settle_touch(one: TouchPlace, tip: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, np.ndarray, float, float]:
    """Minimise the energy of a place's cells and of contact with the instrument at ``tip`` (3,) from ``q`` (r,) on.

    Returns q, the force (3,) [N], the area at rest that touches [m²], and the residual over the force of contact. By
    Newton's method; where its matrix gives no descent, by the part of it that is always positive definite.
    """
    state, scale = _Touched(one, tip, q), 0.0
    for turn in range(TOUCH_ITERATIONS + 1):
        scale = _norm(state.pull) or scale
        size = _norm(state.gradient)
        residual = size / scale if size > 0.0 and scale > 0.0 else size
        if residual <= TOUCH_TOLERANCE or turn == TOUCH_ITERATIONS:
            break
        firm, soft = state.stiffness()
        step = _solved(firm + soft, -state.gradient)
        if not float(state.gradient @ step) < 0.0:
            step = _solved(firm, -state.gradient)
        slope, length, accepted = float(state.gradient @ step), 1.0, None
        while slope < 0.0 and length > 1e-4:
            trial = _Touched(one, tip, state.q + length * step)
            if trial.energy <= state.energy + 1e-4 * length * slope + 1e-12 * abs(state.energy) + one.noise:
                accepted = trial
                break
            length *= 0.5
        if accepted is None:
            break
        state = accepted
    return state.q, state.pushes.sum(axis=0), float(one.areas @ (state.gaps < 0.0)), residual


class _Touched:
    """A place at ``q`` (r,) with the instrument at ``tip`` (3,): energy [J], its gradient (r,), and contact forces.

    gaps : (p,) [m] of the points; pushes : (p, 3) [N], of the instrument on them; pull : (r,), the pushes' work per q
    """

    def __init__(self, place: TouchPlace, tip: np.ndarray, q: np.ndarray):
        self._one, self.q = place, q
        self._f = (place.slopes @ q).reshape(9, -1)
        self._f[::4] += 1.0
        psi, stress, _, self._s, self._rotation = _corotational(self._f, place.mu, place.lam)
        self.gaps, self._normals, self._around = _punch(place, (place.points + place.moves @ q).reshape(-1, 3) - tip)
        pressures = place.penalty * np.maximum(-self.gaps, 0.0)
        self._push, linear = place.areas * pressures, place.rest @ q
        self.energy = float(place.volumes @ psi + 0.5 * (q @ linear) + 0.5 * (self._push @ np.maximum(-self.gaps, 0.0)))
        self.pushes = self._push[:, None] * self._normals
        self.pull = self.pushes.ravel() @ place.moves
        self.gradient = (place.volumes * stress).ravel() @ place.slopes + linear - self.pull

    def stiffness(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the positive definite part of the Hessian (r, r), and the other, of rotations and of curved contact.

        Under δF the rotation R turns by G⁻¹ a: a, in ``turns``, is the axis of δF Rᵀ − R δFᵀ, and G = s I − F Rᵀ.
        """
        place, r = self._one, len(self.q)
        slopes, rotation = place.slopes.reshape(3, 3, -1, r), self._rotation.reshape(3, 3, -1)
        df_r = np.einsum("ikmr,jkm->ijmr", slopes, rotation)
        trace = df_r[0, 0] + df_r[1, 1] + df_r[2, 2]
        turns = np.stack([df_r[2, 1] - df_r[1, 2], df_r[0, 2] - df_r[2, 0], df_r[1, 0] - df_r[0, 1]], axis=1)
        stretch = np.einsum("ikm,jkm->mij", self._f.reshape(3, 3, -1), rotation)
        g = self._s[:, None, None] * np.eye(3) - 0.5 * (stretch + stretch.transpose(0, 2, 1))
        regular = np.linalg.det(g) > 1e-6
        g[~regular] = np.eye(3)
        weight = np.where(regular, place.volumes * (place.lam * (self._s - 3.0) - 2.0 * place.mu), 0.0)
        firm = place.firm + trace.T @ ((place.lam * place.volumes)[:, None] * trace)
        turned = weight[:, None, None] * np.linalg.solve(g, turns)
        soft = turns.reshape(-1, r).T @ turned.reshape(-1, r)
        touching = np.flatnonzero(self.gaps < 0.0)
        moves = place.moves.reshape(-1, 3, r)[touching]
        along = np.einsum("pi,pir->pr", self._normals[touching], moves)
        firm += along.T @ ((place.areas * place.penalty)[touching, None] * along)
        for tangents, curvatures in self._around:
            across = np.einsum("pi,pir->pr", tangents[touching], moves)
            soft -= across.T @ ((self._push * curvatures)[touching, None] * across)
        return firm, soft


def _punch(place: TouchPlace, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, list[tuple[np.ndarray, np.ndarray]]]:
    """Return gaps (p,) [m], normals (p, 3), and two (tangents, curvatures) at ``points`` (p, 3) [m], seen from the tip.

    Inside the instrument, the nearer of end and side counts; the upper half of a ball counts as a cylinder.
    """
    x, y, z = place.axes @ points.T
    edge, rho = place.edge_m, np.sqrt(x * x + y * y)
    safe = np.maximum(rho, 1e-300)
    beyond, below = rho - (place.radius_m - edge), edge - z
    on_edge = (beyond > 0.0) & (below > 0.0)
    distance = np.where(on_edge, np.sqrt(beyond * beyond + below * below), np.maximum(beyond, below))
    nonzero = np.where(on_edge, np.maximum(distance, 1e-300), 1.0)
    outward = np.where(on_edge, beyond / nonzero, beyond > below)
    downward = np.where(on_edge, below / nonzero, beyond <= below)
    radial, turned = np.array([x / safe, y / safe]), np.array([-y / safe, x / safe])
    normals = (outward * radial).T @ place.axes[:2] - downward[:, None] * place.axes[2]
    along = (downward * radial).T @ place.axes[:2] + outward[:, None] * place.axes[2]
    around = [(turned.T @ place.axes[:2], outward / safe), (along, np.where(on_edge, 1.0 / nonzero, 0.0))]
    return distance - edge, normals, around


def _touch_place(reader: "_Reader", n: int) -> TouchPlace:
    """Read a place; ``n`` nodes of the surface."""
    node, kind, modes, cells, points, pushes = map(int, reader.take("<u4", 6))
    sound = node < n and kind < len(KINDS) and 0 < modes <= MOST_MODES and cells <= MOST_CELLS
    _must(sound and points <= MOST_POINTS and pushes <= MOST_PUSHES, "a place to touch has sizes that are none")
    radius, edge, deepest, *factors = map(float, reader.floats(8))
    positive = 0.0 < edge <= radius or (edge == 0.0 and radius > 0.0)
    _must(positive and deepest > 0.0 and min(factors) >= 0.0, "a place to touch has lengths or errors that are none")
    axes, first = reader.floats(9).reshape(3, 3).astype(float), reader.floats(6).astype(float)
    rest = reader.floats(modes**2).reshape(modes, modes).astype(float)
    moduli = reader.floats(3 * cells).reshape(3, cells).astype(float)
    slopes = reader.columns(9 * cells, modes)
    at_rest, moves = reader.floats(3 * points).astype(float), reader.columns(3 * points, modes)
    areas, penalty = reader.floats(2 * points).reshape(2, points).astype(float)
    _must(
        bool((penalty > 0.0).all() and (areas >= 0.0).all()), "a place to touch has areas or stiffnesses that are none"
    )
    pushed = reader.floats(3 * pushes).reshape(pushes, 3).astype(float)
    starts = reader.floats(pushes * modes).reshape(pushes, modes).astype(float)
    surface, sizes = reader.columns(3 * n, modes), (deepest, *factors)
    of_points = at_rest, moves, areas, penalty, pushed, starts, surface
    arrays: list[Any] = [axes, first, *sizes, rest, *moduli, slopes, *of_points]
    return TouchPlace(node, KINDS[kind], radius, edge, *arrays)


def _norm(x: np.ndarray) -> float:
    return math.sqrt(float(x @ x))


class _Reader:
    """Takes arrays out of the bytes of a file, one after another; ValueError where they are not what was written."""

    def __init__(self, data: bytes):
        _must(len(data) >= HEAD and data[:8] == MAGIC, "this is no portable model of palpate")
        version, total, checksum, words, *counts = struct.unpack_from("<10I", data, 8)
        readable = 1 <= version <= VERSION
        _must(readable, f"this is a portable model of version {version}, and versions 1 to {VERSION} are read here")
        complete = total == len(data)
        _must(complete, f"the file has {len(data)} bytes instead of {total}; it was cut off, or more was added")
        _must(checksum == zlib.crc32(data[20:]), "the checksum is wrong; the file is damaged")
        n, t, stored, vectors, contacts, parts = self.counts = counts
        sound = 0 < stored <= n <= total and 0 < t <= total and 0 < contacts <= total
        _must(sound and 0 < vectors <= MOST_VECTORS and 0 < parts <= MOST_PARTS, "its sizes are not those of a model")
        self.scalars = struct.unpack_from(f"<{len(SCALARS)}d", data, 48)
        _must(all(math.isfinite(each) and each >= 0.0 for each in self.scalars), "a number of the header is not finite")
        _must(self.scalars[0] > 0.0, "the radius is not above 0")
        places = self.scalars[11] if version > 1 else 0.0
        _must(places <= MOST_PLACES and places == int(places), "its number of places to touch is none")
        self.places = int(places)
        self._data, self._at = data, HEAD + words
        _must(words % 4 == 0 and self._at <= total, "its header is longer than the file")
        try:
            self.info = json.loads(data[HEAD : self._at].decode("utf-8"))
        except (UnicodeDecodeError, ValueError):
            raise ValueError("its header is not JSON") from None
        _must(isinstance(self.info, dict), "its header is not JSON")
        for name in WORDS + NUMBERS:
            kind, kind_words = (str, "a text") if name in WORDS else (int | float, "a number")
            _must(isinstance(self.info.get(name), kind), f"its header lacks {name}, which is {kind_words}")

    def take(self, kind: str, count: int) -> np.ndarray:
        """Return ``count`` numbers; what follows begins at a multiple of four bytes."""
        size = np.dtype(kind).itemsize * count
        _must(self._at + size <= len(self._data), "an array is longer than the file")
        numbers = np.frombuffer(self._data, kind, count, self._at)
        self._at += size + -size % 4
        return numbers

    def floats(self, count: int) -> np.ndarray:
        """Return ``count`` finite numbers."""
        numbers = self.take("<f4", count)
        _must(bool(np.isfinite(numbers).all()), "a number is not finite")
        return numbers

    def columns(self, rows: int, columns: int) -> np.ndarray:
        """Return whole numbers (rows, columns) times the scale of their column, which stands before them."""
        scale = self.floats(columns).astype(float)
        return self.take("<i2", rows * columns).reshape(rows, columns) * scale

    def end(self) -> None:
        """Check that nothing is left."""
        _must(self._at == len(self._data), "something follows its last array")


def _must(holds: bool, otherwise: str) -> None:
    if not holds:
        raise ValueError(otherwise)


def _vector(press: Mapping[str, Any], name: str) -> np.ndarray:
    """Return the three numbers of a press that are called ``name``."""
    try:
        vector = np.array(press[name], dtype=float)
    except (KeyError, TypeError, ValueError):
        vector = np.empty(0)
    _must(vector.shape == (3,) and bool(np.isfinite(vector).all()), f"a press needs three finite numbers as its {name}")
    return vector


def _parts(count: int) -> np.ndarray:
    """Return the weights (count², 3) of the middles of the triangles that a triangle is split into."""
    corners = []
    for i in range(count):
        for j in range(count - i):
            corners.append(((3 * i + 1) / (3 * count), (3 * j + 1) / (3 * count)))
            if i + j < count - 1:
                corners.append(((3 * i + 2) / (3 * count), (3 * j + 2) / (3 * count)))
    return np.array([(a, b, 1.0 - a - b) for a, b in corners])
