"""Load models of the user's own from their files, and name the file in whatever goes wrong in them.

Load a model from where it lives: a module of palpate, or a Python file of the user's.
"""

import importlib
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from palpate.benchmark.model import Case, Model, Setting, Solver, declared
from palpate.errors import InputError, NotConverged
from palpate.own_file import MODEL_FUNCTIONS, failure, import_file

GUIDE = "see docs/add-a-model.md"
CALLED = ("respond", "precede")
"""The functions of a prepared model; the second one is optional."""


def load_own(name: str, path: Path) -> Model:
    """Load the model in the file ``path``, which raises InputError naming the file for whatever is wrong with it."""
    module = import_file(path, f"tradeoff.own_models.{name}")
    for function in MODEL_FUNCTIONS:
        if not callable(getattr(module, function.partition("(")[0], None)):
            raise InputError(f"{path}: has no function {function}; {GUIDE}.")

    def settings(case: Case) -> list[Setting]:
        found = _named(path, module.settings, case)
        if not (isinstance(found, list) and all(isinstance(setting, dict) for setting in found)):
            raise InputError(f"{path}: settings returns no list of dictionaries; {GUIDE}.")
        return found

    def prepare(case: Case, setting: Setting) -> Solver:
        solver = _named(path, module.prepare, case, setting)
        if not (hasattr(solver, "respond") and hasattr(solver, "memory_mb")):
            raise InputError(f"{path}: what prepare returns lacks respond or memory_mb; {GUIDE}.")

        asked = {name: partial(_named, path, getattr(solver, name)) for name in CALLED if hasattr(solver, name)}
        return SimpleNamespace(**asked, memory_mb=solver.memory_mb)

    return Model(settings, prepare, str(path), **declared(module, str(path)))


def _named(path: Path, call: Callable, *arguments: Any) -> Any:
    try:
        return call(*arguments)
    except NotConverged:
        raise
    except Exception as error:
        raise InputError(f"{path}: does not work ({failure(error)}); correct it, {GUIDE}.") from error


def load_model(name: str, place: str, keywords: Mapping[str, Any]) -> Model:
    """Load the model ``name`` from a module such as ``palpate.models.fem``, or from a file whose name ends in ``.py``.

    keywords : what both of a module's functions get beside their arguments; a file's get none
    No registry is read, so that whoever measures one model does not depend on the names of the others. InputError for
    whatever is wrong with a file.
    """
    if place.endswith(".py"):
        return load_own(name, Path(place))
    module = importlib.import_module(place)
    functions = partial(module.settings, **keywords), partial(module.prepare, **keywords)
    return Model(*functions, place, **declared(module, place))
