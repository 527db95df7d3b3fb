"""Models of the user's own: loaded from their files, and blamed by name for what goes wrong in them."""

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from palpate.errors import InputError, NotConverged
from palpate.models.model import Case, Model, Setting, Solver, checked
from palpate.scenes.own_effect import opened

GUIDE = "see docs/add-a-model.md"


def load(name: str, path: Path) -> Model:
    """The model in the file ``path``, which raises InputError naming it for whatever is wrong with it."""
    module = opened(path, f"tradeoff.own_models.{name}")
    for function in ("settings(case)", "prepare(case, setting)"):
        if not callable(getattr(module, function.partition("(")[0], None)):
            raise InputError(f"{path}: has no function {function}; {GUIDE}.")

    def settings(case: Case) -> list[Setting]:
        found = _told(path, module.settings, case)
        if not (isinstance(found, list) and all(isinstance(setting, dict) for setting in found)):
            raise InputError(f"{path}: settings returns no list of dictionaries; {GUIDE}.")
        return found

    def prepare(case: Case, setting: Setting) -> Solver:
        solver = _told(path, module.prepare, case, setting)
        if not (hasattr(solver, "respond") and hasattr(solver, "memory_mb")):
            raise InputError(f"{path}: what prepare returns lacks respond or memory_mb; {GUIDE}.")

        def respond(contact: int, force: np.ndarray) -> np.ndarray:
            answer = _told(path, solver.respond, contact, force)
            return _told(path, checked, answer, case.n_surface)

        return SimpleNamespace(respond=respond, memory_mb=solver.memory_mb)

    return Model(settings, prepare)


def _told(path: Path, call: Callable, *arguments: Any) -> Any:
    try:
        return call(*arguments)
    except NotConverged:
        raise
    except Exception as error:
        raise InputError(f"{path}: does not work ({type(error).__name__}: {error}); mend it, {GUIDE}.") from error
