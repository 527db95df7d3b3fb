"""The modules that a job depends on, and a digest of what they do: jobs are repeated when it changes.

Snakemake does not notice edits of imported modules.
"""

import ast
import json
from collections.abc import Iterable, Iterator
from contextlib import suppress
from copy import deepcopy
from functools import cache
from hashlib import sha256
from pathlib import Path

from palpate.files import write_whole

PACKAGE = Path(__file__).parents[1]
WRAPPERS = frozenset(
    PACKAGE / name for name in ("run/job.py", "run/dependencies.py", "files.py", "errors.py", "__init__.py")
) | frozenset(PACKAGE.glob("studies/*/settings.py"))
"""Modules around the work; no result depends on them. The settings of studies are parameters of jobs."""
KEPT = PACKAGE / "__pycache__" / f"digests-{sha256(Path(__file__).read_bytes()).hexdigest()[:12]}.json"
"""Facts of files by the digest of their text, as this version of this module finds them."""
FACTS = 2000
"""Files of which facts are kept: all modules several times over."""
_FRESH: list[str] = []


def digest(call: str, *lazily: str) -> str:
    """Return a digest of the code of a function, of the modules named ``lazily``, and of all that these import.

    Comments, docstrings and layout do not count, nor do the dates of the files, nor the rest of the function's module.

    call : "palpate.studies.common_jobs:make_body"
    lazily : modules ("palpate.effects.gravity"), packages ("palpate.effects") or classes ("palpate.models.kinds:FEM")
        that are imported by name at run time
    """
    parts, whole = [call, *(each for each in lazily if ":" in each)], [each for each in lazily if ":" not in each]
    # deep copies of trees that are kept, as a digest changes them
    trees = [deepcopy(_part(files_of(module)[0], name)) for module, _, name in (each.partition(":") for each in parts)]
    named = {path for tree in trees for each in _names(tree) if (path := _module(each))} - WRAPPERS
    modules = closure([*named, *(path for each in whole for path in files_of(each))])
    _keep()
    codes = (f"{path.name}{_facts(path)['code']}" for path in sorted(modules))
    return sha256("".join([*map(_digest_of, trees), *codes]).encode()).hexdigest()[:16]


def _part(path: Path, name: str) -> ast.Module:
    """Return a function, and of its module what it names: imports, constants and other functions."""
    lines, found, waiting = _tree(path).body, set(), {name}
    kept: dict[int, ast.stmt] = {}
    while waiting:
        found |= waiting
        fresh = {i: part for i, line in enumerate(lines) if (part := _binding(line, found)) is not None}
        kept |= fresh
        used = {node.id for part in fresh.values() for node in ast.walk(part) if isinstance(node, ast.Name)}
        waiting = used - found
    return ast.Module([kept[i] for i in sorted(kept)], [])


def _binding(line: ast.stmt, names: set[str]) -> ast.stmt | None:
    """Return the part of a statement that binds one of ``names``, or None."""
    if isinstance(line, ast.ImportFrom):
        aliases = [alias for alias in line.names if (alias.asname or alias.name) in names]
        return ast.ImportFrom(line.module, aliases, line.level) if aliases else None
    if isinstance(line, ast.Import):
        return line if any((alias.asname or alias.name.split(".")[0]) in names for alias in line.names) else None
    if isinstance(line, ast.FunctionDef | ast.ClassDef):
        return line if line.name in names else None
    bound = {node.id for node in ast.walk(line) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
    return line if bound & names else None


@cache
def _tree(path: Path) -> ast.Module:
    return ast.parse(path.read_bytes())


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
    """Return the modules of palpate that a file imports anywhere in it.

    What prepares a model imports its class as the type of an argument: a rule names the class, and no other counts.
    """
    found = frozenset(each for name in _facts(path)["imports"] if (each := _module(name)))
    return found - {PACKAGE / "models/kinds.py"} if PACKAGE / "models" in path.parents else found


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
        known[key] = {"imports": sorted(set(_names(tree))), "code": _digest_of(tree), "kernels": _kernels(tree)}
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


def _names(tree: ast.Module, package: str = "palpate") -> Iterator[str]:
    """Yield the dotted name of everything of a package that a module imports, and of what it imports from there."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name.startswith(package))
        elif isinstance(node, ast.ImportFrom) and node.module and node.module.startswith(package):
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def _digest_of(tree: ast.Module) -> str:
    """Return a digest of a syntax tree, which loses its docstrings and the words of its tables."""
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list) and body:
            body[:] = [line for line in body if not _is_text(line)] or [ast.Pass()]
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "Table":
            node.args[1:] = [ast.Constant("\n".join(_columns(one))) for one in node.args[2:3]]
    return sha256(ast.dump(tree).encode()).hexdigest()


def kernels(path: Path) -> str:
    """Return a digest of every statement of ``path`` and of all that it imports, where numba compiles functions.

    Layout and comments do not count, nor where in which module a statement stands.
    """
    found = sorted({each for module in closure([path]) for each in _facts(module)["kernels"]})
    _keep()
    return sha256("".join(found).encode()).hexdigest()


def _kernels(tree: ast.Module) -> list[str]:
    """Return a digest of each statement of a module that imports numba, and nothing of another one."""
    if not any(_names(tree, "numba")):
        return []
    return [sha256(ast.dump(line).encode()).hexdigest()[:12] for line in tree.body]


def _columns(about: ast.AST) -> list[str]:
    """Return the columns that a declared table names, without their meanings."""
    text = about.value if isinstance(about, ast.Constant) else ""
    return [line.partition(":")[0].strip() for line in str(text).splitlines() if line[:8].strip()]


def _is_text(line: ast.AST) -> bool:
    """Return whether a statement is a string that stands alone: a docstring, or the description of a constant."""
    return isinstance(line, ast.Expr) and isinstance(line.value, ast.Constant) and isinstance(line.value.value, str)
