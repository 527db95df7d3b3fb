"""Load a model of touches from where the registry says that it lives."""

from collections.abc import Mapping
from functools import partial
from importlib import import_module
from types import SimpleNamespace
from typing import Any


def load_model(place: str, keywords: Mapping[str, Any]) -> SimpleNamespace:
    """Return ``settings(case)``, ``online(case, setting)`` and LAW of the module ``place``, for ``measure_touches``.

    keywords : which of the module's variants it is
    """
    module = import_module(place)
    functions = {name: partial(getattr(module, name), **keywords) for name in ("settings", "online")}
    return SimpleNamespace(**functions, LAW=getattr(module, "LAW", ""))
