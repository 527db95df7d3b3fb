"""Write a portable model file; docs/portable-model.md has its format."""

import json
import struct
import zlib
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from palpate.models.contact_modes.contact_modes import Prepared
from palpate.press.portable.runtimes.palpate_model import HEAD, MAGIC, SCALARS, VERSION
from palpate.press.portable.surface_basis import SurfaceBasis

LARGEST = 32767


class PackedContact(NamedTuple):
    """A prepared contact of a file: its place (3,) [m], its outward normal (3,), and what answers there."""

    place: np.ndarray
    normal: np.ndarray
    prepared: Prepared


def model_bytes(
    info: Mapping[str, Any],
    scalars: Mapping[str, float],
    basis: SurfaceBasis,
    compliance: np.ndarray,
    contacts: Sequence[PackedContact],
) -> bytes:
    """Return a whole file: the header ``info``, the ``scalars`` that runtimes need, the surface, and the contacts.

    compliance : (b, b), from means over a disc to coordinates of the ``basis``, whose b vectors contacts are told in
    """
    head = json.dumps(info, ensure_ascii=True, allow_nan=False).encode()
    head += b" " * (-len(head) % 4)
    scale, packed = _short(basis.vectors.T)
    parts = [struct.pack(f"<{len(SCALARS)}d", *(scalars[name] for name in SCALARS)), head]
    parts += [_floats(basis.nodes), _floats(basis.normals), _words(basis.triangles), _words(basis.made_of)]
    parts += [_floats(basis.weights), _floats(scale), packed, _floats(compliance)]
    for each in contacts:
        parts += _contact(each, basis)
    sizes = len(basis.nodes), len(basis.triangles), basis.stored, basis.vectors.shape[1], len(contacts), basis.parts
    rest = struct.pack("<7I", len(head), *sizes) + b"".join(parts)
    total = HEAD - 8 * len(SCALARS) - 28 + len(rest)
    return MAGIC + struct.pack("<3I", VERSION, total, zlib.crc32(rest)) + rest


def _contact(contact: PackedContact, basis: SurfaceBasis) -> list[bytes]:
    """Return the parts of one contact."""
    model = contact.prepared
    cells, loads = model.reduced.cells, model.reduced.loads
    slope_scale, slopes = _short(cells.slopes.reshape(-1, cells.slopes.shape[2]), down=True)
    scale, coefficients = _short(basis.coordinates(model.rest).T)
    places = np.concatenate([contact.place, contact.normal, model.bearing[0], [model.reach]])
    moduli = [np.broadcast_to(each, cells.volumes.shape) for each in (cells.mu, cells.lam)]
    parts = [_words(np.array([loads.shape[0], len(cells.volumes)])), _floats(places), _floats(loads)]
    parts += [_floats(model.reduced.rest), *(_floats(each) for each in (cells.volumes, *moduli))]
    return [*parts, _floats(slope_scale), slopes, _floats(scale), coefficients]


def _short(rows: np.ndarray, down: bool = False) -> tuple[np.ndarray, bytes]:
    """Return the scale of each row, or ``down`` of each column, and all numbers over it as 16-bit integers."""
    largest = np.abs(rows).max(axis=0 if down else 1, initial=0.0)
    scale = (np.where(largest > 0.0, largest, 1.0) / LARGEST).astype(np.float32)
    packed = np.rint(rows / (scale if down else scale[:, None])).clip(-LARGEST, LARGEST).astype("<i2").tobytes()
    return scale, packed + b"\0" * (-len(packed) % 4)


def _floats(values: np.ndarray) -> bytes:
    return np.ascontiguousarray(values, dtype="<f4").tobytes()


def _words(values: np.ndarray) -> bytes:
    return np.ascontiguousarray(values, dtype="<u4").tobytes()
