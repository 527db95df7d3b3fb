"""Load a model from where it lives: a module of palpate, or a Python file of the user's."""

import importlib
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

from palpate.benchmark.model import Model, declared


def load_model(name: str, place: str, keywords: Mapping[str, Any]) -> Model:
    """Load the model ``name`` from a module such as ``palpate.models.fem``, or from a file whose name ends in ``.py``.

    keywords : what both of a module's functions get beside their arguments; a file's get none
    No registry is read, so that whoever measures one model does not depend on the names of the others. InputError for
    whatever is wrong with a file.
    """
    if place.endswith(".py"):
        from palpate.models.own_model import load

        return load(name, Path(place))
    module = importlib.import_module(place)
    functions = partial(module.settings, **keywords), partial(module.prepare, **keywords)
    return Model(*functions, place, **declared(module, place))
