"""Store compiled functions so that an edit compiles again what it concerns, and jobs do not mix up each other's code.

Faults of numba's own store are mended. It looks at the file of a function alone, and would go on using code whose
callee in another file has changed. Processes that want a function at a time each compile it. And it numbers the
versions of a function, one for each kind of arguments, as it stores them, without a lock (its issue 4807): two
processes that compile two versions at a time may take one number, and a third gets one version's code for the other's
arguments, an error, or wrong numbers without one. Besides, wherever a part of an array is assigned another array numba
compiles what formats both shapes for an error, 3 s in every process: here that error is raised without them. Numba
calls ``init`` before it compiles anything, as pyproject.toml names it among ``numba_extensions``.
"""

import fcntl
import hashlib
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any

from numba.core.caching import Cache, IndexDataCacheFile
from numba.core.compiler_lock import global_compiler_lock
from numba.core.dispatcher import Dispatcher
from numba.extending import overload
from numba.np import arrayobj

STARTED_S = time.time()
"""When this module was imported, by this process or by that which it is a copy of."""
_load_overload, _compile = Cache.load_overload, Dispatcher.compile
_COMPILING: set[str] = set()
"""Functions that this process compiles."""


def init() -> None:
    """Have numba compile, look for compiled code, and store it, with the functions below."""
    Dispatcher.compile = compile_alone  # type: ignore[method-assign]
    Cache.load_overload = load_overload  # type: ignore[method-assign]
    IndexDataCacheFile.save = save  # type: ignore[method-assign]
    overload(_differ)(arrayobj.ol_raise_with_shape_context_generic)
    arrayobj.raise_with_shape_context = _differ


def _differ(src_shapes: Any, index_shape: Any) -> None:
    """Raise that one array does not fit into a part of another; compiled only."""
    raise NotImplementedError


def compile_alone(self: Any, sig: Any) -> Any:
    """Load or compile a function while no other process does, in the place of ``Dispatcher.compile``.

    The lock ends with its process. Whoever holds a function's may wait for that of a callee, never of a caller.
    """
    index = getattr(getattr(self._cache, "_cache_file", None), "_index_path", None)
    with global_compiler_lock:  # first: another thread may hold it, and wait for the same function
        if index is None or index in _COMPILING:
            return _compile(self, sig)
        _COMPILING.add(index)
        try:
            with _locked(f"{index}.compiling"):
                return _compile(self, sig)
        finally:
            _COMPILING.remove(index)


@contextmanager
def _locked(path: str) -> Iterator[None]:
    """Wait until no other process has locked a file; do not where none can be written or locked."""
    with ExitStack() as held:
        with suppress(OSError):
            Path(path).parent.mkdir(parents=True, exist_ok=True)
            fcntl.flock(held.enter_context(open(path, "w")), fcntl.LOCK_EX)
        yield


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
    outside = "" if file.is_relative_to(PACKAGE) else hashlib.sha256(file.read_bytes()).hexdigest()
    return outside, kernels(file)


def save(self: Any, key: tuple, data: Any) -> None:
    """Store ``data`` under a digest of its ``key``, in the place of ``IndexDataCacheFile.save``, unless it may be old.

    On a file system without locks one of two that are stored at a time may be forgotten, and is compiled once more.
    """
    if not self._source_stamp:
        return
    name = self._data_name(int(hashlib.sha256(repr(key).encode()).hexdigest()[:12], 16))
    self._save_data(name, data)
    with _locked(f"{self._index_path}.lock"):
        self._save_index(self._load_index() | {key: name})
