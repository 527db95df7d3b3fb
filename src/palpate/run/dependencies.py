"""The modules that a script depends on, and a digest of what they do: jobs are repeated when it changes.

Snakemake does not notice edits of imported modules, and takes a script for changed when its date has changed.
"""

import ast
import json
from collections.abc import Iterable, Iterator
from contextlib import suppress
from functools import cache
from hashlib import sha256
from pathlib import Path

from palpate.files import write_whole

PACKAGE = Path(__file__).parents[1]
WRAPPERS = frozenset(
    PACKAGE / name
    for name in ("run/job.py", "run/kept_warnings.py", "files.py", "errors.py", "run/system_faults.py", "__init__.py")
)
"""Modules around the work; no result depends on them."""
KEPT = PACKAGE / "__pycache__" / "facts.json"
FACTS = 2000
"""Files of which facts are kept: all modules several times over."""
_FRESH: list[str] = []


def digest(script: Path, *lazily: str) -> str:
    """Return a digest of the code of ``script``, of the modules named ``lazily``, and of all that these import.

    Comments, docstrings and layout do not count, nor do the dates of the files.

    lazily : modules ("palpate.effects.gravity") or packages ("palpate.effects") that are imported by name at run time
    """
    modules = closure([script, *(path for name in lazily for path in files_of(name))])
    _keep()
    return sha256("".join(f"{path.name}{_facts(path)['code']}" for path in sorted(modules)).encode()).hexdigest()[:16]


def closure(paths: Iterable[Path]) -> set[Path]:
    """Return ``paths`` and every module of palpate that they import, directly or not, wrappers apart."""
    found: set[Path] = set()
    waiting = set(paths)
    while waiting:
        found |= waiting
        waiting = {module for path in waiting for module in imported(path)} - found - WRAPPERS
    return found


def files_of(name: str) -> list[Path]:
    """Return the file of a module of palpate, or all files of a package and of the packages inside it."""
    place = PACKAGE.parent / name.replace(".", "/")
    return sorted(place.rglob("*.py")) if place.is_dir() else [place.with_suffix(".py")]


@cache
def imported(path: Path) -> frozenset[Path]:
    """Return the modules of palpate that a file imports anywhere in it."""
    return frozenset(found for name in _facts(path)["imports"] if (found := _module(name)))


def _module(name: str) -> Path | None:
    """Return the file of a module or package of palpate, or None for what is not one."""
    if not name.startswith("palpate."):
        return None
    place = PACKAGE.parent / name.replace(".", "/")
    return next((path for path in (place.with_suffix(".py"), place / "__init__.py") if path.is_file()), None)


@cache
def _facts(path: Path) -> dict:
    """Return what a file imports, and a digest of its code; kept from run to run, as parsing all modules takes long."""
    text = path.read_bytes()
    known, key = _kept(), sha256(text).hexdigest()
    if key not in known:
        tree = ast.parse(text)
        known[key] = {"imports": sorted(set(_names(tree))), "code": _digest_of(tree)}
        _FRESH.append(key)
    return known[key]


def _keep() -> None:
    """Write the facts of files that are new; where nothing can be written they are worked out again."""
    if _FRESH:
        if len(_kept()) > FACTS:
            _kept().clear()
        with suppress(OSError), write_whole(KEPT) as temporary:
            temporary.write_text(json.dumps(_kept()))
        _FRESH.clear()


@cache
def _kept() -> dict[str, dict]:
    """Return the facts of files that were met before, by the digest of their text."""
    with suppress(OSError, ValueError):
        return json.loads(KEPT.read_text())
    return {}


def _names(tree: ast.Module) -> Iterator[str]:
    """Yield the dotted name of everything of palpate that a module imports, and of what it imports from there."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name.startswith("palpate"))
        elif isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("palpate"):
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def _digest_of(tree: ast.Module) -> str:
    """Return a digest of a syntax tree, which loses its docstrings and the words of its tables."""
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list) and body:
            body[:] = [line for line in body if not _is_text(line)] or [ast.Pass()]
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "Table":
            node.args[1:] = [ast.Constant(_columns(one)) for one in node.args[2:3]]
    return sha256(ast.dump(tree).encode()).hexdigest()


def _columns(about: ast.AST) -> list[str]:
    """Return the columns that a declared table names, without their meanings."""
    text = about.value if isinstance(about, ast.Constant) else ""
    return [line.partition(":")[0].strip() for line in str(text).splitlines()]


def _is_text(line: ast.AST) -> bool:
    """Return whether a statement is a string that stands alone: a docstring, or the description of a constant."""
    return isinstance(line, ast.Expr) and isinstance(line.value, ast.Constant) and isinstance(line.value.value, str)
