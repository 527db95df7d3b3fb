"""Files that are written completely or not at all, and readers of small files."""

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.errors import InputError

if TYPE_CHECKING:
    import pandas as pd


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


def read_yaml(path: Path | str) -> dict:
    """Read a YAML file of the workflow."""
    import yaml

    return yaml.safe_load(Path(path).read_text(encoding="utf-8"))


def require_file(path: str | Path) -> Path:
    """Return ``path``, a file that the workflow makes; raise InputError if it is missing."""
    if not Path(path).is_file():
        raise InputError(f"{path} is missing: make it with the workflow (make) first")
    return Path(path)


def read_table(path: str | Path, columns: Sequence[str]) -> "pd.DataFrame":
    """Read a table that the workflow makes; raise InputError if it is missing or malformed or lacks a column."""
    import pandas as pd

    try:
        table = pd.read_csv(require_file(path))
    except pd.errors.EmptyDataError:
        table = pd.DataFrame()
    except (pd.errors.ParserError, UnicodeDecodeError) as error:
        raise InputError(f"{path} is not a table: delete it and make it again") from error
    if missing := [column for column in columns if column not in table]:
        raise InputError(f"{path} lacks the column(s) {', '.join(missing)}: delete it and make it again")
    return table


def check_file(place: str, path: str, there: bool) -> None:
    """Raise InputError, naming the key ``place`` of the settings, if a file that it names is not there."""
    if not there:
        raise InputError(
            f"{place} is {path}, where there is no file; give a path relative to the folder of the config file."
        )
