"""Load a model from where its class lives: ``kinds``, or a Python file of the user's, which errors name."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from importlib import import_module
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from palpate.benchmark.load import Answer, Load
from palpate.benchmark.model import Case, Model, Setting, Solver, held_mb
from palpate.errors import InputError, NotConverged
from palpate.own_file import failure, import_file

GUIDE = "see docs/add-a-model.md"
DECLARED: dict[str, tuple] = {"sees": ("load", "deformation"), "prepared": (False, True), "reduces": ("", "p2")}
"""What a model of the user's may say of itself: the values that each may have, the first if it says nothing."""


class OwnModel(Model):
    """An object of the user's with ``prepare(case)``, as a model."""

    own: Any

    @property
    def said(self) -> Setting:
        if isinstance(self.own, Model):
            return self.own.said
        names = (
            [field.name for field in fields(self.own)]
            if is_dataclass(self.own)
            else list(getattr(self.own, "__dict__", {}))
        )
        return {name: getattr(self.own, name) for name in names}

    def tried(self, case: Case, grid: Any) -> Sequence[Model]:
        """Return what its ``tried(case)`` lists, or itself."""
        if not hasattr(self.own, "tried") or type(self.own).tried is Model.tried:
            return [self]
        found = _named(self.place, self.own.tried, case)
        if not (isinstance(found, list) and all(isinstance(each, type(self.own)) for each in found)):
            raise InputError(f"{self.place}: tried returns no list of such models; {GUIDE}.")
        return [self.having(own=each) for each in found]

    def prepare(self, case: Case) -> Solver:
        solver = _named(self.place, self.own.prepare, case)
        if not hasattr(solver, "respond"):
            raise InputError(f"{self.place}: what prepare returns lacks respond; {GUIDE}.")
        return _Own(self.place, solver)


def as_model(own: Any, place: str = "a model") -> Model:
    """Return an object of the user's as a model; ``place`` is what errors name. InputError for a wrong word of it."""
    if isinstance(own, Model) and not place.endswith(".py"):
        return own
    declared = {name: getattr(own, name, values[0]) for name, values in DECLARED.items()}
    for name, value in declared.items():
        if not any(value is each or (isinstance(each, str) and value == each) for each in DECLARED[name]):
            raise InputError(f"{place}: {name} is {value!r}; give {' or '.join(map(repr, DECLARED[name]))}.")
    told = declared | {"place": place, "called": type(own).__name__.lower(), "law": str(getattr(own, "law", ""))}
    kind: type[OwnModel] = type("OwnModel", (OwnModel,), {"__module__": __name__, **told})
    return kind(own=own)


def load_own(name: str, path: Path) -> Model:
    """Load the model in the file ``path``, which raises InputError naming the file for whatever is wrong with it."""
    module = import_file(path, f"tradeoff.own_models.{name}")
    found = [
        each
        for each in vars(module).values()
        if isinstance(each, type) and each.__module__ == module.__name__ and callable(getattr(each, "prepare", None))
    ]
    if len(found) != 1:
        raise InputError(f"{path}: has {'several classes' if found else 'no class'} with prepare(case); {GUIDE}.")
    return as_model(_named(str(path), found[0]), str(path))


class _Own(Solver):
    """What a model of the user's prepares: an object with ``respond``, and if it likes with more."""

    def __init__(self, place: str, own: Any):
        self._place, self._own = place, own

    @property
    def memory_mb(self) -> float:
        return float(getattr(self._own, "memory_mb", held_mb(self._own)))

    def respond(self, load: Load) -> np.ndarray | Answer:
        return _named(self._place, self._own.respond, load)

    def precede(self, load: Load) -> None:
        if hasattr(self._own, "precede"):
            _named(self._place, self._own.precede, load)

    def prepare_nodes(self, nodes: tuple[int, ...]) -> float | None:
        if not hasattr(self._own, "prepare_contact"):
            return None
        begin = perf_counter()
        _named(self._place, self._own.prepare_contact, *nodes)
        return perf_counter() - begin


def _named(place: str, call: Callable, *arguments: Any) -> Any:
    try:
        return call(*arguments)
    except NotConverged:
        raise
    except Exception as error:
        module = "" if place.endswith(".py") else getattr(call, "__module__", "")  # of a script's object
        raise InputError(f"{place}: does not work ({failure(error, module)}); correct it, {GUIDE}.") from error


def load_model(name: str, place: str, fields: Mapping[str, Any]) -> Model:
    """Load the model ``name``: a class such as "palpate.models.kinds:FEM", or a file whose name ends in ``.py``.

    fields : those of the class that make it this model; a file's has none
    No registry is read, so that whoever measures one model does not depend on the names of the others. InputError for
    whatever is wrong with a file.
    """
    if place.endswith(".py"):
        return load_own(name, Path(place))
    module, _, kind = place.partition(":")
    return getattr(import_module(module), kind)(**fields)
