"""Files that are whole or not there, and small ones that are read at once."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from palpate.errors import InputError


@contextmanager
def write_whole(path: Path | str) -> Iterator[Path]:
    """Give a temporary name beside ``path``, and rename it to ``path`` if the block ends without an error."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.stem}.part{os.getpid()}{path.suffix}")
    try:
        yield temporary
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def read_yaml(path: Path | str) -> dict:
    """What a YAML file of ours holds."""
    import yaml

    return yaml.safe_load(Path(path).read_text(encoding="utf-8"))


def read_csv(path: str | Path):
    """A table of comma-separated values, without columns if the file is empty; InputError if it is none."""
    import pandas as pd

    try:
        return pd.read_csv(path)
    except pd.errors.EmptyDataError:
        return pd.DataFrame()
    except (pd.errors.ParserError, UnicodeDecodeError) as error:
        raise InputError(f"{path} is no table: delete it and make it again") from error
