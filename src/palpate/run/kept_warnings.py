"""Keep what jobs warn of: for the end of a run from their logs, for the report in files of their own."""

import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from palpate.files import write_whole

WARNED = "warning: "
"""How a warning begins in a job's log."""


@contextmanager
def about(place: str) -> Iterator[None]:
    """Begin each warning that is raised in the block with ``place``, such as "bodies.liver"; also if it fails."""
    caught: list[warnings.WarningMessage] = []
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", UserWarning)
            yield
    finally:
        for one in caught:
            text = f"{place}: {one.message}" if one.category is UserWarning else one.message
            warnings.warn_explicit(text, one.category, one.filename, one.lineno)


def in_logs(logs: Iterable[str | Path]) -> list[str]:
    """Return the warnings in the logs of jobs, each once; a log that is missing has none."""
    lines = [
        line.removeprefix(WARNED)
        for log in map(Path, logs)
        if log.is_file()
        for line in log.read_text(encoding="utf-8", errors="replace").splitlines()
        if line.startswith(WARNED)
    ]
    return list(dict.fromkeys(lines))


def save(lines: Iterable[str], path: str | Path) -> None:
    """Write warnings to a file, one a line and each once; it is empty if there are none."""
    with write_whole(path) as part:
        part.write_text("".join(f"{line}\n" for line in dict.fromkeys(lines)), encoding="utf-8")


def load(paths: Iterable[str | Path]) -> list[str]:
    """Read the warnings in files of ``save``, each once."""
    return list(dict.fromkeys(line for path in paths for line in Path(path).read_text(encoding="utf-8").splitlines()))
