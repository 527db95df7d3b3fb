"""What accuracy costs in soft-tissue simulation: published methods and their rivals on the same bodies.

``import palpate as pp`` imports nothing else; each of ``dir(pp)`` is imported when it is used first. The classes are
those that the blocks of config.yaml become, and their fields have the names of its keys.
"""

import ast
from importlib import import_module
from pathlib import Path

_PLACES = {
    str(alias.asname): (line.module, alias.name)
    for line in ast.parse(Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8")).body
    if isinstance(line, ast.ImportFrom) and line.module
    for alias in line.names
}
"""The module of each public name and its name there, as the stub beside this file has them."""
__all__ = list(_PLACES)


def __getattr__(name: str) -> object:
    if name not in _PLACES:
        suggest = import_module("palpate.errors").suggest
        raise AttributeError(f"palpate has no {name}; {suggest(name, __all__, 'it has')}")
    module, own_name = _PLACES[name]
    globals()[name] = value = getattr(import_module(module), own_name)
    return value


def __dir__() -> list[str]:
    return __all__
