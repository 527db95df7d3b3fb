"""Store compiled functions so that an edit compiles again what it concerns, and jobs do not mix up each other's code.

Two faults of numba's own store are mended. It looks at the file of a function alone, and would go on using code whose
callee in another file has changed. And it numbers the versions of a function, one for each kind of arguments, as it
stores them, without a lock (its issue 4807): two processes that compile two versions at a time may take one number, and
a third gets one version's code for the other's arguments, an error, or wrong numbers without one. Numba calls ``init``
before it compiles anything, as pyproject.toml names it among ``numba_extensions``.
"""

import fcntl
import hashlib
import time
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

from numba.core.caching import Cache, IndexDataCacheFile

STARTED_S = time.time()
"""When this module was imported, by this process or by that which it is a copy of."""
_load_overload = Cache.load_overload


def init() -> None:
    """Have numba look for compiled code with ``load_overload`` and store it with ``save``."""
    Cache.load_overload = load_overload  # type: ignore[method-assign]
    IndexDataCacheFile.save = save  # type: ignore[method-assign]


def load_overload(self: Any, sig: Any, context: Any) -> Any:
    """Load a function's code if none that it was compiled from has changed, in the place of ``Cache.load_overload``."""
    self._cache_file._source_stamp = stamp(Path(self._impl.locator._py_file))
    return _load_overload(self, sig, context) if self._cache_file._source_stamp else None


@cache
def stamp(file: Path) -> tuple[str, str] | None:
    """Return what changes when code that functions of ``file`` may be compiled from does, there or where it imports.

    Of a file outside of palpate, such as a user's law, every edit counts. None if one was edited since this process
    began, which may have imported it before: then nothing is loaded, and nothing stored.
    """
    from palpate.run.dependencies import PACKAGE, closure, kernels  # here, as the server of jobs imports this module

    if any(path.stat().st_mtime > STARTED_S for path in closure([file])):
        return None
    own = "" if file.is_relative_to(PACKAGE) else hashlib.sha256(file.read_bytes()).hexdigest()
    return own, kernels(file)


def save(self: Any, key: tuple, data: Any) -> None:
    """Store ``data`` under a digest of its ``key``, in the place of ``IndexDataCacheFile.save``, unless it may be old.

    On a file system without locks one of two that are stored at a time may be forgotten, and is compiled once more.
    """
    if not self._source_stamp:
        return
    name = self._data_name(int(hashlib.sha256(repr(key).encode()).hexdigest()[:12], 16))
    self._save_data(name, data)
    with open(f"{self._index_path}.lock", "w") as file:
        with suppress(OSError):
            fcntl.flock(file, fcntl.LOCK_EX)
        self._save_index(self._load_index() | {key: name})
