"""Files that are written completely or not at all, and readers of small files."""

import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.errors import InputError

if TYPE_CHECKING:
    import h5py
    import jinja2
    import pandas as pd

PART = r"\..+\.part(\d+)(\..*)?"
"""The name of a file that ``write_whole`` has not finished; the number is its process."""


@contextmanager
def write_whole(path: Path | str) -> Iterator[Path]:
    """Yield a temporary name beside ``path``, and rename it to ``path`` if the block ends without an error."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.stem}.part{os.getpid()}{path.suffix}")
    try:
        yield temporary
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


@contextmanager
def read_hdf5(path: Path | str) -> Iterator["h5py.File"]:
    """Open a file that the workflow has made; InputError naming it if it, or what is read from it, is damaged."""
    import h5py

    try:
        with h5py.File(require_file(path), "r") as file:
            yield file
    except InputError:
        raise
    except (OSError, KeyError, RuntimeError, TypeError, ValueError) as error:
        why = " ".join(str(error).strip("'\"").split())
        raise InputError(f"{path} is damaged ({why}); delete it and type make.") from error


def read_yaml(path: Path | str) -> dict:
    """Read a YAML file of palpate's own; a user's is read by ``run.settings.read_settings``, with its faults."""
    import yaml

    return yaml.safe_load(Path(path).read_text(encoding="utf-8"))


def templates(folder: Path) -> "jinja2.Environment":
    """Return Jinja's environment for the templates in a folder; a name that a template does not get is an error."""
    import jinja2

    blocks: Any = {"trim_blocks": True, "lstrip_blocks": True, "keep_trailing_newline": True}
    return jinja2.Environment(loader=jinja2.FileSystemLoader(folder), undefined=jinja2.StrictUndefined, **blocks)


def require_file(path: str | Path) -> Path:
    """Return ``path``, a file that the workflow makes; raise InputError if it is missing."""
    if not Path(path).is_file():
        raise InputError(f"{path} is missing; type make, which makes it.")
    return Path(path)


def read_table(path: str | Path, columns: Sequence[str]) -> "pd.DataFrame":
    """Read a table that the workflow makes; raise InputError if it is missing or malformed or lacks a column."""
    import pandas as pd

    try:
        table = pd.read_csv(require_file(path))
    except pd.errors.EmptyDataError:
        table = pd.DataFrame()
    except (pd.errors.ParserError, UnicodeDecodeError) as error:
        raise InputError(f"{path} is damaged (not a table); delete it and type make.") from error
    if missing := [column for column in columns if column not in table]:
        raise InputError(f"{path} lacks the column(s) {', '.join(missing)}; delete it and type make.")
    return table


def merge(input: Any, output: Iterable[str]) -> None:
    """Put together each table of ``output`` whose parts ``input`` names, in the order of their jobs."""
    for path in output:
        if path.endswith(".csv") and (given := input.get(Path(path).stem)):
            parts = [Path(part).read_text().splitlines(keepends=True) for part in given]
            with write_whole(path) as temporary:
                temporary.write_text("".join([parts[0][0], *(line for part in parts for line in part[1:])]))


def save_warnings(lines: Iterable[str], path: str | Path) -> None:
    """Write warnings to a file, one a line and each once; it is empty if there are none."""
    with write_whole(path) as part:
        part.write_text("".join(f"{line}\n" for line in dict.fromkeys(lines)), encoding="utf-8")


def load_warnings(paths: Iterable[str | Path]) -> list[str]:
    """Read the warnings in files of ``save_warnings``, each once."""
    return list(dict.fromkeys(line for path in paths for line in Path(path).read_text(encoding="utf-8").splitlines()))


def check_file(place: str, path: str, there: bool) -> None:
    """Raise InputError, naming the key ``place`` of the settings, if a file that it names is not there."""
    if not there:
        raise InputError(
            f"{place} is {path}, where there is no file; give a path relative to the folder of the config file."
        )
