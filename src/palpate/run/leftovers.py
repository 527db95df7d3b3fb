"""Remove what runs that were killed left half-written."""

import os
import re
from pathlib import Path

from palpate.files import PART


def remove_leftovers(folder: Path) -> list[Path]:
    """Remove the temporary files of ``write_whole`` under ``folder`` whose process has ended, and return them.

    A process that began after the file was last changed is another one with the same number.
    """
    found = []
    for path in folder.rglob(".*"):
        part = re.fullmatch(PART, path.name)
        if part and path.is_file() and not _writes(int(part[1]), path):
            path.unlink(missing_ok=True)
            found.append(path)
    return found


def _writes(process: int, path: Path) -> bool:
    import psutil

    if process == os.getpid():
        return True
    try:
        found = psutil.Process(process)
        return found.status() != psutil.STATUS_ZOMBIE and found.create_time() <= path.stat().st_mtime + 1
    except (psutil.NoSuchProcess, FileNotFoundError):
        return False
