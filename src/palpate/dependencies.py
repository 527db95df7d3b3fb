"""The modules that a script depends on, and a digest of what they do: jobs are repeated when it changes.

Snakemake does not notice edits of imported modules, and takes a script for changed when its date has changed.
"""

import ast
from collections.abc import Iterable, Iterator
from functools import cache
from hashlib import sha256
from pathlib import Path

PACKAGE = Path(__file__).parent
WRAPPERS = frozenset(PACKAGE / name for name in ("job.py", "files.py", "errors.py", "__init__.py"))
"""Modules around the work; no result depends on them."""


def digest(script: Path, *lazily: str) -> str:
    """Return a digest of the code of ``script``, of the modules named ``lazily``, and of all that these import.

    Comments, docstrings and layout do not count, nor do the dates of the files.

    lazily : modules ("palpate.effects.gravity") or packages ("palpate.effects") that are imported by name at run time
    """
    modules = closure([script, *(path for name in lazily for path in files_of(name))])
    return sha256("".join(_digest_of(path) for path in sorted(modules)).encode()).hexdigest()[:16]


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
    return frozenset(found for name in _names(_tree(path)) if (found := _module(name)))


def _names(tree: ast.Module) -> Iterator[str]:
    """Yield the dotted name of everything that a module imports, and of what it imports from there."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def _module(name: str) -> Path | None:
    """Return the file of a module or package of palpate, or None for what is not one."""
    if not name.startswith("palpate."):
        return None
    place = PACKAGE.parent / name.replace(".", "/")
    found = next((path for path in (place.with_suffix(".py"), place / "__init__.py") if path.is_file()), None)
    return found


@cache
def _tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


@cache
def _digest_of(path: Path) -> str:
    """Return a digest of the syntax tree of a file without its docstrings."""
    tree = _tree(path)
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list) and body:
            node.body = [line for line in body if not _is_text(line)] or [ast.Pass()]
    return sha256(f"{path.name}{ast.dump(tree)}".encode()).hexdigest()


def _is_text(line: ast.AST) -> bool:
    """Return whether a statement is a string that stands alone: a docstring, or the description of a constant."""
    return isinstance(line, ast.Expr) and isinstance(line.value, ast.Constant) and isinstance(line.value.value, str)
