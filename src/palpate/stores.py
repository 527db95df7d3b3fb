"""Dataclasses and named tuples as HDF5 files: one way to write and to read them, by their fields and annotations."""

from inspect import signature
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, get_args, get_type_hints

import numpy as np

from palpate.errors import InputError
from palpate.files import read_hdf5, write_whole

if TYPE_CHECKING:
    import h5py

Record = TypeVar("Record", bound=Any)
"""A dataclass or a named tuple."""
KIND, PARTS = "__kind__", "__parts__"
"""Attributes of a group: the class of what it holds, and the names of its fields, columns or items, in their order."""


def store(thing: object, path: Path | str, compressed: bool = False) -> None:
    """Write a dataclass or a named tuple, whole or not at all; numbers have checksums, and are ``compressed`` by gzip.

    Fields are arrays of numbers or of text, csr_arrays, tables, numbers, text or None, other dataclasses and named
    tuples, and lists and tuples of all these. Raises TypeError for anything else.
    """
    import h5py

    with write_whole(path) as part, h5py.File(part, "w") as file:
        _fill(file, thing, "gzip" if compressed else None)


def stored(kind: type[Record], path: Path | str, **names: type) -> Record:
    """Read a ``kind`` that ``store`` wrote, bit for bit; a whole number where a float is annotated comes back as one.

    names : classes that annotations name and their modules import for the type check only
    Raises InputError if the file is missing, damaged, lacks a field, or was written with other fields.
    """
    with read_hdf5(path) as file:
        return _made(file, kind, names)


def _fill(group: "h5py.Group", thing: Any, compression: str | None) -> None:
    """Write the parts of ``thing`` into a group: single values as attributes, arrays as data sets, others as groups."""
    import h5py

    parts = _parts(thing)
    group.attrs.update({KIND: type(thing).__name__, PARTS: list(parts)})
    for name, part in parts.items():
        if part is None:
            group.attrs[name] = h5py.Empty("f4")
        elif isinstance(part, str | int | float | np.generic):
            group.attrs[name] = part
        elif isinstance(part, np.ndarray):
            plain = {"compression": compression, "fletcher32": True}  # which text, of any length, cannot have
            group.create_dataset(name, data=part, **({"dtype": h5py.string_dtype()} if part.dtype == object else plain))
        else:
            _fill(group.create_group(name), part, compression)


def _parts(thing: Any) -> dict[str, Any]:
    """Return the fields, columns or items of a dataclass, named tuple, table, sparse array, list or tuple, by name."""
    match type(thing).__name__:
        case "list" | "tuple":
            return {str(number): each for number, each in enumerate(thing)}
        case "csr_array":
            return {"data": thing.data, "indices": thing.indices, "indptr": thing.indptr, "shape": thing.shape}
        case "DataFrame":
            return {name: column.to_numpy() for name, column in thing.items()}
    if not (hasattr(thing, "__dataclass_fields__") or hasattr(thing, "_fields")):
        raise TypeError(f"a {type(thing).__name__} cannot be stored")
    return {name: getattr(thing, name) for name in signature(type(thing)).parameters}


def _made(group: "h5py.Group", annotation: Any, names: dict[str, type]) -> Any:
    """Read what ``_fill`` wrote into a group: of the class of ``annotation`` that has its name and its fields."""
    kind, keys = group.attrs.get(KIND), list(group.attrs.get(PARTS, ()))
    for each in _named(annotation):
        if getattr(each, "__name__", "") == kind and list(signature(each).parameters) == keys:
            kinds = get_type_hints(each, localns=names)
            return each(**{key: _part(group, key, kinds[key], names) for key in keys})
    if kind not in ("list", "tuple", "csr_array", "DataFrame"):
        raise InputError(f"{group.file.filename} is of another version (in {group.name}); delete it and type make.")
    parts = {key: _part(group, key, annotation, names) for key in keys}
    if kind == "csr_array":
        from scipy import sparse

        *arrays, shape = parts.values()
        return sparse.csr_array(tuple(arrays), shape=shape)
    if kind == "DataFrame":
        import pandas as pd

        return pd.DataFrame(parts)
    return list(parts.values()) if kind == "list" else tuple(parts.values())


def _part(group: "h5py.Group", name: str, annotation: Any, names: dict[str, type]) -> Any:
    """Read one part of a group by its name; a whole number becomes a float where ``annotation`` has float alone."""
    import h5py

    if name in group.attrs:
        value, kinds = group.attrs[name], _named(annotation)
        value = value.item() if isinstance(value, np.generic) else value
        if type(value) is int and float in kinds and int not in kinds:
            return float(value)
        return None if isinstance(value, h5py.Empty) else value
    part = group[name]
    if isinstance(part, h5py.Group):
        return _made(part, annotation, names)
    return part.asstr()[()] if h5py.check_string_dtype(part.dtype) else part[()]


def _named(annotation: Any) -> list[type]:
    """Return the classes anywhere in an annotation, as ``A`` and ``B`` in ``list[A | B] | None``."""
    inner = get_args(annotation)
    return [each for part in inner for each in _named(part)] if inner else [annotation]
