"""Errors that are reported to the user, and suggestions for misspelt names."""

import warnings
from collections.abc import Iterator
from contextlib import contextmanager


class InputError(ValueError):
    """User input that cannot be used; the message names file, field and remedy in one sentence."""


class NotConverged(RuntimeError):
    """A solver that did not reach its tolerance.

    ``history`` : relative residual after each iteration, oldest first
    """

    def __init__(self, message: str, history: list[float]):
        super().__init__(message)
        self.history = history


def describe_unknown(names: list[str], known: list[str]) -> str:
    """Describe the first of ``names`` that is not in ``known``, with a suggestion; empty if all are known."""
    for name in names:
        if name not in known:
            return f"{name}, which is unknown; {suggest(name, known, 'choose among')}"
    return ""


def suggest(name: str, known: list[str], otherwise: str) -> str:
    """Suggest the entry of ``known`` most like ``name``; if none is like it, list all after the words ``otherwise``."""
    from difflib import get_close_matches

    near = get_close_matches(name, known, n=1)
    return f"did you mean {near[0]}?" if near else f"{otherwise} {', '.join(known)}."


@contextmanager
def about(place: str) -> Iterator[None]:
    """Begin each warning that is raised in the block with ``place``, such as "bodies.liver"; also if it fails."""
    caught: list[warnings.WarningMessage] = []
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", UserWarning)
            yield
    finally:
        for each in caught:
            text = f"{place}: {each.message}" if each.category is UserWarning else each.message
            warnings.warn_explicit(text, each.category, each.filename, each.lineno)


EXTRAS = {
    "SimpleITK": "ct",
    "gmsh": "surfaces",
    "pyvista": "view",
    "vtkmodules": "view",
    "matplotlib": "view",
    "PIL": "view",
    "snakemake": "workflow",
    "jinja2": "workflow",
    "markdown_it": "workflow",
    "cma": "workflow",
}
"""The part of palpate that is installed with each package that not everybody needs."""


@contextmanager
def explained() -> Iterator[None]:
    """Raise InputError, with the command that installs it, for a package of an extra that is not installed."""
    try:
        yield
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        if package not in EXTRAS:
            raise
        raise InputError(f"this needs {package}; type pip install 'palpate[{EXTRAS[package]}]'.") from error
