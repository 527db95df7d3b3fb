"""Write and read a folder of questions: one format for all kinds, whose bytes repeat and whose files are checked.

A folder has questions.json, arrays in .npz files, meshes for other programs, README.md, and perhaps truth.npz. Its
digest is that of what is asked, numbers and all, but not of the truth nor of how files are packed.
"""

import hashlib
import io
import json
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from palpate.errors import InputError
from palpate.files import write_whole

FORMAT, VERSION = "palpate questions", 1
"""What questions.json says it is; increase the number with every change of the layout."""
DAMAGE = (ValueError, OSError, KeyError, EOFError, RuntimeError, MemoryError, zipfile.BadZipFile, zlib.error)
"""What reading a damaged file of arrays raises."""
HEAD, TRUTH = "questions.json", "truth"
Arrays = Mapping[str, np.ndarray]


@dataclass(frozen=True, eq=False)
class Questions:
    """Questions of any kind.

    info : content of questions.json without files and digest: kind, scene, body, law, materials, loads …
    arrays : by the stem of a file, the arrays in it
    truth : the arrays of the truth, or None where it is to be found when answers are scored
    """

    info: Mapping[str, Any]
    arrays: Mapping[str, Arrays]
    truth: Arrays | None = None

    @property
    def kind(self) -> str:
        """The kind of questions: press, touch or motion."""
        return str(self.info["kind"])

    @property
    def count(self) -> int:
        """The number of questions."""
        return len(self.info["loads"])

    @property
    def counted(self) -> str:
        """The number of questions in words."""
        return "1 question" if self.count == 1 else f"{self.count} questions"

    @property
    def points(self) -> np.ndarray:
        """The points (p, 3) [m] at rest whose displacements are asked for."""
        return self.arrays["asked"]["points_m"]

    @property
    def frames(self) -> tuple[int, ...]:
        """The shape of the instants of each question: (f,) of motions, () of static ones."""
        return (len(self.info["instants_s"]),) if "instants_s" in self.info else ()

    @property
    def digest(self) -> str:
        """A hash of all that is asked, which answers quote."""
        total = hashlib.sha256(json.dumps(self.info, sort_keys=True).encode())
        for stem in sorted(self.arrays):
            for name in sorted(self.arrays[stem]):
                array = np.ascontiguousarray(self.arrays[stem][name])
                total.update(f"{stem}/{name} {array.dtype.str} {array.shape}".encode())
                total.update(array.tobytes())
        return total.hexdigest()


def packed(arrays: Arrays) -> bytes:
    """Return an .npz file of ``arrays``; numpy dates each entry 1980, so that the bytes repeat."""
    buffer, named = io.BytesIO(), {name: np.asarray(arrays[name], order="C") for name in sorted(arrays)}
    np.savez_compressed(buffer, **named)  # type: ignore[arg-type]
    return buffer.getvalue()


def write(questions: Questions, folder: Path, pages: Mapping[str, bytes]) -> None:
    """Write a folder of questions; ``pages`` are further files by name, such as README.md.

    questions.json is written last, so that half a folder is none. InputError for a folder that has other files in it.
    """
    contents = {f"{stem}.npz": packed(arrays) for stem, arrays in questions.arrays.items()} | dict(pages)
    if questions.truth is not None:
        contents[f"{TRUTH}.npz"] = packed(questions.truth)
    folder = Path(folder)
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder} is a file; give a folder with --out.")
    others = {path.name for path in folder.glob("*")} - {HEAD} if folder.is_dir() else set()
    if others and not (folder / HEAD).is_file():
        raise InputError(f"{folder} has other files in it, such as {min(others)}; give a new folder with --out.")
    if foreign := others - set(contents):
        raise InputError(f"{folder} has {min(foreign)}, which is not of these questions; give a new folder with --out.")
    (folder / HEAD).unlink(missing_ok=True)
    for name, content in contents.items():
        with write_whole(folder / name) as temporary:
            temporary.write_bytes(content)
    sums = {name: hashlib.sha256(contents[name]).hexdigest() for name in sorted(contents)}
    head = {"format": FORMAT, "version": VERSION, "digest": questions.digest, **questions.info, "files": sums}
    with write_whole(folder / HEAD) as temporary:
        temporary.write_text(json.dumps(head, indent=1, ensure_ascii=True, allow_nan=False) + "\n", encoding="utf-8")


def read(folder: Path) -> Questions:
    """Read a folder of questions; InputError naming the file that is missing, changed or of another version."""
    head = _head(Path(folder))
    files, digest = head.pop("files"), head.pop("digest")
    del head["format"], head["version"]
    arrays: dict[str, dict[str, np.ndarray]] = {}
    for name, checksum in files.items():
        path = Path(folder) / name
        try:
            content = path.read_bytes()
        except OSError as error:
            raise InputError(f"{path} cannot be read ({error.strerror}); have the questions written anew.") from error
        if hashlib.sha256(content).hexdigest() != checksum:
            raise InputError(
                f"{path} is not as it was written (its checksum differs); have the questions written anew."
            )
        if path.suffix == ".npz":
            with np.load(io.BytesIO(content), allow_pickle=False) as file:
                arrays[path.stem] = {each: file[each] for each in file.files}
    questions = Questions(head, arrays, arrays.pop(TRUTH, None))
    if questions.digest != digest:
        raise InputError(f"{Path(folder) / HEAD}: digest is not that of its questions; have them written anew.")
    return questions


def _head(folder: Path) -> dict[str, Any]:
    """Read questions.json of a folder; InputError where it is missing, damaged or of another version."""
    path = folder / HEAD
    try:
        head = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path} cannot be read ({error.strerror}); give a folder that palpate ask wrote.") from error
    except ValueError as error:
        raise InputError(f"{path} is damaged ({error}); have the questions written anew.") from error
    if not isinstance(head, dict) or head.get("format") != FORMAT:
        raise InputError(f"{path}: format is not {FORMAT!r}; give a folder that palpate ask wrote.")
    if head.get("version") != VERSION:
        raise InputError(f"{path}: version is {head.get('version')}, and this palpate reads {VERSION}; ask anew.")
    if missing := sorted({"digest", "files", "kind", "scene", "loads"} - set(head)):
        raise InputError(f"{path}: {missing[0]} is missing; have the questions written anew.")
    return head
