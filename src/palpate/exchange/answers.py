"""Read a file of an engine's answers, .npz or HDF5; what cannot be scored is an InputError of one sentence."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, NamedTuple

import numpy as np

from palpate.benchmark.engine_scores import OWN
from palpate.errors import InputError, suggest
from palpate.exchange.folder import DAMAGE, Questions

TEXTS = ("digest", "engine", "version", "hardware", "law")
LISTS = ("settings", "converged")
NEEDED = ("displacement_m", "seconds", "preparation_s")
OPTIONAL = ("failed", "nodes_m", "triangles", "memory_mb")
LEAST_SETTINGS = 3
"""Fewer settings are scored, but make no curve."""
FARTHEST_M = 1e12
"""Displacement [m] beyond which an answer is none, as squares of it overflow at last."""
LARGEST = 4e9
"""Bytes of an array beyond which none is read: what a file's head claims may not be in it, nor fit."""
LONGEST = 200
"""Characters that a name may have, as tables show it."""


class Wanted(NamedTuple):
    """Further numbers that answers have for each question: whether they are needed, and the shape of one."""

    needed: bool
    shape: tuple[int, ...] = ()


@dataclass(frozen=True, eq=False)
class Setting:
    """The answers of one setting of an engine to k questions.

    displacement : (k, p, 3) [m] at the asked points, or (k, n, 3) at ``nodes``; of motions (k, f, p, 3), at f
        instants; NaN where the engine failed
    failed : (k,) truth values; seconds : (k, r) [s] of r calls each
    nodes, triangles : (n, 3) [m], (t, 3) of a mesh of the engine's own, or None
    memory_mb : [1e6 bytes], NaN where it is not known
    numbers : further answers of each question, (k, …) each, by name
    """

    name: str
    converged: bool
    displacement: np.ndarray
    failed: np.ndarray
    seconds: np.ndarray
    preparation_s: float
    memory_mb: float
    nodes: np.ndarray | None
    triangles: np.ndarray | None
    numbers: Mapping[str, np.ndarray]


@dataclass(frozen=True, eq=False)
class Answers:
    """The content of a file of answers; warnings : a sentence for each oddity of it."""

    engine: str
    version: str
    hardware: str
    law: str
    settings: tuple[Setting, ...]
    warnings: tuple[str, ...]


def read_answers(path: Path, questions: Questions, numbers: Mapping[str, Wanted]) -> Answers:
    """Read and check a file of answers to ``questions``.

    numbers : further answers to each question of this kind, by name
    InputError naming the file and the field for anything that is missing, unknown or impossible.
    """
    file = _File(path, _load(Path(path)))
    texts = {name: file.text(name) for name in TEXTS}
    if texts["digest"] != questions.digest:
        scene = questions.info["scene"]
        raise file.wrong(
            "digest", f"is of other questions than these, of {scene}", "answer these, and quote their digest"
        )
    if texts["engine"] == OWN:
        raise file.wrong("engine", f"is {OWN}, as tables call its own models", "give another name")
    names, converged = file.names("settings"), file.marks("converged", None)
    if len(converged) != len(names):
        raise file.wrong("converged", f"has {len(converged)} values for {len(names)} settings", "give one for each")
    allowed = {*TEXTS, *LISTS} | {
        f"setting_{i}/{name}" for i in range(len(names)) for name in (*NEEDED, *OPTIONAL, *numbers)
    }
    if extra := sorted(set(file.arrays) - allowed):
        number = extra[0].partition("/")[0].removeprefix("setting_")
        if number.isdecimal() and int(number) >= len(names):
            what = f"has {len(names)} names, and there is {extra[0]}"
            raise file.wrong("settings", what, "give a name for each setting, numbers from 0 on")
        raise file.wrong(extra[0], "is no name of an answer", suggest(extra[0], sorted(allowed), "take").rstrip("."))
    settings = tuple(_setting(file, i, name, bool(converged[i]), questions, numbers) for i, name in enumerate(names))
    warned = []
    if len(names) < LEAST_SETTINGS:
        warned.append(f"{path} has {len(names)} of the {LEAST_SETTINGS} settings that make a curve.")
    if not converged.any():
        warned.append(
            f"{path} marks no setting as converged, so that nothing tells the mesh's error from the solver's."
        )
    return Answers(texts["engine"], texts["version"], texts["hardware"], texts["law"], settings, tuple(warned))


def _setting(
    file: "_File", i: int, name: str, converged: bool, questions: Questions, numbers: Mapping[str, Wanted]
) -> Setting:
    """Read and check the answers of setting number ``i``; InputError as of ``read_answers``."""
    place, k = f"setting_{i}/", questions.count
    field, moved, nodes, triangles = place + "displacement_m", file.floats(place + "displacement_m"), None, None
    points, what = len(questions.points), "the asked points"
    if file.has(place + "nodes_m") or file.has(place + "triangles"):
        nodes, triangles = _mesh(file, place, questions)
        points, what = len(nodes), "its nodes_m"
    counted = "questions, instants" if questions.frames else "questions"
    file.shaped(field, moved, (k, *questions.frames, points, 3), f"{counted}, {what}, and x, y, z")
    failed = file.marks(place + "failed", k) if file.has(place + "failed") else np.zeros(k, dtype=bool)
    file.answered(field, moved, failed, f"mark that as failed in {place}failed")
    sizes = np.nan_to_num(np.abs(moved)).reshape(k, -1).max(axis=1)
    if (burst := sizes > FARTHEST_M).any():
        what = f"is {sizes.max():.1g} m in question {int(np.flatnonzero(burst)[0])}"
        raise file.wrong(field, what, f"give NaN for what burst, and mark it as failed in {place}failed")
    if (contradicting := failed & np.isfinite(moved).reshape(k, -1).any(axis=1)).any():
        where = int(np.flatnonzero(contradicting)[0])
        raise file.wrong(place + "failed", f"marks question {where}, which has an answer", "give NaN there, or no mark")
    seconds = file.floats(place + "seconds")
    if seconds.ndim not in (1, 2) or len(seconds) != k or not seconds.size:
        raise file.wrong(place + "seconds", f"has the shape {seconds.shape}", f"give ({k},), or ({k}, calls)")
    file.answered(place + "seconds", seconds, failed, "give the time it took")
    if (seconds[~failed] <= 0.0).any():
        raise file.wrong(place + "seconds", f"has {seconds[~failed].min():g} s", "give times above 0")
    return Setting(
        name, converged, moved, failed, seconds.reshape(k, -1), file.number(place + "preparation_s"),
        file.number(place + "memory_mb") if file.has(place + "memory_mb") else np.nan, nodes, triangles,
        {each: _numbers(file, place + each, failed, wanted) for each, wanted in numbers.items()},
    )  # fmt: skip


def _mesh(file: "_File", place: str, questions: Questions) -> tuple[np.ndarray, np.ndarray]:
    """Read nodes and triangles of the engine's own mesh; InputError where they are none, or not around the body."""
    nodes, triangles = file.floats(place + "nodes_m"), file.get(place + "triangles")
    if nodes.ndim != 2 or nodes.shape[1] != 3 or not len(nodes):
        raise file.wrong(place + "nodes_m", f"has the shape {nodes.shape}", "give (nodes, 3)")
    if not np.isfinite(nodes).all():
        raise file.wrong(place + "nodes_m", "is not finite", "give the rest positions")
    if triangles.ndim != 2 or triangles.shape[1] != 3 or not len(triangles) or triangles.dtype.kind not in "iu":
        what = f"is {triangles.dtype} of the shape {triangles.shape}"
        raise file.wrong(place + "triangles", what, "give whole numbers (triangles, 3), nodes of the surface")
    if not 0 <= triangles.min() <= triangles.max() < len(nodes):
        raise file.wrong(
            place + "triangles", "names nodes that nodes_m does not have", f"count from 0 to {len(nodes) - 1}"
        )
    body_box, mesh_box, size = _box(questions.points), _box(nodes[np.unique(triangles)]), questions.info["size_m"]
    if np.abs(mesh_box - body_box).max() > BOX_APART * size:
        name, has = "triangles", "has nodes"
        if np.abs(_box(nodes) - body_box).max() > BOX_APART * size:
            name, has = "nodes_m", "lies"
        (low, high), (least, largest) = mesh_box.round(4).tolist(), body_box.round(4).tolist()
        box = f"the body lies between {least} and {largest}"
        raise file.wrong(place + name, f"{has} between {low} and {high} m", box)
    return nodes, triangles.astype(np.int64)


def _box(points: np.ndarray) -> np.ndarray:
    """Return the least and the largest coordinates (2, 3) of points."""
    return np.array([points.min(axis=0), points.max(axis=0)])


BOX_APART = 0.2
"""Share of the body's size by which the box around a mesh of the engine's own may differ from the body's."""


def _numbers(file: "_File", name: str, failed: np.ndarray, wish: Wanted) -> np.ndarray:
    """Read further numbers of each question, NaN if the file lacks them and they are not needed."""
    shape = (len(failed), *wish.shape)
    if not wish.needed and not file.has(name):
        return np.full(shape, np.nan)
    values = file.floats(name)
    file.shaped(
        name, values, shape, "questions, instants, instruments, and x, y, z" if wish.shape else "one a question"
    )
    file.answered(name, values, failed, "give it")
    return values


class _File:
    """The arrays of a file by name, with methods that return one of the right kind or raise an InputError."""

    def __init__(self, path: Path, arrays: Mapping[str, np.ndarray]):
        self.path, self.arrays = path, arrays

    def wrong(self, name: str, what: str, remedy: str) -> InputError:
        """Return the error of a field: one sentence."""
        return InputError(f"{self.path}: {name} {what}; {remedy}{'' if remedy.endswith('?') else '.'}")

    def has(self, name: str) -> bool:
        return name in self.arrays

    def get(self, name: str) -> np.ndarray:
        if name not in self.arrays:
            raise self.wrong(name, "is missing", "add it, as README.md of the questions says")
        return self.arrays[name]

    def shaped(self, name: str, values: np.ndarray, wanted: tuple[int, ...], of: str) -> None:
        """Raise InputError for an array of another shape than ``wanted``; of : what its dimensions count."""
        if values.shape != wanted:
            raise self.wrong(name, f"has the shape {values.shape}", f"give {wanted}: {of}")

    def answered(self, name: str, values: np.ndarray, failed: np.ndarray, remedy: str) -> None:
        """Raise InputError for numbers (k, …) that are not finite in a question that has not ``failed`` (k,)."""
        unanswered = ~failed & ~np.isfinite(values).reshape(len(failed), -1).all(axis=1)
        if unanswered.any():
            raise self.wrong(name, f"is not finite in question {int(np.flatnonzero(unanswered)[0])}", remedy)

    def text(self, name: str) -> str:
        value = self.get(name)
        if value.dtype.kind != "U" or value.ndim != 0:
            raise self.wrong(name, f"is {_kind(value)}", "give a text")
        return self._named(name, value, "is empty" if not str(value).strip() else "is no name")

    def names(self, name: str) -> list[str]:
        """Return a list of texts that all differ."""
        values = self.get(name)
        if values.dtype.kind != "U" or values.ndim != 1 or not len(values):
            raise self.wrong(name, f"is {_kind(values)}", "give a list of texts, a name for each setting")
        texts = [self._named(name, each, f"has the name {str(each)[:20]!r}") for each in values]
        if len(set(texts)) < len(texts):
            twice = next(text for text in texts if texts.count(text) > 1)
            raise self.wrong(name, f"has {twice!r} twice", "give each setting a name of its own")
        return texts

    def _named(self, name: str, value: Any, what: str) -> str:
        text = str(value).strip()
        if not text or len(text) > LONGEST or not text.isprintable():
            raise self.wrong(name, what, f"give 1 to {LONGEST} printable letters")
        return text

    def marks(self, name: str, count: int | None) -> np.ndarray:
        values = self.get(name)
        exact = values.dtype.kind == "b" or (values.dtype.kind in "iu" and np.isin(values, (0, 1)).all())
        if not exact or values.ndim != 1 or (count is not None and len(values) != count):
            many = "one for each setting" if count is None else f"{count} of them"
            raise self.wrong(name, f"is {_kind(values)}", f"give truth values, {many}")
        return values.astype(bool)

    def floats(self, name: str) -> np.ndarray:
        values = self.get(name)
        if values.dtype.kind not in "fiu":
            raise self.wrong(name, f"is {_kind(values)}", "give real numbers")
        return values.astype(float)

    def number(self, name: str) -> float:
        values = self.floats(name)
        if values.size != 1 or not np.isfinite(values).all() or not values.ravel()[0] >= 0.0:
            raise self.wrong(name, f"is {values.ravel()[:3].tolist()}", "give one number of 0 or more")
        return float(values.ravel()[0])


def _kind(array: np.ndarray) -> str:
    """Describe an array in few words."""
    names: dict[str, Any] = {"U": "text", "S": "bytes", "b": "truth values", "O": "objects", "c": "complex numbers"}
    what = names.get(array.dtype.kind, "numbers")
    return what if array.ndim == 0 else f"{what} of the shape {array.shape}"


def _load(path: Path) -> dict[str, np.ndarray]:
    """Read all arrays of a file; InputError if it is none."""
    try:
        with open(path, "rb") as file:
            start = file.read(8)
    except OSError as error:
        raise InputError(f"{path} cannot be read ({error.strerror}); give a file of answers.") from error
    try:
        if start == b"\x89HDF\r\n\x1a\n":
            return _hdf5(path)
        if not start.startswith(b"PK"):
            raise ValueError("it is neither .npz nor HDF5")
        with np.load(path, allow_pickle=False) as archive:
            for name in archive.zip.namelist():
                with archive.zip.open(name) as member:
                    _allowed(name.removesuffix(".npy"), *_claimed(member))
            return {name: archive[name] for name in archive.files}
    except DAMAGE as error:
        why = " ".join(str(error).split())
        if "allow_pickle" in why:
            why = "it holds Python objects"
        raise InputError(f"{path} is no file of answers ({why}); write it with numpy.savez, or as HDF5.") from error


def _claimed(member: IO[bytes]) -> tuple[tuple[int, ...], np.dtype]:
    """Return the shape and the type of an array by the head of its .npy file, without reading it."""
    version = np.lib.format.read_magic(member)
    head = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, _, kind = head(member)
    return shape, kind


def _allowed(name: str, shape: tuple[int, ...], kind: np.dtype) -> None:
    """Raise ValueError for an array that is too large to be an answer."""
    if math.prod(shape) * kind.itemsize > LARGEST:
        raise ValueError(f"{name} of the shape {shape} would take more than {LARGEST / 1e9:g} GB")


def _hdf5(path: Path) -> dict[str, np.ndarray]:
    """Read all arrays of an HDF5 file, those in groups by their path; ValueError for one that is too large."""
    import h5py

    arrays: dict[str, np.ndarray] = {}

    def take(name: str, thing: object) -> None:
        if isinstance(thing, h5py.Dataset):
            _allowed(name, thing.shape or (), thing.dtype)
            text = h5py.check_string_dtype(thing.dtype) is not None
            arrays[name] = np.array(thing.asstr()[()], dtype=str) if text else np.asarray(thing[()])

    with h5py.File(path, "r") as file:
        file.visititems(take)
    return arrays
