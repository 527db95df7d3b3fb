"""Describe every field of a database, its place, shape, unit and kind of number, and check values against that."""

from typing import Any, NamedTuple

import numpy as np
from scipy import sparse

from palpate.errors import InputError


class Field(NamedTuple):
    """One array; in ``shape`` a letter or word stands for one length wherever it appears.

    counts : for node numbers, the field whose rows they count
    """

    group: str
    shape: tuple[str | int, ...]
    unit: str
    counts: str | None = None


FIELDS = {
    "nodes_fine_surface": Field("mesh", ("n", 3), "m"),
    "triangles": Field("mesh", ("triangles", 3), "1", "nodes_fine_surface"),
    "coarse_nodes": Field("mesh", ("N", 3), "m"),
    "coarse_tetrahedra": Field("mesh", ("tetrahedra", 4), "1", "coarse_nodes"),
    "coarse_surface": Field("mesh", ("m",), "1", "coarse_nodes"),
    "prolongation": Field("mesh", ("n", "N"), "1"),
    "contact_normals": Field("mesh", ("m", 3), "1"),
    "contact": Field("samples", ("k",), "1", "coarse_nodes"),
    "force": Field("samples", ("k", 3), "N"),
    "fine": Field("samples", ("k", "n", 3), "m"),
    "coarse_paper": Field("samples", ("k", "N", 3), "m"),
    "coarse_live": Field("samples", ("k", "N", 3), "m"),
    "residual": Field("samples", ("k",), "1"),
    "seconds": Field("samples", ("k",), "s"),
}


def check(values: dict[str, Any], where: str) -> None:
    """Raise InputError naming ``where`` and the first field with a wrong shape, number or node."""
    lengths: dict[str, int] = {}
    for name, field in FIELDS.items():
        _check_shape(where, name, values[name].shape, lengths)
        numbers = values[name].data if sparse.issparse(values[name]) else values[name]
        if numbers.dtype.kind not in "fiu":
            refuse(where, name, "does not hold numbers")
        if not np.isfinite(numbers).all():
            refuse(where, name, "has a NaN or infinite value")
        if field.counts:
            if not np.issubdtype(numbers.dtype, np.integer):
                refuse(where, name, f"holds {numbers.dtype} numbers instead of whole ones")
            if not 0 <= numbers.min() <= numbers.max() < len(values[field.counts]):
                refuse(where, name, f"names a node that {field.counts} does not have")
    if (np.diff(values["coarse_surface"]) <= 0).any():
        refuse(where, "coarse_surface", "is not increasing")
    if not np.isin(values["contact"], values["coarse_surface"]).all():
        refuse(where, "contact", "names a node that is not on the coarse surface")
    if (values["seconds"] < 0).any():
        refuse(where, "seconds", "has a negative time")
    if not values["fine"].any(axis=(1, 2)).all():
        refuse(where, "fine", "has a sample in which nothing moves")


def _check_shape(where: str, name: str, shape: tuple[int, ...], lengths: dict[str, int]) -> None:
    wanted = FIELDS[name].shape
    if len(shape) != len(wanted):
        refuse(where, name, f"has {len(shape)} dimensions instead of {len(wanted)}")
    for have, want in zip(shape, wanted, strict=True):
        if have == 0:
            refuse(where, name, "is empty")
        if have != (want if isinstance(want, int) else lengths.setdefault(want, have)):
            expected = tuple(want if isinstance(want, int) else lengths.get(want, want) for want in wanted)
            refuse(where, name, f"has shape {shape} instead of {expected}")


def refuse(where: str, name: str, what: str) -> None:
    """Raise the InputError of a field of a database file."""
    raise InputError(f"{where}: field {name} {what}; delete the file and type make.")
