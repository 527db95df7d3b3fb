"""Store, check and read the database: corresponding coarse and fine deformations of one body, and its meshes.

Its samples are split into those for training, choosing settings and testing: as paper 1 does, and by folds of contacts.
"""

from collections.abc import Iterable
from dataclasses import asdict, dataclass, fields, replace
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, get_type_hints

import numpy as np
import pandas as pd
from scipy import sparse

from palpate.bodies.body import Body
from palpate.bodies.material import Material
from palpate.errors import InputError
from palpate.files import read_hdf5, read_table, write_whole

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
        if (stored := _attribute(path, file, "format")) != FORMAT:
            refuse(str(path), "format", f"is {stored} but this version reads {FORMAT}")
        values = {name: _load(path, file, name) for name in FIELDS}
        stored = {field.name: _attribute(path, file, field.name) for field in fields(Material)}
        law = str(stored.pop("law"))
        material = Material(**{name: float(value) for name, value in stored.items()}, law=law)
        config_digest = str(_attribute(path, file, "config_digest"))
    check(values, str(path))
    return Database(**values, material=material, config_digest=config_digest)


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
    dataset = file.get(f"{field.group}/{name}")
    if dataset is None:
        refuse(str(path), name, "is missing")
    if (unit := dataset.attrs.get("unit")) != field.unit:
        refuse(str(path), name, f"has unit {unit} instead of {field.unit}")
    try:
        if name != "prolongation":
            return dataset[()]
        matrix = sparse.csr_array(tuple(dataset[part][()] for part in _PARTS), shape=tuple(dataset.attrs["shape"]))
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
    """Raise InputError for a shape other than the ``Field``'s; lengths : by name of a dimension; new ones are added."""
    dims = FIELDS[name].shape
    if len(shape) != len(dims):
        refuse(where, name, f"has {len(shape)} dimensions instead of {len(dims)}")
    for length, dim in zip(shape, dims, strict=True):
        if length == 0:
            refuse(where, name, "is empty")
        if length != (dim if isinstance(dim, int) else lengths.setdefault(dim, length)):
            expected = tuple(dim if isinstance(dim, int) else lengths.get(dim, dim) for dim in dims)
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


def split(contact: np.ndarray, train: int, test: int, kind: str, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Split k samples at random into ``train`` and ``test`` ones; return the increasing sample numbers of both.

    contact : (k,) contact node of each sample, k = train + test
    kind : "samples" tests random samples, as the paper; "contacts" all samples of random contacts
    Raises InputError for an empty side, counts that do not add up to k, and counts that no set of whole contacts has.
    """
    n_samples = len(contact)
    if train < 1 or test < 1:
        raise InputError(f"split: train {train} and test {test} must both be at least 1.")
    if train + test != n_samples:
        raise InputError(f"split: train {train} and test {test} must add up to the {n_samples} samples there are.")
    random = np.random.default_rng(seed)
    if kind == "samples":
        shuffled = random.permutation(n_samples)
        return np.sort(shuffled[test:]), np.sort(shuffled[:test])
    if kind != "contacts":
        raise InputError(f"split: kind {kind!r} is unknown; use samples or contacts.")
    held_out = np.isin(contact, _contacts_with(contact, test, random))
    return np.flatnonzero(~held_out), np.flatnonzero(held_out)


def _contacts_with(contact: np.ndarray, wanted_count: int, random: np.random.Generator) -> np.ndarray:
    """Choose contacts with ``wanted_count`` samples in all: of each total in reach, one random choice is remembered."""
    nodes, counts = np.unique(contact, return_counts=True)
    chosen_of_total: dict[int, list[int]] = {0: []}
    for contact_index in random.permutation(len(nodes)):
        for total in sorted(chosen_of_total, reverse=True):
            larger_total = total + counts[contact_index]
            if larger_total <= wanted_count and larger_total not in chosen_of_total:
                chosen_of_total[larger_total] = [*chosen_of_total[total], contact_index]
    if wanted_count not in chosen_of_total:
        raise InputError(
            f"split: no set of whole contacts has {wanted_count} test samples; make test a multiple of those."
        )
    return nodes[chosen_of_total[wanted_count]]


SPLITS = ("samples", "contacts")
"""What a split of paper 1 holds out: random samples, which is the paper's, or whole contacts."""
SAMPLE_COLUMNS = ["sample", "contact", "peak_m", *SPLITS]


def sample_table(db: Database, train: int, test: int, seed: int) -> pd.DataFrame:
    """Tabulate the samples of ``db``: contact, peak [m], and "train" or "test" for each kind of split in SPLITS.

    train, test : numbers of samples; raises InputError if the samples cannot be divided so
    """
    table = pd.DataFrame({"sample": np.arange(len(db.contact)), "contact": db.contact, "peak_m": db.peaks})
    for kind in SPLITS:
        sides = np.full(len(table), "train", dtype=object)
        sides[split(db.contact, train, test, kind, seed)[1]] = "test"
        table[kind] = sides
    return table[SAMPLE_COLUMNS]


FOLDS = 5
"""The number of folds, and so of splits; a body with fewer contacts has as many as it has contacts."""
FOLD_COLUMNS = ["sample", "contact", "peak_m", "fold"]


def deal(contact: np.ndarray, seed: int) -> np.ndarray:
    """Deal the contacts at random into FOLDS equal folds; return the fold of each sample, (k,), from 1 on.

    contact : (k,) contact node of each sample; all samples of a contact are in one fold
    Raises InputError for fewer than three contacts: one for training, one for choosing settings, and one for testing.
    """
    nodes, node_of_sample = np.unique(contact, return_inverse=True)
    if len(nodes) < 3:
        raise InputError(f"tradeoff.contacts: {len(nodes)} contacts are too few to train, choose and test; give 3.")
    folds = np.empty(len(nodes), dtype=int)
    folds[np.random.default_rng(seed).permutation(len(nodes))] = np.arange(len(nodes)) % min(FOLDS, len(nodes)) + 1
    return folds[node_of_sample]


def fold_table(db: Database, seed: int) -> pd.DataFrame:
    """Return one row for each sample of ``db``: its contact, its peak [m] and its fold; InputError as in ``deal``."""
    columns = {"sample": np.arange(len(db.contact)), "contact": db.contact, "peak_m": db.peaks}
    return pd.DataFrame(columns | {"fold": deal(db.contact, seed)})[FOLD_COLUMNS]


def read_folds(path: Path | str) -> pd.DataFrame:
    """Read a table that ``fold_table`` made; InputError if it is missing or is no such table."""
    return read_table(path, FOLD_COLUMNS)


def fold_sides(samples: pd.DataFrame, split: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the sample numbers for training, for choosing settings (validation), and for testing in a ``split``.

    split : from 1 on; s tests on fold s, chooses on the next fold (after the last the first), trains on the others
    InputError for a split that the samples do not have.
    """
    folds = int(samples["fold"].max())
    if not 1 <= split <= folds:
        raise InputError(f"tradeoff.splits: there is no split {split}; the samples have the splits 1 to {folds}.")
    is_test, is_validation = (samples["fold"] == fold for fold in (split, split % folds + 1))
    return tuple(samples.loc[side, "sample"].to_numpy() for side in (~is_test & ~is_validation, is_validation, is_test))


def training_presses(samples: pd.DataFrame, split: int) -> np.ndarray:
    """Return one sample number for each training contact of a ``split``, increasing, of each of its presses in turn.

    For a model without training the errors there are those at unseen contacts.
    """
    train, *_ = fold_sides(samples, split)
    rows = samples.set_index("sample").loc[train].reset_index()
    chosen = [part["sample"].iloc[i % len(part)] for i, (_, part) in enumerate(rows.groupby("contact", sort=True))]
    return np.sort(np.array(chosen, dtype=int))


def asked_samples(samples: pd.DataFrame, splits: Iterable[int]) -> tuple[np.ndarray, np.ndarray]:
    """Return the sample numbers for choosing or testing in any of ``splits``, and those for testing, both increasing.

    The first need a truth, the second one on its finest level.
    """
    sides = [fold_sides(samples, split) for split in splits]
    tested = np.unique(np.concatenate([test for _, _, test in sides]))
    return np.unique(np.concatenate([tested, *(chooses for _, chooses, _ in sides)])), tested
