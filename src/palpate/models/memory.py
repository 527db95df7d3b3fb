"""Measure how much memory a prepared model holds."""

from functools import partial
from types import FunctionType, MethodType, ModuleType
from typing import Any

import numpy as np

_PLAIN = (str, bytes, int, float, bool, complex, type(None), type)
_FOREIGN = ("numba", "llvmlite", "ctypes", "_ctypes")
"""Packages whose objects are code, and lead to everything that was ever compiled."""


def held_mb(held: object) -> float:
    """Count the megabytes (1e6 bytes) of the arrays and sparse factors that ``held`` reaches, each counted once.

    Follows attributes, containers, partial calls and what functions closed over. Sparse LU factors count
    12 bytes a stored number. Small objects and code do not count.
    """
    total = 0
    waiting: list[Any] = [held]
    seen: dict[int, object] = {}  # the objects too, so that no number of one is given to another
    while waiting:
        thing = waiting.pop()
        if isinstance(thing, _PLAIN) or id(thing) in seen:
            continue
        seen[id(thing)] = thing
        if isinstance(thing, np.ndarray):
            if isinstance(thing.base, np.ndarray):
                waiting.append(thing.base)
            else:
                total += thing.nbytes
        elif type(thing).__name__ == "SuperLU":
            total += 12 * thing.nnz
        else:
            waiting += _inside(thing)
    return total / 1e6


def _inside(thing: object) -> list[object]:
    if isinstance(thing, ModuleType) or type(thing).__module__.split(".")[0] in _FOREIGN:
        return []
    if isinstance(thing, dict):
        return list(thing.values())
    if isinstance(thing, list | tuple | set | frozenset):
        return list(thing)
    if isinstance(thing, partial):
        return [thing.func, thing.args, thing.keywords]
    if isinstance(thing, MethodType):
        return [thing.__self__]
    if isinstance(thing, FunctionType):
        return [cell.cell_contents for cell in thing.__closure__ or ()]
    slots = [getattr(thing, name, None) for name in getattr(type(thing), "__slots__", ())]
    return slots + list(getattr(thing, "__dict__", {}).values())
