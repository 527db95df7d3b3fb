"""What a study declares in its files (tables, figures, claims), read without importing them."""

import ast
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from pkgutil import iter_modules
from typing import NamedTuple

from palpate import benchmark
from palpate.errors import InputError
from palpate.table_declaration import Table

CLAIMS = Table(
    "claims",
    "Each claim of the three papers, the premise that it was tested in, what was published and what this run measured, "
    "the verdict, and the study whose tables it follows from.",
    """
    paper section claim premise published ours verdict study: a claim, where it stands, and what became of it
    """,
)
"""The table that no single study makes."""
STUDIES = "palpate.studies"
"""The package of the studies, which import this one."""
_BENCHMARK = Path(benchmark.__path__[0])


class Declared(NamedTuple):
    """A function that a study declares by ``@figure(name, tables=...)`` or ``@claims(*tables)``."""

    name: str  # of the figure, or of the function
    place: str  # "palpate.studies.<study>.figures:function"
    tables: tuple[str, ...]  # names of the tables that it is called with


def names() -> list[str]:
    """Return the names of all studies that there are."""
    return [module.name for module in iter_modules(import_module(STUDIES).__path__) if module.ispkg]


@cache
def folder(study: str) -> Path:
    """Return the folder of a study."""
    spec = find_spec(f"{STUDIES}.{study}")
    if spec is None or not spec.origin:
        raise InputError(f"There is no study {study} in palpate/studies.")
    return Path(spec.origin).parent


def figures(study: str) -> dict[str, Declared]:
    """Return the figures of a study by name, in the order of its files."""
    return {
        function.name: function for place in ("figures", "report") for function in _decorated(study, place, "figure")
    }


def claims(study: str) -> dict[str, tuple[str, ...]]:
    """Return the functions of a study that judge claims of the papers, by place, with the tables that each gets."""
    return {each.place: each.tables for each in _decorated(study, "claims", "claims")}


@cache
def tables(study: str) -> dict[str, Table]:
    """Return the tables that a study declares, and those of benchmark/ that its report names in READS, by name."""
    declared = [table for path in sorted(folder(study).rglob("*.py")) for table in _tables(path)]
    report = folder(study) / "report.py"
    for statement in ast.parse(report.read_text(encoding="utf-8")).body if report.is_file() else ():
        if isinstance(statement, ast.Assign) and getattr(statement.targets[0], "id", None) == "READS":
            shared = {each.name: each for path in sorted(_BENCHMARK.glob("*.py")) for each in _tables(path)}
            declared += [shared[name] for name in ast.literal_eval(statement.value)]
    return {table.name: table for table in declared}


def table(name: str) -> Table:
    """Return the table of that name of whatever study; KeyError if no study declares it."""
    if name == CLAIMS.name:
        return CLAIMS
    for study in names():
        if name in tables(study):
            return tables(study)[name]
    raise KeyError(f"no study declares a table {name}")


def _tables(path: Path) -> Iterator[Table]:
    """Yield the tables that constants of a module declare, built from its source without importing it."""
    text = path.read_text(encoding="utf-8")
    for statement in ast.parse(text).body if "= Table(" in text else ():
        call = statement.value if isinstance(statement, ast.Assign) else None
        if isinstance(call, ast.Call) and _called(call) == "Table":
            options = {option.arg: ast.literal_eval(option.value) for option in call.keywords if option.arg}
            yield Table(*map(ast.literal_eval, call.args), **options)


def _decorated(study: str, module: str, decorator: str) -> Iterator[Declared]:
    """Yield what ``decorator`` declares of functions in ``module``.py, or in the files of the folder ``module``."""
    module_path = f"{STUDIES}.{study}.{module}"
    file, package = folder(study) / f"{module}.py", folder(study) / module
    files = {f"{module_path}.{path.stem}": path for path in sorted(package.glob("*.py"))}
    files |= {module_path: file} if file.is_file() else {}
    for dotted, path in files.items():
        for statement in ast.parse(path.read_text(encoding="utf-8")).body:
            if not isinstance(statement, ast.FunctionDef):
                continue
            for call in statement.decorator_list:
                if isinstance(call, ast.Call) and _called(call) == decorator:
                    arguments = [ast.literal_eval(value) for value in call.args]
                    options = {option.arg: ast.literal_eval(option.value) for option in call.keywords}
                    if decorator == "figure":
                        yield Declared(arguments[0], f"{dotted}:{statement.name}", tuple(options.get("tables", ())))
                    else:
                        yield Declared(statement.name, f"{dotted}:{statement.name}", tuple(arguments))


def _called(node: ast.Call) -> str:
    """Return the name of what is called, without the module that it is of."""
    return node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
