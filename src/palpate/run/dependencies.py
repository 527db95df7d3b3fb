"""A digest of the code behind a job: a parameter of its rule, as snakemake notices no edits of imported modules."""

import ast
import json
from collections.abc import Iterable
from contextlib import suppress
from functools import cache
from hashlib import sha256
from pathlib import Path

from palpate.files import write_whole
from palpate.table_declaration import Table

PACKAGE = Path(__file__).parents[1]
WRAPPERS = frozenset(
    PACKAGE / name
    for name in ("run/job.py", "run/dependencies.py", "files.py", "errors.py", "__init__.py", "pictures.py")
) | frozenset(PACKAGE.glob("studies/*/settings.py"))
"""Modules around the work; no result depends on them. The settings of studies are parameters of jobs."""
KEPT = PACKAGE / "__pycache__" / f"digests-{sha256(Path(__file__).read_bytes()).hexdigest()[:12]}"
"""Facts of files by the digest of their text, as this version of this module finds them."""


def digest(call: str, *lazily: str) -> str:
    """Return a digest of the code of a function, of the modules named ``lazily``, and of all that these import.

    Comments, docstrings and layout do not count, nor do the dates of the files, nor the rest of the function's module.

    call : "palpate.studies.common_jobs:make_body"
    lazily : modules ("palpate.effects.gravity"), packages ("palpate.effects") or classes ("palpate.models.kinds:FEM")
        that are imported by name at run time
    """
    in_modules = [each.partition(":") for each in (call, *lazily) if ":" in each]
    functions = [needed(_parsed(files_of(module)[0]), name) for module, _, name in in_modules]
    whole_modules = [path for each in lazily if ":" not in each for path in files_of(each)]
    modules = closure([*modules_of({name for part in functions for name in imports(part)}), *whole_modules])
    codes = [f"{path.name}{_facts(path)['code']}" for path in sorted(modules)]
    return sha256("".join([*map(ast.dump, functions), *codes]).encode()).hexdigest()[:16]


def closure(paths: Iterable[Path]) -> set[Path]:
    """Return ``paths`` and every module of palpate that they import anywhere, directly or not, wrappers apart.

    Modules of models import models/kinds.py as types only, which does not count: a rule names the class that it runs.
    """
    files: set[Path] = set()
    waiting = set(paths)
    while waiting:
        files |= waiting
        of_models = {path for path in waiting if PACKAGE / "models" in path.parents}
        imported = modules_of({name for path in waiting - of_models for name in _facts(path)["imports"]})
        classes = {PACKAGE / "models/kinds.py"}
        imported |= modules_of({name for path in of_models for name in _facts(path)["imports"]}) - classes
        waiting = imported - files
    return files


def kernels(path: Path) -> str:
    """Return a digest of the code of ``path`` and of all that it imports, where numba compiles functions."""
    facts = [_facts(module) for module in closure([path])]
    compiled = sorted(each["code"] for each in facts if "numba" in each["imports"])
    return sha256("".join(compiled).encode()).hexdigest()


def files_of(name: str) -> list[Path]:
    """Return the file of a module of palpate, or all files of a package and of the packages inside it."""
    place = PACKAGE.parent / name.replace(".", "/")
    return sorted(place.rglob("*.py")) if place.is_dir() else [place.with_suffix(".py")]


def modules_of(names: Iterable[str]) -> set[Path]:
    """Return the files of those modules and packages of palpate among dotted names, wrappers apart."""
    return {path for name in names if name.startswith("palpate.") and (path := _file(name))} - WRAPPERS


@cache
def _file(name: str) -> Path | None:
    place = PACKAGE.parent / name.replace(".", "/")
    return next((path for path in (place.with_suffix(".py"), place / "__init__.py") if path.is_file()), None)


def imports(tree: ast.AST) -> set[str]:
    """Return the dotted name of everything that is imported, and of what it is imported from."""
    names = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            module = f"{node.module}." if isinstance(node, ast.ImportFrom) else ""
            names |= {module.rstrip(".")} | {f"{module}{alias.name}" for alias in node.names}
    return names


def needed(tree: ast.Module, name: str) -> ast.Module:
    """Return a function, and of its module what it names: imports, constants and other functions.

    LookupError if the module has none of that name.
    """
    statements: list[ast.stmt] = []
    wanted = {name}
    while new := [line for line in tree.body if line not in statements and _bound(line) & wanted]:
        statements += new
        wanted |= {node.id for line in new for node in ast.walk(line) if isinstance(node, ast.Name)}
    if not statements:
        raise LookupError(f"a rule calls {name}, which its module does not have")
    return ast.Module([line for line in tree.body if line in statements], [])


def _bound(line: ast.stmt) -> set[str]:
    """Return the names that a statement gives a value."""
    if isinstance(line, ast.Import | ast.ImportFrom):
        return {alias.asname or alias.name.partition(".")[0] for alias in line.names}
    if isinstance(line, ast.FunctionDef | ast.ClassDef):
        return {line.name}
    return {node.id for node in ast.walk(line) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}


@cache
def _facts(path: Path) -> dict:
    """Return what a file imports, and a digest of its code; kept, as each process of a run would parse all anew."""
    store = KEPT / f"{sha256(path.read_bytes()).hexdigest()}.json"
    with suppress(OSError, ValueError):
        return json.loads(store.read_text())
    tree = _parsed(path)
    facts = {"imports": sorted(imports(tree)), "code": sha256(ast.dump(tree).encode()).hexdigest()}
    with suppress(OSError), write_whole(store) as temporary:
        temporary.write_text(json.dumps(facts))
    return facts


@cache
def _parsed(path: Path) -> ast.Module:
    return _Plain().visit(ast.parse(path.read_bytes()))


class _Plain(ast.NodeTransformer):
    """Leave out docstrings and the words of tables, and import each name by a statement of its own."""

    def visit_Expr(self, node: ast.Expr) -> ast.AST | None:
        return None if isinstance(node.value, ast.Constant) else self.generic_visit(node)

    def visit_ImportFrom(self, node: ast.ImportFrom) -> list[ast.AST]:
        return [ast.ImportFrom(node.module, [alias], node.level) for alias in node.names]

    def visit_Call(self, node: ast.Call) -> ast.AST:
        if getattr(node.func, "id", "") == "Table" and len(node.args) > 2:
            node.args[1:] = [ast.Constant(" ".join(Table(*map(ast.literal_eval, node.args)).columns))]
        return self.generic_visit(node)
