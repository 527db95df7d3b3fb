"""Files that are whole or not there, and small ones that are read at once."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


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
