"""Store each compiled function under a name of its own, so that jobs that compile at a time do not mix theirs up.

Numba numbers the versions of a function, one for each kind of arguments, as it stores them, without a lock (its issue
4807). Two processes that compile two versions at a time may take one number, and a third gets one version's code for
the other's arguments: an error, or wrong numbers without one. Numba calls ``init`` before it compiles anything, as
pyproject.toml names it among ``numba_extensions``.
"""

import fcntl
import hashlib
from contextlib import suppress
from typing import Any

from numba.core.caching import IndexDataCacheFile


def init() -> None:
    """Have numba store what it compiles with ``save``."""
    IndexDataCacheFile.save = save  # type: ignore[method-assign]


def save(self: Any, key: tuple, data: Any) -> None:
    """Store ``data`` under a digest of its ``key``, in the place of ``IndexDataCacheFile.save``.

    On a file system without locks one of two that are stored at a time may be forgotten, and is compiled once more.
    """
    name = self._data_name(int(hashlib.sha256(repr(key).encode()).hexdigest()[:12], 16))
    self._save_data(name, data)
    with open(f"{self._index_path}.lock", "w") as file:
        with suppress(OSError):
            fcntl.flock(file, fcntl.LOCK_EX)
        self._save_index(self._load_index() | {key: name})
