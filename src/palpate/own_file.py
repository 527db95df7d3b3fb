"""Files of the user's own, effects and models: check them before a run, import them, and name what fails in them."""

import ast
import importlib.util
import traceback
from collections.abc import Iterable
from pathlib import Path
from types import ModuleType

from palpate.errors import InputError

EFFECT_FUNCTIONS = ("make(particles, settings, elastic)",)
MODEL_FUNCTIONS = (".prepare(case)",)
LAW_FUNCTIONS = (
    "shape(s, mu, gradient, hessian)",
    "measure(s, gradient, hessian)",
    "volume(theta, mu, lam, derivatives)",
)
"""The functions that the file of an effect has, the method of a class in that of a model, and those of a law."""
ANSWERS = ("respond", "touch", "move")
"""The methods by which what a model prepares answers: a press, a touch, a motion."""
MODEL_GUIDE = "see docs/add-a-model.md"
"""What errors of a model of one's own point to."""
PREFIX = "palpate_own_"
"""How the names of modules that are the user's files begin."""


def check_source(key: str, path: Path, functions: Iterable[str], guide: str) -> None:
    """Raise InputError if a file is no Python or does not define ``functions``, such as "make(particles)".

    key : of the settings, where the file is named; the file is read and not run
    """
    try:
        tree = ast.parse(path.read_text(encoding="utf-8"), str(path))
    except SyntaxError as error:
        raise InputError(f"{key}: {path}, line {error.lineno}, is not Python ({error.msg}); correct it.") from error
    except (UnicodeDecodeError, ValueError) as error:
        raise InputError(f"{key}: {path} is not a text file of Python ({error}); give the path of one.") from error
    defined = set(_defined(tree.body))
    for function in functions:
        if function.partition("(")[0] not in defined and "*" not in defined:
            kind = "class with" if function.startswith(".") else "function"
            raise InputError(f"{key}: {path} has no {kind} {function.removeprefix('.')}; {guide}.")


def answers(path: Path) -> list[str]:
    """Return which of ANSWERS the classes in the file of a model define."""
    defined = set(_defined(ast.parse(path.read_text(encoding="utf-8")).body))
    return [name for name in ANSWERS if f".{name}" in defined]


def _defined(body: list[ast.stmt]) -> Iterable[str]:
    """Yield the names that statements define, and those in their blocks; "*" for an import of everything."""
    for line in body:
        if isinstance(line, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            yield line.name
            yield from (f".{name}" for name in _defined(line.body if isinstance(line, ast.ClassDef) else []))
            continue
        if isinstance(line, ast.Import | ast.ImportFrom):
            yield from (name.asname or name.name for name in line.names)
        yield from (
            node.id for node in ast.walk(line) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
        )
        for block in ("body", "orelse", "finalbody"):
            yield from _defined(getattr(line, block, []))


def import_file(path: Path, key: str) -> ModuleType:
    """Import a file of the user's, given at ``key`` of the config; InputError if that fails."""
    spec = importlib.util.spec_from_file_location(f"{PREFIX}{key.replace('.', '_')}", path)
    if spec is None or spec.loader is None or not Path(path).is_file():
        raise InputError(f"{key} is {path}, which is not a Python file; give the path of one.")
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        raise InputError(f"{path}: cannot be imported ({failure(error)}); correct it.") from error
    return module


def failure(error: BaseException, module: str = "") -> str:
    """Describe an exception by its line in the user's file, if it is of one, its type and its message.

    module : name of the user's own module, such as "__main__", of which the file is named too
    """
    line = _line(error, module or PREFIX)
    said = f"{type(error).__name__}: {error}"
    return said if line is None else f"{f'{line[0]}, ' * bool(module)}line {line[1]}, {said}"


def own_fault(error: BaseException) -> str:
    """Return one sentence for an exception that comes from the user's file, naming it and the line; else nothing."""
    line = _line(error)
    if line is None:
        return ""
    path, number = line
    return f"{path}, line {number}: {type(error).__name__}: {error} (a fault in this file, not palpate's; correct it)"


def _line(error: BaseException, module: str = PREFIX) -> tuple[str, int] | None:
    """Return the file and line of the innermost frame in a file of the user's that an exception passed, if any."""
    users_lines = [
        (frame.f_code.co_filename, line)
        for frame, line in traceback.walk_tb(error.__traceback__)
        if str(frame.f_globals.get("__name__", "")).startswith(module)
    ]
    return users_lines[-1] if users_lines else None
