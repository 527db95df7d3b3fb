"""Answer presses on a body from a portable model file: numpy is all that it needs.

The format is described in docs/portable-model.md; palpate.js and palpate.c beside this file do the same.
"""

import json
import math
import struct
import zlib
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

MAGIC, VERSION, HEAD = b"palpate\n", 1, 144
SCALARS = (
    "radius_m",
    "guard",
    "far",
    "hard",
    "farthest_m",
    "floor",
    "share",
    "spread",
    "several",
    "peak_m",
    "hardest_n",
    "spare",
)
ENOUGH, ITERATIONS, MEMORY = 1e-6, 200, 10
CLOSE, MOST, HELD = 1e-6, 40, 2e-3
APART = "the nearest place that was prepared"
MOST_MODES, MOST_CELLS, MOST_VECTORS, MOST_PARTS = 256, 4096, 1024, 8


class PortableAnswer(NamedTuple):
    """The answer to presses.

    displacement : (n, 3) [m]; forces : (k, 3) [N], given or found; error : estimated RMSE over peak
    doubt : why the answer is not to be believed, or ""
    """

    displacement: np.ndarray
    forces: np.ndarray
    error: float
    doubt: str


class Contact(NamedTuple):
    """A reduced model of one place, in r coordinates with m cells and b vectors of the surface.

    place, normal, bearing : (3,); reach : energy norm; loads : (r, 3); rest : (r, r); volumes, mu, lam : (m,)
    slopes : (9 m, r); coefficients : (b, r); here : (3, b), the mean of the vectors over its own disc
    noise : rounding of the energy [J]
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


class _Near(NamedTuple):
    """A contact that has a say about a press: its weight, and the loads (r, 3) of the press in its coordinates."""

    contact: Contact
    weight: float
    loads: np.ndarray


class _Place(NamedTuple):
    """A press: the mean (3, b) of the vectors over its disc, the contacts near, the distance to the nearest [m]."""

    disc: np.ndarray
    near: list[_Near]
    apart: float


class _Bent(NamedTuple):
    """An answer beyond its linear part: (b,), how contacts differ about it [m], and what is doubted by size."""

    more: np.ndarray
    spread: float
    least: float
    far: float
    left: float


class PortableModel:
    """A model that was read from the bytes of a file; ValueError with one sentence if they are none.

    info : the header; nodes : (n, 3) [m]; triangles : (t, 3)
    """

    def __init__(self, data: bytes):
        reader = _Reader(data)
        self.info, scalars = reader.info, reader.scalars
        self.radius_m, self._guard, self._far, self._hard, self._farthest = scalars[:5]
        self._floor, self._share, self._spread, self._several, peak, hardest = scalars[5:11]
        self._held = HELD * peak / hardest if hardest > 0.0 else 0.0
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
        reader.end()
        self._places = np.array([each.place for each in self.contacts])
        self._directions = np.array([each.normal for each in self.contacts])

    def respond(self, presses: Sequence[Mapping[str, Any]]) -> PortableAnswer:
        """Return the answer to ``presses``, each at a triangle and weights (3,), with a force [N] or the way moved [m].

        ValueError with one sentence for a press that is none.
        """
        places = [self._place(press) for press in presses]
        unknown = np.array([press.get("moved") is not None for press in presses], dtype=bool)
        given = [_vector(press, "moved" if moves else "force") for press, moves in zip(presses, unknown, strict=True)]
        force, missed = np.array(given).reshape(-1, 3), False
        if unknown.any():
            force, missed = self._found(places, force, unknown)
        linear, bent = self._parts_of(places, force)
        more = np.sum([each.more for each in bent], axis=0) if bent else np.zeros_like(linear)
        stored = (self._basis @ (linear + more).astype(np.float32)).reshape(-1, 3)
        moved = np.einsum("nk,nkd->nd", self._by, stored[self._from])
        if not (np.isfinite(moved).all() and np.isfinite(force).all()):
            nothing = np.zeros((len(self.nodes), 3)), np.zeros_like(force)
            return PortableAnswer(*nothing, 1.0, "the numbers of this answer are beyond what can be stored")
        peak = max(float(np.linalg.norm(moved, axis=1).max(initial=0.0)), 1e-30)
        sizes = [float(np.linalg.norm(each.more)) for each in bent]
        error = (
            self._floor
            + sum(self._share * s + self._spread * e.spread for s, e in zip(sizes, bent, strict=True)) / peak
        )
        error += self._several * (sum(sizes) - max(sizes, default=0.0)) / peak
        doubt = "no force was found that moves the disc as far as it is pushed" if missed else ""
        for place, each, newtons in zip(places, bent, force, strict=True):
            doubt = doubt or self._doubt(place, each, newtons)
        return PortableAnswer(moved.astype(float), force, 1.0 if missed else min(error, 1.0), doubt)

    def beyond(self, presses: Sequence[Mapping[str, Any]]) -> tuple[list[float], list[float]]:
        """Return the size of what each press by force has beyond its linear part, and how far contacts differ [m]."""
        forces = np.array([_vector(press, "force") for press in presses])
        _, bent = self._parts_of([self._place(press) for press in presses], forces)
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
        modes, count = reader.sizes()
        _must(0 < modes <= MOST_MODES and count <= MOST_CELLS, "a contact has too many coordinates or cells")
        place, normal, bearing = reader.floats(9).reshape(3, 3).astype(float)
        reach = float(reader.floats(1)[0])
        _must(reach > 0.0, "a contact reaches nowhere")
        loads = reader.floats(3 * modes).reshape(modes, 3).astype(float)
        rest = reader.floats(modes**2).reshape(modes, modes).astype(float)
        volumes, mu, lam = reader.floats(3 * count).reshape(3, count).astype(float)
        scale = reader.floats(modes).astype(float)
        slopes = reader.take("<i2", 9 * count * modes).reshape(9 * count, modes) * scale
        scale = reader.floats(modes).astype(float)
        coefficients = np.ascontiguousarray(
            (reader.take("<i2", modes * vectors).reshape(modes, vectors) * scale[:, None]).T
        )
        noise = 4e-15 * float(volumes @ (mu + lam))
        return Contact(
            place,
            normal,
            bearing,
            reach,
            loads,
            rest,
            volumes,
            mu,
            lam,
            slopes,
            coefficients,
            self.mean_over_disc(place, normal),
            noise,
        )

    def _place(self, press: Mapping[str, Any]) -> _Place:
        """Find what a press needs, at its point of the surface."""
        named, weights = press.get("triangle"), _vector(press, "weights")
        _must(isinstance(named, int | np.integer), "a press needs the whole number of a triangle")
        triangle = int(named or 0)
        _must(0 <= triangle < len(self.triangles), f"the press is on triangle {triangle}, which is not there")
        _must(
            weights.min() >= -1e-6 and abs(weights.sum() - 1.0) < 1e-4,
            "the weights of a press are not of a point in its triangle",
        )
        corners = self.triangles[triangle]
        point, normal = weights @ self.nodes[corners], weights @ self._normals[corners]
        normal = normal / max(float(np.linalg.norm(normal)), 1e-30)
        disc = self.mean_over_disc(point, normal)
        apart = self.apart(point, normal)
        order = np.argsort(apart, kind="stable")[:4]
        edge = max(float(apart[order[3]]), 1e-9) if len(order) > 3 else math.inf
        weight = [
            max(0.0, 1.0 - max(float(apart[i]), 1e-9) / edge) ** 2 / max(float(apart[i]), 1e-9) ** 2 for i in order[:3]
        ]
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
        """Return the mean (3, b) of the vectors over the disc around a point, weighted by its pressure."""
        near = np.flatnonzero(((self._middles - point) ** 2).sum(axis=1) < (self.radius_m + self._wide) ** 2)
        corners = self.triangles[near]
        points = np.einsum("pa,tai->tpi", self._shapes, self.nodes[corners])
        part = 1.0 - ((points - point) ** 2).sum(axis=2) / self.radius_m**2
        facing = np.clip((self._facing[near] @ normal) / 0.1, 0.0, 1.0) * self._areas[near]
        shares = np.einsum("t,tp,pa->ta", facing, np.maximum(part, 0.0), self._shapes)
        total = float(shares.sum())
        if not total > 0.0:
            corners = np.argmin(((self.nodes - point) ** 2).sum(axis=1), keepdims=True)
            shares, total = np.ones(1), 1.0
        parts = (shares / total).ravel()[:, None] * self._by[corners.ravel()]
        weights = np.bincount(self._from[corners.ravel()].ravel(), parts.ravel())
        used = np.flatnonzero(weights)
        return np.tensordot(weights[used], self._basis.reshape(-1, 3, self._basis.shape[1])[used], 1)

    def _parts_of(
        self, places: list[_Place], force: np.ndarray, starts: dict | None = None
    ) -> tuple[np.ndarray, list[_Bent]]:
        """Return the linear part (b,) of all presses, and what each has beyond it."""
        loaded = np.zeros(self._compliance.shape[0])
        for place, newtons in zip(places, force, strict=True):
            loaded += newtons @ place.disc
        return self._compliance @ loaded, [
            self._bent(place, newtons, None if starts is None else starts.setdefault(i, {}))
            for i, (place, newtons) in enumerate(zip(places, force, strict=True))
        ]

    def _bent(self, place: _Place, newtons: np.ndarray, starts: dict | None) -> _Bent:
        parts, least, far, left = [], math.inf, 0.0, 0.0
        for j, (one, _, loads) in enumerate(place.near):
            load = loads @ newtons
            q, residual, smallest = settle(one, load, None if starts is None else starts.get(j))
            if starts is not None:
                starts[j] = q
            parts.append(one.coefficients @ (q - load))
            least, left = min(least, smallest), max(left, residual)
            far = max(far, float(np.linalg.norm(q)) / one.reach)
        weights = np.array([each.weight for each in place.near])
        more = weights @ np.array(parts)
        spread = math.sqrt(float(weights @ ((np.array(parts) - more) ** 2).sum(axis=1)))
        return _Bent(more, spread, least, far, left)

    def _doubt(self, place: _Place, bent: _Bent, newtons: np.ndarray) -> str:
        """Return why what was found for a press is not to be believed, or nothing."""
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

    def _found(self, places: list[_Place], given: np.ndarray, unknown: np.ndarray) -> tuple[np.ndarray, bool]:
        """Return all forces (k, 3) [N], those of moved discs found by Broyden's method, and whether they were not."""
        free, force = np.repeat(unknown, 3), np.where(unknown[:, None], 0.0, given).ravel()
        discs, wanted = np.concatenate([place.disc for place in places]), given.ravel()[free]
        starts: dict = {}

        def left_of(tried: np.ndarray) -> np.ndarray:
            linear, bent = self._parts_of(places, tried.reshape(-1, 3), starts)
            return wanted - (discs @ (linear + np.sum([each.more for each in bent], axis=0)))[free]

        slope = (discs @ self._compliance @ discs.T)[np.ix_(free, free)]
        inverse = _inverted(slope, self._held)
        left = left_of(force)
        step = inverse @ left
        scale = float(max(np.abs(wanted).max(), np.abs(left).max()))  # a held disc has a way to go, too
        for _ in range(MOST):
            if np.abs(left).max() <= CLOSE * scale:
                return force.reshape(-1, 3), False
            tried = force.copy()
            tried[free] += step
            found = left_of(tried)
            if not np.linalg.norm(found) < 1.5 * np.linalg.norm(left):
                step = 0.5 * step
                continue
            change = inverse @ (left - found)
            below = float(step @ change)
            if below != 0.0:
                inverse = inverse + np.outer(step - change, step @ inverse) / below
            force, left = tried, found
            step = inverse @ left
        return force.reshape(-1, 3), bool(np.abs(left).max() > 1e-3 * scale)


def _inverted(matrix: np.ndarray, least: float) -> np.ndarray:
    """Return the inverse, or nothing but 0 where a pivot is at most ``least``: discs that are held, or the same."""
    size = len(matrix)
    work = np.hstack([matrix, np.eye(size)])
    for k in range(size):
        best = k + int(np.argmax(np.abs(work[k:, k])))
        work[[k, best]] = work[[best, k]]
        if not (abs(work[k, k]) > least and math.isfinite(work[k, k])):
            return np.zeros_like(matrix)
        work[k] /= work[k, k]
        others = np.arange(size) != k
        work[others] -= work[others, k : k + 1] * work[k]
    return work[:, size:]


def settle(contact: Contact, load: np.ndarray, start: np.ndarray | None) -> tuple[np.ndarray, float, float]:
    """Minimise the energy of a contact's cells less the work of ``load`` (r,), by L-BFGS that starts from the identity.

    Returns coordinates (r,), the residual over the load, and the smallest det F.
    """
    size = math.sqrt(float(load @ load))
    enough = ENOUGH * size
    q = load.copy() if start is None else start
    pairs: list[tuple[np.ndarray, np.ndarray, float]] = []
    energy, gradient, least = _evaluate(contact, load, q)
    for _ in range(ITERATIONS):
        if math.sqrt(float(gradient @ gradient)) <= enough:
            break
        ahead = _ahead(gradient, pairs)
        slope, length, found = -float(gradient @ ahead), 1.0, False
        while slope > 0.0 and length > 1e-4:
            reached = q + length * ahead
            lower, bent, smallest = _evaluate(contact, load, reached)
            if lower <= energy - 1e-4 * length * slope + 1e-12 * abs(energy) + contact.noise:
                found = True
                break
            length *= 0.5
        if not found:
            if not pairs:
                break
            pairs = []
            continue
        step, bend = reached - q, bent - gradient
        curvature = float(step @ bend)
        if curvature > 0.0:
            pairs = [*pairs[-MEMORY + 1 :], (step, bend, 1.0 / curvature)]
        q, gradient, energy, least = reached, bent, lower, smallest
    return q, math.sqrt(float(gradient @ gradient)) / max(size, 1e-300), least


def _ahead(gradient: np.ndarray, pairs: list[tuple[np.ndarray, np.ndarray, float]]) -> np.ndarray:
    ahead, parts = -gradient, []
    for step, bend, scale in reversed(pairs):
        part = scale * float(step @ ahead)
        parts.append(part)
        ahead = ahead - part * bend
    for (step, bend, scale), part in zip(pairs, reversed(parts), strict=True):
        ahead = ahead + (part - scale * float(bend @ ahead)) * step
    return ahead


def _evaluate(contact: Contact, load: np.ndarray, q: np.ndarray) -> tuple[float, np.ndarray, float]:
    """Return energy [J], gradient (r,) and smallest det F at coordinates ``q`` (r,).

    Ψ = μ ‖F − R‖² + λ/2 (tr RᵀF − 3)², where s = tr RᵀF is the largest root of (s² − I)² = 4 (II + 2 J s), I, II and J²
    being the invariants of FᵀF; and R = ∂s/∂F.
    """
    f = (contact.slopes @ q).reshape(9, -1)
    f[0] += 1.0
    f[4] += 1.0
    f[8] += 1.0
    a, b, c, d, e, g, h, i, j = f
    cof = np.array(
        [
            e * j - g * i,
            g * h - d * j,
            d * i - e * h,
            c * i - b * j,
            a * j - c * h,
            b * h - a * i,
            b * g - c * e,
            c * d - a * g,
            a * e - b * d,
        ]
    )
    det = a * cof[0] + b * cof[1] + c * cof[2]
    first, second = np.einsum("ik,ik->k", f, f), np.einsum("ik,ik->k", cof, cof)
    s = np.sqrt(3.0 * first)
    for _ in range(30):
        apart = s * s - first
        change = (apart * apart - 4.0 * second - 8.0 * det * s) / np.maximum(4.0 * s * apart - 8.0 * det, 1e-12)
        s = s - change
        if not np.abs(change).max(initial=0.0) > 1e-13 * np.abs(s).max(initial=0.0):
            break
    apart = s * s - first
    rows = f.reshape(3, 3, -1)
    products = np.einsum("iak,ijk->ajk", rows, rows)
    cubed = np.einsum("iak,ajk->ijk", rows, products).reshape(9, -1)
    bottom = np.maximum(s * apart - 2.0 * det, 1e-12)
    rotation = (apart * f + 2.0 * (first * f - cubed) + 2.0 * s * cof) / bottom
    energies = contact.mu * (first - 2.0 * s + 3.0) + 0.5 * contact.lam * (s - 3.0) ** 2
    stress = 2.0 * contact.mu * (f - rotation) + contact.lam * (s - 3.0) * rotation
    pull = contact.rest @ q
    energy = float(contact.volumes @ energies) + 0.5 * float(q @ pull) - float(load @ q)
    gradient = (contact.volumes * stress).ravel() @ contact.slopes + pull - load
    return energy, gradient, float(det.min(initial=math.inf))


class _Reader:
    """Takes arrays out of the bytes of a file, one after another; ValueError where they are not what was written."""

    def __init__(self, data: bytes):
        _must(len(data) >= HEAD and data[:8] == MAGIC, "this is no portable model of palpate")
        version, total, checksum, words, *counts = struct.unpack_from("<10I", data, 8)
        _must(version == VERSION, f"this is a portable model of version {version}, and version {VERSION} is read here")
        _must(
            total == len(data), f"the file has {len(data)} bytes instead of {total}; it was cut off, or more was added"
        )
        _must(checksum == zlib.crc32(data[20:]), "the checksum is wrong; the file is damaged")
        n, t, stored, vectors, contacts, parts = self.counts = counts
        sound = 0 < stored <= n <= total and 0 < t <= total and 0 < contacts <= total
        _must(sound and 0 < vectors <= MOST_VECTORS and 0 < parts <= MOST_PARTS, "its sizes are not those of a model")
        self.scalars = struct.unpack_from(f"<{len(SCALARS)}d", data, 48)
        _must(all(math.isfinite(each) and each >= 0.0 for each in self.scalars), "a number of the header is not finite")
        _must(self.scalars[0] > 0.0, "the radius is not above 0")
        self._data, self._at = data, HEAD + words
        _must(words % 4 == 0 and self._at <= total, "its header is longer than the file")
        try:
            self.info = json.loads(data[HEAD : self._at].decode("utf-8"))
        except (UnicodeDecodeError, ValueError):
            raise ValueError("its header is not JSON") from None
        _must(isinstance(self.info, dict), "its header is not JSON")

    def take(self, kind: str, count: int) -> np.ndarray:
        """Return ``count`` numbers; what follows begins at a multiple of four bytes."""
        size = np.dtype(kind).itemsize * count
        _must(self._at + size <= len(self._data), "an array is longer than the file")
        found = np.frombuffer(self._data, kind, count, self._at)
        self._at += size + -size % 4
        return found

    def floats(self, count: int) -> np.ndarray:
        """Return ``count`` finite numbers."""
        found = self.take("<f4", count)
        _must(bool(np.isfinite(found).all()), "a number is not finite")
        return found

    def sizes(self) -> tuple[int, int]:
        """Return the numbers of coordinates and of cells of the next contact."""
        modes, cells = self.take("<u4", 2)
        return int(modes), int(cells)

    def end(self) -> None:
        """Check that nothing is left."""
        _must(self._at == len(self._data), "something follows its last array")


def _must(holds: bool, otherwise: str) -> None:
    if not holds:
        raise ValueError(otherwise)


def _vector(press: Mapping[str, Any], name: str) -> np.ndarray:
    """Return the three numbers of a press that are called ``name``."""
    try:
        found = np.array(press[name], dtype=float)
    except (KeyError, TypeError, ValueError):
        found = np.empty(0)
    _must(found.shape == (3,) and bool(np.isfinite(found).all()), f"a press needs three finite numbers as its {name}")
    return found


def _parts(count: int) -> np.ndarray:
    """Return the weights (count², 3) of the middles of the triangles that a triangle is split into."""
    found = []
    for i in range(count):
        for j in range(count - i):
            found.append(((3 * i + 1) / (3 * count), (3 * j + 1) / (3 * count)))
            if i + j < count - 1:
                found.append(((3 * i + 2) / (3 * count), (3 * j + 2) / (3 * count)))
    return np.array([(a, b, 1.0 - a - b) for a, b in found])
