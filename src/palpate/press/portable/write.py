"""Write a portable model file (docs/portable-model.md), over few displacements that all answers are made of."""

import json
import struct
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from scipy import sparse

from palpate.bodies.body import Body
from palpate.models.contact_modes.contact_modes import Prepared
from palpate.models.fem_statics import to_surface
from palpate.press.portable.runtimes.palpate_model import HEAD, KINDS, MAGIC, SCALARS, VERSION, TouchPlace

MADE_OF = 6
"""Nodes that a node of the surface is interpolated from at most: those of a quadratic triangle."""
PARTS_OF_RADIUS, MOST_PARTS = 10.0, 8
"""A disc is integrated over triangles split into parts of a tenth of its radius, at most eight along an edge."""
BENT = 0.5
"""Weight of displacements beyond the linear part, in the choice of vectors."""


@dataclass(frozen=True, eq=False)
class SurfaceBasis:
    """Basis of b displacements of n surface nodes, stored at some of them and interpolated quadratically to the others.

    nodes, normals : (n, 3); triangles : (t, 3) of these nodes; parts : along an edge, of triangles under a disc
    made_of, weights : (n, 6), the stored nodes that each node is made of
    rows : (stored,) the nodes that are stored
    vectors : (3 stored, b), of mean square 1 a node
    """

    nodes: np.ndarray
    normals: np.ndarray
    triangles: np.ndarray
    parts: int
    made_of: np.ndarray
    weights: np.ndarray
    rows: np.ndarray
    vectors: np.ndarray

    @cached_property
    def _inverse(self) -> np.ndarray:
        return np.linalg.pinv(self.vectors)

    def at_stored(self, moved: np.ndarray) -> np.ndarray:
        """Return displacements (3 stored, k) of those (3 n, k) of all nodes."""
        return moved.reshape(len(self.nodes), 3, -1)[self.rows].reshape(3 * len(self.rows), -1).astype(float)

    def coordinates(self, moved: np.ndarray) -> np.ndarray:
        """Return the coordinates (b, k) of displacements (3 n, k) of all nodes."""
        return self._inverse @ self.at_stored(moved)


def surface_basis(
    body: Body, radius_m: float, linear: Sequence[np.ndarray], bent: Sequence[np.ndarray], most: int
) -> SurfaceBasis:
    """Choose a basis of at most ``most`` vectors for answers, by proper orthogonal decomposition.

    linear, bent : displacements (3 n, k) each, linear responses and what is beyond them; each is scaled to at most 1
    """
    surface = body.fine.surface
    interpolation = _interpolation(body)
    made_of, weights = np.zeros((len(surface), MADE_OF), dtype=np.int64), np.zeros((len(surface), MADE_OF))
    node = np.repeat(np.arange(len(surface)), np.diff(interpolation.indptr))
    entry = node, np.arange(interpolation.nnz) - interpolation.indptr[node]
    made_of[entry], weights[entry] = interpolation.indices, interpolation.data
    stored_alone = interpolation.data > 1.0 - 1e-9  # nodes that are made of one stored node alone are that node
    rows = np.zeros(interpolation.shape[1], dtype=np.int64)
    rows[interpolation.indices[stored_alone]] = node[stored_alone]
    triangles = np.searchsorted(surface, body.fine.triangles)
    nodes = body.fine.nodes[surface].astype(np.float32).astype(float)
    corners = nodes[triangles]
    edge = float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean())
    parts = int(np.clip(np.ceil(PARTS_OF_RADIUS * edge / radius_m), 1, MOST_PARTS))
    empty = np.zeros((3 * len(rows), 0))
    empty_basis = SurfaceBasis(nodes, body.fine.normals[surface], triangles, parts, made_of, weights, rows, empty)
    samples_of_kinds = [empty_basis.at_stored(each) / np.abs(each).max() for each in linear]
    samples_of_kinds += [BENT * empty_basis.at_stored(each) / np.abs(each).max() for each in bent]
    samples = np.hstack(samples_of_kinds)
    products = samples @ samples.T if samples.shape[0] < samples.shape[1] else samples.T @ samples
    values, eigenvectors = np.linalg.eigh(products)
    largest = np.argsort(values)[::-1][: min(most, int((values > 1e-10 * values[-1]).sum()))]
    vectors = eigenvectors[:, largest]
    if samples.shape[0] >= samples.shape[1]:
        vectors = samples @ vectors / np.sqrt(values[largest])
    chosen = vectors * np.sqrt(len(rows))
    return SurfaceBasis(nodes, empty_basis.normals, triangles, parts, made_of, weights, rows, chosen)


def _interpolation(body: Body) -> sparse.csr_array:
    """Return the interpolation (n, stored) from the stored surface nodes, by quadratic triangles two levels coarser."""
    surface = body.fine.surface
    if len(body.levels) < 3:
        return sparse.csr_array(sparse.eye_array(len(surface), format="csr"))
    from_level = sparse.csr_array(to_surface(body, len(body.levels) - 3, 2))
    used_nodes = np.unique(from_level.indices[np.abs(from_level.data) > 1e-12])
    interpolation = sparse.csr_array(from_level[:, used_nodes])
    interpolation.data[np.abs(interpolation.data) <= 1e-12] = 0.0
    interpolation.eliminate_zeros()
    return interpolation


INT16_MAX = 32767


class PackedContact(NamedTuple):
    """A prepared contact of a file: its place (3,) [m], its outward normal (3,), and the model there."""

    place: np.ndarray
    normal: np.ndarray
    prepared: Prepared


def model_bytes(
    info: Mapping[str, Any],
    scalars: Mapping[str, float],
    basis: SurfaceBasis,
    compliance: np.ndarray,
    contacts: Sequence[PackedContact],
    places: Sequence[TouchPlace] = (),
) -> bytes:
    """Return a whole file: the header ``info``, the ``scalars`` that runtimes need, the surface, contacts and places.

    compliance : (b, b), from means over a disc to coordinates of the ``basis``, whose b vectors contacts are told in
    """
    head = json.dumps(info, ensure_ascii=True, allow_nan=False).encode()
    head += b" " * (-len(head) % 4)
    scale, packed = _short(basis.vectors.T)
    numbers = {**scalars, "places": float(len(places))}
    parts = [struct.pack(f"<{len(SCALARS)}d", *(numbers[name] for name in SCALARS)), head]
    parts += [_floats(basis.nodes), _floats(basis.normals), _words(basis.triangles), _words(basis.made_of)]
    parts += [_floats(basis.weights), _floats(scale), packed, _floats(compliance)]
    for each in contacts:
        parts += _contact(each, basis)
    for place in places:
        parts += _touched(place)
    sizes = len(basis.nodes), len(basis.triangles), len(basis.rows), basis.vectors.shape[1], len(contacts), basis.parts
    checked = struct.pack("<7I", len(head), *sizes) + b"".join(parts)
    total = HEAD - 8 * len(SCALARS) - 28 + len(checked)
    return MAGIC + struct.pack("<3I", VERSION, total, zlib.crc32(checked)) + checked


def _contact(contact: PackedContact, basis: SurfaceBasis) -> list[bytes]:
    """Return a prepared contact, as pieces of the file."""
    model = contact.prepared
    points, loads = model.reduced.points, model.reduced.loads
    scale, coefficients = _short(basis.coordinates(model.rest).T)
    places = np.concatenate([contact.place, contact.normal, model.bearing[0], [model.reach]])
    moduli = [np.broadcast_to(each, points.volumes.shape) for each in (points.mu, points.lam)]
    parts = [_words(np.array([loads.shape[0], len(points.volumes)])), _floats(places), _floats(loads)]
    parts += [_floats(model.reduced.rest), *(_floats(each) for each in (points.volumes, *moduli))]
    return [*parts, *_columns(points.slopes.reshape(-1, points.slopes.shape[2])), _floats(scale), coefficients]


def _touched(place: TouchPlace) -> list[bytes]:
    """Return a place that a rigid instrument was prepared at, as pieces of the file."""
    r, sizes = place.rest.shape[0], (len(place.volumes), len(place.areas), len(place.pushed))
    lengths = place.radius_m, place.edge_m, place.deepest_m, place.stretched
    errors = place.error, place.force_error, place.tilted_error, place.tilted_force_error
    parts = [_words(np.array([place.node, KINDS.index(place.kind), r, *sizes])), _floats(np.array([*lengths, *errors]))]
    parts += [_floats(each) for each in (place.axes, place.first, place.rest, place.volumes, place.mu, place.lam)]
    parts += [*_columns(place.slopes), _floats(place.points), *_columns(place.moves)]
    parts += [_floats(each) for each in (place.areas, place.penalty, place.pushed, place.starts)]
    return [*parts, *_columns(place.surface)]


def _columns(rows: np.ndarray) -> tuple[bytes, bytes]:
    """Return the scales of the columns of ``rows`` and all numbers over them, as they are stored."""
    scale, packed = _short(rows, down=True)
    return _floats(scale), packed


def _short(rows: np.ndarray, down: bool = False) -> tuple[np.ndarray, bytes]:
    """Return the scale of each row, or ``down`` of each column, and all numbers over it as 16-bit integers."""
    largest = np.abs(rows).max(axis=0 if down else 1, initial=0.0)
    scale = (np.where(largest > 0.0, largest, 1.0) / INT16_MAX).astype(np.float32)
    packed = np.rint(rows / (scale if down else scale[:, None])).clip(-INT16_MAX, INT16_MAX).astype("<i2").tobytes()
    return scale, packed + b"\0" * (-len(packed) % 4)


def _floats(values: np.ndarray) -> bytes:
    return np.ascontiguousarray(values, dtype="<f4").tobytes()


def _words(values: np.ndarray) -> bytes:
    return np.ascontiguousarray(values, dtype="<u4").tobytes()
