"""Store and read the database of paper 1: corresponding coarse and fine deformations of one body, and its meshes."""

from dataclasses import asdict, dataclass, fields, replace
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import sparse

from palpate.benchmark.database_fields import FIELDS, check, refuse
from palpate.bodies.material import Material
from palpate.errors import InputError
from palpate.files import read_hdf5, write_whole

if TYPE_CHECKING:
    import h5py

FORMAT = 2
_PARTS = ("data", "indices", "indptr")


@dataclass(frozen=True, eq=False)
class Database:
    """k samples of one body in one regime of loads.

    nodes_fine_surface : (n, 3) [m], rest positions of the fine surface nodes
    triangles : the fine surface, node numbers 0 … n−1
    coarse_nodes, coarse_tetrahedra : the whole coarse mesh, (N, 3) [m] and (·, 4)
    coarse_surface : (m,) increasing numbers of the coarse surface nodes
    prolongation : (n, N) sparse, linear interpolation from all coarse nodes to the fine surface nodes
    contact_normals : (m, 3) outward unit normals of the coarse surface nodes at rest
    contact : (k,) coarse node number of each sample's contact; force : (k, 3) [N]
    fine : (k, n, 3) [m]; coarse_paper, coarse_live : (k, N, 3) [m], displacements of the two protocols
    residual : (k,) relative residual of the fine solutions
    seconds : (k,) what simulating each sample took on the fine and on the coarse mesh together [s]
    config_digest : identifies the settings the samples were made with
    """

    nodes_fine_surface: np.ndarray
    triangles: np.ndarray
    coarse_nodes: np.ndarray
    coarse_tetrahedra: np.ndarray
    coarse_surface: np.ndarray
    prolongation: sparse.csr_array
    contact_normals: np.ndarray
    contact: np.ndarray
    force: np.ndarray
    fine: np.ndarray
    coarse_paper: np.ndarray
    coarse_live: np.ndarray
    residual: np.ndarray
    seconds: np.ndarray
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
    """Write ``db`` with checksums under a temporary name and rename it; InputError if a field is wrong."""
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
