"""Load a model from where it lives: a module of palpate, or a Python file of the user's, which errors name."""

import importlib
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from palpate.benchmark.load import Answer, Load
from palpate.benchmark.model import Case, Model, Setting, Solver, declared, one_stage
from palpate.errors import InputError, NotConverged
from palpate.own_file import MODEL_FUNCTIONS, failure, import_file

GUIDE = "see docs/add-a-model.md"


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

        return _Own(path, solver)

    return Model(settings, one_stage(prepare), str(path), **declared(module, str(path)))


class _Own(Solver):
    """What a user's file prepares: an object with ``respond`` and ``memory_mb``, and if it likes with more."""

    def __init__(self, path: Path, own: Any):
        self._path, self._own = path, own

    @property
    def memory_mb(self) -> float:
        return float(self._own.memory_mb)

    def respond(self, load: Load) -> np.ndarray | Answer:
        return _named(self._path, self._own.respond, load)

    def precede(self, load: Load) -> None:
        if hasattr(self._own, "precede"):
            _named(self._path, self._own.precede, load)

    def prepare_nodes(self, nodes: tuple[int, ...]) -> float | None:
        if not hasattr(self._own, "prepare_contact"):
            return None
        begin = perf_counter()
        _named(self._path, self._own.prepare_contact, *nodes)
        return perf_counter() - begin


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
    functions = partial(module.settings, **keywords), partial(module.offline, **keywords)
    return Model(*functions, place, **declared(module, place))
