"""Load a model from a Python file of the user's, which errors name, and have it answer as palpate's own do."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import fields, is_dataclass
from pathlib import Path
from time import perf_counter
from typing import Any, ClassVar

import numpy as np

from palpate.benchmark.load import Answer, Load
from palpate.benchmark.measuring import Prepared, prepared_settings
from palpate.benchmark.model import Case, LeftOut, Model, Setting, Solver, held_mb
from palpate.benchmark.touch import Touch
from palpate.bodies.body import Body
from palpate.errors import InputError, NotConverged
from palpate.own_file import ANSWERS, MODEL_GUIDE, failure, import_file

END: Any = object()
"""What stands for no further frame."""
TOLERANCE = 1e-8
"""Relative residual at which solvers of a model stop that is asked for touches or motions."""
DECLARED: dict[str, tuple] = {"sees": ("load", "deformation"), "prepared": (False, True), "reduces": ("", "p2")}
"""What a model of the user's may say of itself: the values that each may have, the first if it says nothing."""


class OwnModel(Model):
    """An object of the user's with ``prepare(case)``, as a model."""

    own: Any
    answers: ClassVar[str] = ANSWERS[0]

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
        variants = _named(self.place, self.own.tried, case)
        if not (isinstance(variants, list) and all(isinstance(each, type(self.own)) for each in variants)):
            raise InputError(f"{self.place}: tried returns no list of such models; {MODEL_GUIDE}.")
        return [self.having(own=each) for each in variants]

    def prepare(self, case: Case) -> Solver:
        solver = _named(self.place, self.own.prepare, case)
        if not callable(getattr(solver, self.answers, None)):
            if any(callable(getattr(solver, name, None)) for name in ANSWERS):
                raise LeftOut(f"what it prepares has no {self.answers}", [np.nan])
            raise InputError(f"{self.place}: what prepare returns lacks {', '.join(ANSWERS)}; {MODEL_GUIDE}.")
        return OwnSolver(self.place, solver, getattr(solver, self.answers))


def as_model(own: Any, place: str = "a model", answers: str = ANSWERS[0]) -> Model:
    """Return an object of the user's as a model; InputError for a value in it that is not of those in DECLARED.

    place : what errors name; answers : the method of what it prepares, such as those of ANSWERS
    """
    if isinstance(own, Model) and not place.endswith(".py"):
        return own
    declared = {name: getattr(own, name, values[0]) for name, values in DECLARED.items()}
    for name, value in declared.items():
        if not any(value is each or (isinstance(each, str) and value == each) for each in DECLARED[name]):
            raise InputError(f"{place}: {name} is {value!r}; give {' or '.join(map(repr, DECLARED[name]))}.")
    declarations = declared | {"place": place, "answers": answers}
    declarations |= {"called": type(own).__name__.lower(), "law": str(getattr(own, "law", ""))}
    kind: type[OwnModel] = type("OwnModel", (OwnModel,), {"__module__": __name__, **declarations})
    return kind(own=own)


def load_own(name: str, path: Path, answers: str = ANSWERS[0]) -> Model:
    """Load the model in the file ``path``, which raises InputError naming the file for whatever is wrong with it.

    answers : as of ``as_model``
    """
    module = import_file(path, f"own_models.{name}")
    classes = [
        each
        for each in vars(module).values()
        if isinstance(each, type) and each.__module__ == module.__name__ and callable(getattr(each, "prepare", None))
    ]
    if len(classes) != 1:
        raise InputError(
            f"{path}: has {'several classes' if classes else 'no class'} with prepare(case); {MODEL_GUIDE}."
        )
    return as_model(_named(str(path), classes[0]), str(path), answers)


def own_settings(
    name: str, path: str, answers: str, body: Body, asked: str, radius_m: float, seed: int, progress: Callable = iter
) -> Iterator[Prepared]:
    """Prepare all settings of a model of the user's in turn, for touches or motions of a body: without any sample.

    answers : as of ``as_model``; asked, radius_m, seed : of its ``Case``; progress : wraps the settings
    """
    case = Case.untrained(body, asked, radius_m, seed, TOLERANCE)
    return prepared_settings(case, name, load_own(name, Path(path), answers).tried(case, None), progress=progress)


class OwnSolver(Solver):
    """What a model of the user's prepares: an object that answers by a method, and may have more."""

    def __init__(self, place: str, own: Any, answer: Callable):
        self.whose, self._own, self._answer = place, own, answer

    @property
    def memory_mb(self) -> float:
        return _named(self.whose, lambda: float(getattr(self._own, "memory_mb", held_mb(self._own))))

    def respond(self, load: Any) -> Any:
        return _named(self.whose, self._answer, load)

    def frames(self, motion: Any) -> Iterator[np.ndarray | Answer]:
        """Yield the answers at the ends of frames."""
        made = _named(self.whose, lambda: iter(self._answer(motion)))
        while (frame := _named(self.whose, next, made, END)) is not END:
            yield frame

    def prepare(self, touch: Touch) -> None:
        self.prepare_nodes((touch.node,))

    def precede(self, load: Load) -> None:
        if hasattr(self._own, "precede"):
            _named(self.whose, self._own.precede, load)

    def prepare_nodes(self, nodes: tuple[int, ...]) -> float | None:
        if not hasattr(self._own, "prepare_contact"):
            return None
        begin = perf_counter()
        _named(self.whose, self._own.prepare_contact, *nodes)
        return perf_counter() - begin


def _named(place: str, call: Callable, *arguments: Any) -> Any:
    try:
        return call(*arguments)
    except NotConverged:
        raise
    except (Exception, SystemExit) as error:
        module = "" if place.endswith(".py") else getattr(call, "__module__", "")  # of a script's object
        raise InputError(f"{place}: does not work ({failure(error, module)}); correct it, {MODEL_GUIDE}.") from error
