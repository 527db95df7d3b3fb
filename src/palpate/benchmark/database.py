"""Store, check and read the database: corresponding coarse and fine deformations of one body, and its meshes."""

from dataclasses import asdict, dataclass, fields, replace
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, get_type_hints

import numpy as np
from scipy import sparse

from palpate.bodies.body import Body
from palpate.bodies.material import Material
from palpate.errors import InputError
from palpate.files import read_hdf5, write_whole

if TYPE_CHECKING:
    import h5py

FORMAT = 2
_PARTS = ("data", "indices", "indptr")


class Field(NamedTuple):
    """How an array is stored; in ``shape`` a letter or word stands for one length wherever it appears.

    counts : for node numbers, the field whose rows they count
    """

    group: str
    shape: tuple[str | int, ...]
    unit: str
    counts: str | None = None


@dataclass(frozen=True, eq=False)
class Database:
    """k samples of one body in one regime of loads; arrays are of the shape and unit of their ``Field``.

    nodes_fine_surface : rest positions of the n fine surface nodes; triangles between them
    coarse_nodes, coarse_tetrahedra : the whole coarse mesh; coarse_surface : increasing numbers of its surface nodes
    prolongation : linear interpolation from all coarse nodes to the fine surface nodes
    contact_normals : outward unit normals of the coarse surface nodes at rest
    contact : the coarse node that each sample presses, by its ``force``
    fine, coarse_paper, coarse_live : displacements, the coarse ones of the two protocols
    residual : relative residual of the fine solutions
    seconds : what simulating each sample took on the fine and on the coarse mesh together
    config_digest : identifies the settings the samples were made with
    """

    nodes_fine_surface: Annotated[np.ndarray, Field("mesh", ("n", 3), "m")]
    triangles: Annotated[np.ndarray, Field("mesh", ("triangles", 3), "1", "nodes_fine_surface")]
    coarse_nodes: Annotated[np.ndarray, Field("mesh", ("N", 3), "m")]
    coarse_tetrahedra: Annotated[np.ndarray, Field("mesh", ("tetrahedra", 4), "1", "coarse_nodes")]
    coarse_surface: Annotated[np.ndarray, Field("mesh", ("m",), "1", "coarse_nodes")]
    prolongation: Annotated[sparse.csr_array, Field("mesh", ("n", "N"), "1")]
    contact_normals: Annotated[np.ndarray, Field("mesh", ("m", 3), "1")]
    contact: Annotated[np.ndarray, Field("samples", ("k",), "1", "coarse_nodes")]
    force: Annotated[np.ndarray, Field("samples", ("k", 3), "N")]
    fine: Annotated[np.ndarray, Field("samples", ("k", "n", 3), "m")]
    coarse_paper: Annotated[np.ndarray, Field("samples", ("k", "N", 3), "m")]
    coarse_live: Annotated[np.ndarray, Field("samples", ("k", "N", 3), "m")]
    residual: Annotated[np.ndarray, Field("samples", ("k",), "1")]
    seconds: Annotated[np.ndarray, Field("samples", ("k",), "s")]
    material: Material
    config_digest: str

    def coarse(self, protocol: str) -> np.ndarray:
        """Return coarse displacements of the protocol "paper" or "live", (k, N, 3) [m]."""
        return {"paper": self.coarse_paper, "live": self.coarse_live}[protocol]

    def take(self, rows: np.ndarray) -> "Database":
        """Return the database with these samples only, in this order; a sample may come twice."""
        names = [name for name, field in FIELDS.items() if field.shape[0] == "k"]
        return replace(self, **{name: getattr(self, name)[rows] for name in names})

    @cached_property
    def peaks(self) -> np.ndarray:
        """The largest fine displacement of each sample, (k,) [m], which errors are relative to."""
        return np.linalg.norm(self.fine, axis=2).max(axis=1)

    @cached_property
    def size(self) -> float:
        """The longest side of the body's bounding box [m]."""
        return float(np.ptp(self.coarse_nodes, axis=0).max())


def write(db: Database, path: Path | str) -> None:
    """Check a database, and write it with checksums, whole or not at all; InputError if a field is wrong."""
    import h5py

    check(vars(db), str(path))
    with write_whole(path) as temporary, h5py.File(temporary, "w") as file:
        file.attrs.update(asdict(db.material))
        file.attrs["format"] = FORMAT
        file.attrs["config_digest"] = db.config_digest
        file.attrs["package_version"] = version("palpate")
        for name, field in FIELDS.items():
            _store(file.require_group(field.group), name, getattr(db, name), field.unit)


def read(path: Path | str) -> Database:
    """Read a database; InputError naming the file and the field that is missing, damaged or wrong."""
    with read_hdf5(path) as file:
        if (found := _attribute(path, file, "format")) != FORMAT:
            refuse(str(path), "format", f"is {found} but this version reads {FORMAT}")
        values = {name: _load(path, file, name) for name in FIELDS}
        found = {field.name: _attribute(path, file, field.name) for field in fields(Material)}
        law = str(found.pop("law"))
        material = Material(**{name: float(value) for name, value in found.items()}, law=law)
        digest = str(_attribute(path, file, "config_digest"))
    check(values, str(path))
    return Database(**values, material=material, config_digest=digest)


def _store(group: "h5py.Group", name: str, value: np.ndarray | sparse.csr_array, unit: str) -> None:
    if sparse.issparse(value):
        inner = group.create_group(name)
        inner.attrs.update({"shape": value.shape, "unit": unit})
        for part in _PARTS:
            inner.create_dataset(part, data=getattr(value, part), compression="gzip", fletcher32=True)
    else:
        group.create_dataset(name, data=value, compression="gzip", fletcher32=True).attrs["unit"] = unit


def _attribute(path: Path | str, file: "h5py.File", name: str) -> Any:
    if name not in file.attrs:
        refuse(str(path), name, "is missing")
    return file.attrs[name]


def _load(path: Path | str, file: "h5py.File", name: str) -> np.ndarray | sparse.csr_array:
    """Read a field; InputError if it is missing, damaged or in another unit."""
    field = FIELDS[name]
    place = file.get(f"{field.group}/{name}")
    if place is None:
        refuse(str(path), name, "is missing")
    if (found := place.attrs.get("unit")) != field.unit:
        refuse(str(path), name, f"has unit {found} instead of {field.unit}")
    try:
        if name != "prolongation":
            return place[()]
        matrix = sparse.csr_array(tuple(place[part][()] for part in _PARTS), shape=tuple(place.attrs["shape"]))
        matrix.check_format(full_check=True)
        return matrix
    except (OSError, KeyError, TypeError, ValueError) as error:
        raise InputError(f"{path}: field {name} is damaged; delete the file and type make.") from error


FIELDS: dict[str, Field] = {
    name: kind.__metadata__[0]
    for name, kind in get_type_hints(Database, include_extras=True).items()
    if hasattr(kind, "__metadata__")
}


def check(values: dict[str, Any], where: str) -> None:
    """Raise InputError naming ``where`` and the first field of a database with a wrong shape, number or node."""
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
    """Raise InputError for a field whose shape is not that of its ``Field``; lengths : of earlier fields, by name."""
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


def database_of(body: Body, contacts: np.ndarray, forces: np.ndarray, coarse: np.ndarray, fine: np.ndarray) -> Database:
    """Return the database of k ``contacts`` (k,) under ``forces`` (k, 3) [N], from the responses of both meshes.

    coarse, fine : (k, n, 3) [m] of all nodes of the coarsest and the finest level
    Levels are nested and coarse nodes come first, so that the paper's coarse samples are the first nodes of the fine.
    """
    surface = body.fine.surface
    return Database(
        nodes_fine_surface=body.fine.nodes[surface],
        triangles=np.searchsorted(surface, body.fine.triangles),
        coarse_nodes=body.coarse.nodes,
        coarse_tetrahedra=body.coarse.tetrahedra,
        coarse_surface=body.coarse.surface,
        prolongation=body.prolongation[surface].tocsr(),
        contact_normals=body.coarse.normals[body.coarse.surface],
        contact=contacts,
        force=forces,
        fine=fine[:, surface],
        coarse_paper=fine[:, : len(body.coarse.nodes)],
        coarse_live=coarse,
        residual=np.full(len(contacts), 1e-8),
        seconds=np.zeros(len(contacts)),
        material=body.material,
        config_digest="hard cases",
    )
